"""Runs as their files tell of themselves, without a look at their data.

Names of what can be asked of a run: parameters by path, label or the last part of their path, and
what the provenance says.
"""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from softslip.config.fields import all_fields, extra
from softslip.config.parameters import Parameters
from softslip.config.stages import STAGES
from softslip.config.sweep import labels_of
from softslip.errors import DatasetError
from softslip.files.labels import LABELS, text_attributes
from softslip.files.layout import DATASET
from softslip.files.products import TABLES
from softslip.files.storage import CONTENT_DIGEST, RECORD_DIGEST
from softslip.messages import brief, file_text
from softslip.provenance.archive import Archive
from softslip.provenance.trees import flat_tree

LAST = STAGES[-1]
"""Stage whose runs are meant where nothing is said of stages."""

DONE = "done"
"""State of a run that has its file."""

IDENTITY = ("run", "stage", "state", "parent", "file", "content_sha256", "record_sha256")
"""What each run has besides parameters and provenance."""

BY_BEGINNING = frozenset(
    {
        "run",
        "parent",
        "commit",
        "fingerprint",
        "environment",
        "lock_sha256",
        "content_sha256",
        "record_sha256",
        "started",
        "ended",
    }
)
"""Names that are equal to any text that they begin with, as git has it: digests and dates."""


@dataclass(frozen=True)
class StoredRun:
    """A run of a stage, by what its file says, or its scenario where there is no file yet.

    Attributes
    ----------
    stage, run
        Which it is.
    path
        Where its dataset is, or will be.
    state
        ``done``, or what `operations.scenario_status` says of one that is not.
    parameters
        That it depends on, by their dotted paths.
    labels
        Values that its scenario sweeps and that are no parameters of its stage, such as a
        fidelity, by the labels of their axes.
    attributes
        Of its file: digests, provenance, parent.
    """

    stage: str
    run: str
    path: Path
    state: str
    parameters: Mapping[str, Any]
    labels: Mapping[str, Any] = field(default_factory=dict)
    attributes: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def provenance(self) -> Mapping[str, Any]:
        """Code, software, machine, times and effort; empty where they were not noted."""
        record = json.loads(self.attributes.get("provenance", "{}"))
        return {key: value for key, value in record.items() if key != "parent_records"}

    @cached_property
    def values(self) -> Mapping[str, Any]:
        """Everything that can be asked for, by name: `names` says which names there are."""
        own = {
            "run": self.run,
            "stage": self.stage,
            "state": self.state,
            "file": str(self.path),
            **{
                name: str(self.attributes[name])
                for name in ("parent", CONTENT_DIGEST, RECORD_DIGEST)
                if name in self.attributes
            },
        }
        by_path = {
            name: self.parameters[path]
            for name, path in label_paths().items()
            if path in self.parameters
        }
        return {**self.provenance, **by_path, **self.parameters, **self.labels, **own}


@cache
def label_paths() -> Mapping[str, str]:
    """Return the paths of parameters by their labels and by the last part of their paths.

    What is ambiguous is left out: `shared_leaves` says which these are.
    """
    fields = all_fields(Parameters)
    labels = {str(extra(field, "label")): path for path, field in fields.items()}
    shared = shared_leaves()
    leaves = {path.rpartition(".")[2]: path for path in fields}
    labels.pop("None", None)
    return {leaf: path for leaf, path in leaves.items() if leaf not in shared} | labels


@cache
def shared_leaves() -> Mapping[str, tuple[str, ...]]:
    """Return the last parts that several paths share, and these paths."""
    fields = all_fields(Parameters)
    counts = Counter(path.rpartition(".")[2] for path in fields)
    labels = {extra(field, "label") for field in fields.values()}
    return {
        leaf: tuple(path for path in fields if path.rpartition(".")[2] == leaf)
        for leaf, count in counts.items()
        if count > 1 and leaf not in labels
    }


def read_folder(folder: Path) -> tuple[list[StoredRun], list[Mapping[str, Any]], list[str]]:
    """Return the runs below a folder, the parameters of its tables, and what was left out.

    Hidden files and folders are passed over. Of two files of a run the first counts.

    Returns
    -------
    tuple of list of StoredRun, list of mapping and list of str
        Of what was left out, a sentence for each file that says why.
    """
    runs: dict[tuple[str, str], StoredRun] = {}
    tables: list[Mapping[str, Any]] = []
    archive = Archive(folder)
    unreadable = [f"{problem}; it is left out" for problem in archive.closed_folders.values()]
    for path in archive.files:
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if hidden or path.suffix != DATASET:
            continue
        try:
            attributes = text_attributes(path, LABELS)
            stage = attributes.get("stage")
            if stage in TABLES:
                tables.append(_object(path, attributes, "parameters"))
            if stage not in STAGES:
                continue
            run = _stored(path, attributes)
            twin = runs.setdefault((run.stage, run.run), run)
            if twin.attributes.get(CONTENT_DIGEST) != attributes.get(CONTENT_DIGEST):
                raise DatasetError(f"{file_text(path)}: differs from {file_text(twin.path)}")
        except DatasetError as error:
            unreadable.append(f"{error}; it is left out")
    return list(runs.values()), tables, unreadable


def _stored(path: Path, attributes: Mapping[str, Any]) -> StoredRun:
    for key in ("run", CONTENT_DIGEST):
        if not isinstance(attributes.get(key), str):
            raise DatasetError(f"{file_text(path)}: has no {key}, as files of an earlier release")
    _object(path, attributes, "provenance")
    return StoredRun(
        stage=attributes["stage"],
        run=attributes["run"],
        path=path,
        state=DONE,
        parameters=flat_tree(_object(path, attributes, "parameters")),
        attributes=attributes,
    )


def with_file(run: StoredRun) -> StoredRun:
    """Return a run of a scenario with what its file says of it.

    Raises
    ------
    DatasetError
        When the file cannot be read, or is of another run.
    """
    attributes = text_attributes(run.path, LABELS)
    for key, expected in (("stage", run.stage), ("run", run.run)):
        if attributes.get(key) != expected:
            stated = brief(attributes.get(key))
            raise DatasetError(f"{file_text(run.path)}: is of {key} {stated}, not {expected!r}")
    return replace(_stored(run.path, attributes), labels=run.labels)


def _object(path: Path, attributes: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return an attribute that is a JSON object; an empty one where there is none."""
    try:
        found = json.loads(attributes.get(name, "{}"))
    except (TypeError, ValueError, RecursionError) as error:
        raise DatasetError(f"{file_text(path)}: {name} cannot be read ({error})") from None
    if not isinstance(found, dict):
        raise DatasetError(f"{file_text(path)}: {name} is no JSON object")
    return found


def swept_parameters(
    runs: Sequence[StoredRun], tables: Sequence[Mapping[str, Any]]
) -> dict[str, str]:
    """Return the paths of what is swept by their labels.

    Parameters
    ----------
    runs
        Those of the last stage count.
    tables
        Parameters of gathered tables, whose axes come first, in their order; after them comes
        whatever else the runs differ in.
    """
    last = [run for run in runs if run.stage == LAST]
    varied: dict[str, str] = {}
    for run in last:
        for path, value in run.parameters.items():
            text = json.dumps(value)
            if varied.setdefault(path, text) != text:
                varied[path] = ""
    fields = all_fields(Parameters)
    named = [path for table in tables for path in table.get("axes", {})]
    known = [path for path in dict.fromkeys(named) if path in varied and path in fields]
    paths = [*known, *(path for path in fields if varied.get(path) == "" and path not in known)]
    return {label: path for path, label in labels_of(paths).items()}
