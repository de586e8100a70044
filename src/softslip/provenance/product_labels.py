"""What a file of results says that it was made from, read from its labels."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from softslip.errors import DatasetError
from softslip.files.labels import LABELS, text_attributes
from softslip.files.layout import DATASET, FIGURE
from softslip.files.products import PAGES
from softslip.files.stamps import LABELLED, read_labels
from softslip.files.storage import CONTENT_DIGEST, RECORD_DIGEST, VOLATILE
from softslip.messages import file_text

PASSING = frozenset({*VOLATILE, CONTENT_DIGEST, RECORD_DIGEST})
"""Labels in which a result and its rerun may differ: when and where, and the digests of it all."""


@dataclass(frozen=True)
class Parent:
    """What a product says of something that it was made from.

    Attributes
    ----------
    stage, run
        Which it was.
    content, record
        Its digests, see `files.storage`; the second is empty where it was not noted.
    """

    stage: str
    run: str
    content: str
    record: str


@dataclass(frozen=True)
class Product:
    """A file of results, by its labels.

    Attributes
    ----------
    path
        Where it is.
    stage, run
        Which it is; the stage of every figure is `FIGURE`, and its run is that of its first
        dataset: a run of the shear stage, a scenario or a study.
    title
        For people; of a figure its name.
    content, record
        Its digests as it states them; whether they are right is not looked at.
    parents
        What it was made from.
    parameters
        That it depends on: of a run those of its stage, of what is gathered those of the scenario.
    provenance
        Code, software, machine, times and effort; empty where they were not noted.
    """

    path: Path
    stage: str
    run: str
    title: str
    content: str
    record: str
    parents: tuple[Parent, ...]
    parameters: Mapping[str, Any]
    provenance: Mapping[str, Any]

    @property
    def is_figure(self) -> bool:
        """Whether it is a figure."""
        return self.stage == FIGURE

    @property
    def is_page(self) -> bool:
        """Whether it is a page for a browser."""
        return self.is_figure and self.title in PAGES

    @property
    def label(self) -> str:
        """What people call it: stage and run, or a figure's name and run."""
        return f"{self.title if self.is_figure else self.stage} {self.run}"


def read_product(path: Path) -> Product:
    """Read the labels of a file of results; its numbers or pixels are not looked at.

    Raises
    ------
    DatasetError
        When the file is missing, cannot be read, or has no labels.
    """
    if path.suffix != DATASET and path.suffix not in LABELLED:
        endings = ", ".join((DATASET, *LABELLED))
        raise DatasetError(f"{file_text(path)}: is no result; give a file that ends in {endings}")
    if path.suffix != DATASET:
        return product_of(path, read_labels(path))
    return product_of(path, text_attributes(path, LABELS))


def product_of(path: Path, labels: Mapping[str, Any]) -> Product:
    """Return what a file of results is, by labels that were read from it.

    Raises
    ------
    DatasetError
        When they are not those of a result.
    """
    missing = [key for key in ("stage", "run", CONTENT_DIGEST, RECORD_DIGEST) if key not in labels]
    if missing:
        raise DatasetError(
            f"{file_text(path)}: has no {missing[0]}; it is no result, or of an earlier release: "
            "delete it and rerun its job"
        )
    try:
        return _product(path, labels)
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise DatasetError(
            f"{file_text(path)}: has labels that cannot be read ({error}); delete it and rerun "
            "its job"
        ) from error


def _product(path: Path, labels: Mapping[str, Any]) -> Product:
    provenance = _mapping(labels.get("provenance", {}))
    records = provenance.get("parent_records", [])
    listed = labels.get("parents", [])
    stated = json.loads(listed) if isinstance(listed, str) else listed
    # Both lists are written together; where one was not, its half is unknown.
    records = records if len(records) == len(stated) else [""] * len(stated)
    parents = tuple(
        Parent(str(each["stage"]), str(each["run"]), str(each[CONTENT_DIGEST]), str(record))
        for each, record in zip(stated, records, strict=True)
    )
    return Product(
        path=path,
        stage=str(labels["stage"]),
        run=str(labels["run"]),
        title=str(labels.get("title", "")),
        content=str(labels[CONTENT_DIGEST]),
        record=str(labels[RECORD_DIGEST]),
        parents=parents,
        parameters=_mapping(labels.get("parameters", {})),
        provenance=provenance,
    )


def _mapping(value: Any) -> dict[str, Any]:
    return dict(json.loads(value) if isinstance(value, str) else value)
