"""The results in a folder, found by what others say that they were made from."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from softslip.config.stages import STAGES
from softslip.errors import DatasetError
from softslip.files.layout import DATASET, FIGURE, PAGE
from softslip.files.products import PAGES, SNAPSHOT
from softslip.files.stamps import LABELLED
from softslip.messages import file_text
from softslip.provenance.product_labels import Parent, Product, read_product

FOUND, MISSING, REPLACED, UNREADABLE = "found", "missing", "replaced", "unreadable"
"""Whether what a product says that it was made from is there: with that content, not at all, with
other content in its place, or as a file that cannot be read."""


def usual_place(stage: str, run: str, title: str = "", suffix: str = DATASET) -> str:
    """Return where the workflow puts a product, below the folder of results.

    Parameters
    ----------
    stage, run, title
        See `provenance.product_labels.Product`; the title matters for figures only.
    suffix
        Of its file.
    """
    if stage in STAGES:
        return f"{stage}/{run}{suffix}"
    if stage != FIGURE:
        return f"{stage}{suffix}"
    if title in PAGES:
        return f"{title}{PAGE}"
    return f"figures/{f'snapshots/{run}' if title == SNAPSHOT else title}{suffix}"


@dataclass(frozen=True)
class Whereabouts:
    """Where something is that a product was made from.

    Attributes
    ----------
    path
        Of its file, or where the workflow would put it.
    state
        One of `FOUND`, `MISSING`, `REPLACED` and `UNREADABLE`.
    product
        What its file says, None unless it was found.
    problem
        What is wrong, empty where it was found.
    """

    path: Path
    state: str
    product: Product | None = None
    problem: str = ""


def _is_other_page(name: str) -> bool:
    """Whether a file is a page that the workflow does not make, as Snakemake's report is."""
    return name.endswith(PAGE) and name.removesuffix(PAGE) not in PAGES


class Archive:
    """The results in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @cached_property
    def files(self) -> tuple[Path, ...]:
        """Every file that may be a result, sorted by its path."""
        return self._listing[0]

    @cached_property
    def closed_folders(self) -> dict[Path, str]:
        """The folders that cannot be looked into, and a sentence for each that says why."""
        return self._listing[1]

    @cached_property
    def _listing(self) -> tuple[tuple[Path, ...], dict[Path, str]]:
        suffixes, refused = (DATASET, *LABELLED), list[OSError]()
        every = (
            Path(folder, name)
            for folder, _, names in os.walk(self.folder, onerror=refused.append)
            for name in names
            if name[0] != "." and name.endswith(suffixes) and not _is_other_page(name)
        )
        files = tuple(sorted(path for path in every if _may_be_file(path)))
        closed = (error for error in refused if isinstance(error, PermissionError))
        return files, {
            Path(error.filename): f"{file_text(error.filename)}: cannot be read ({error.strerror})"
            for error in closed
        }

    def products(self) -> Iterator[Product | DatasetError]:
        """Yield what each file is, or why that is not known, in the order of `files`."""
        for path in self.files:
            try:
                yield read_product(path)
            except DatasetError as error:
                yield error

    def place(self, parent: Parent) -> Path:
        """Return where the workflow puts the dataset of a stage and run."""
        return self.folder / usual_place(parent.stage, parent.run)

    def locate(self, parent: Parent) -> Whereabouts:
        """Say where what has a parent's content is: where the workflow puts it, or anywhere."""
        usual = self._at(self.place(parent), parent)
        elsewhere = self._by_content.get(parent.content) if usual.product is None else None
        return usual if elsewhere is None else Whereabouts(elsewhere.path, FOUND, elsewhere)

    def _at(self, path: Path, parent: Parent) -> Whereabouts:
        try:
            path.stat()
            product = read_product(path)
        except (FileNotFoundError, NotADirectoryError):
            return Whereabouts(path, MISSING, problem=f"{file_text(path)} is not there")
        except OSError as error:
            problem = f"{file_text(path)} cannot be read ({error.strerror})"
            return Whereabouts(path, UNREADABLE, problem=problem)
        except DatasetError as error:
            return Whereabouts(path, UNREADABLE, problem=str(error))
        if product.content != parent.content:
            problem = f"{file_text(path)} now holds something else"
            return Whereabouts(path, REPLACED, problem=problem)
        return Whereabouts(path, FOUND, product)

    @cached_property
    def _by_content(self) -> dict[str, Product]:
        every = [each for each in self.products() if isinstance(each, Product)]
        return {each.content: each for each in reversed(every)}


def _may_be_file(path: Path) -> bool:
    """Return whether something is a file, or may be one as far as one is allowed to look."""
    try:
        return path.is_file()
    except OSError:
        return True
