"""Pages of a report: tables beside the figures, and the movie, each in one file."""

import base64
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from softslip.analysis.comparison_markdown import HEAD, compared_rows
from softslip.files.products import COMPARISON
from softslip.files.stamps import check_figure
from softslip.files.storage import read_dataset, replacing
from softslip.operations.report.html_parts import (
    from_markdown,
    heading,
    html_table,
    page,
    paragraph,
)
from softslip.studies.publish import blocks_of

LARGEST_MOVIE = 1_000_000
"""Size of a movie up to which it is shown within the page [byte]: browsers open no page of more
than two million characters out of a report, in which a movie takes 16/9 of its size."""

ACCURACY = {
    "validation": (
        "Flows with known solutions",
        "The largest error of each quantity over all that was solved, for each level of fidelity, "
        "and the limit that it is held to.",
    ),
    "tradeoff": ("The trade of speed for accuracy", ""),
    "coverage": (
        "Verdicts and errors of estimates",
        "How often a verdict on a made-up series is right, and how often intervals hold the truth.",
    ),
    "elements": (
        "What the elements of a scene cost",
        "Measured on one core, one element left out or added at a time.",
    ),
}
"""Parts of a study that say how accurate the numerics are: heading, and what is to be seen."""

STABILITY = {
    "stability": (
        "At the extremes",
        "What becomes of a run far outside the usual values: it ends correctly, or it is stopped "
        "with an error; none may end wrong without one.",
    ),
    "limits": ("The longest stable steps", "Of each scheme, against the expected ones."),
}
"""Parts of a study that say where the scheme is stable."""


def comparison_page(source: Path) -> bytes:
    """Return the page of a scenario's numbers beside the paper's, from its comparison.

    Raises
    ------
    DatasetError
        When the dataset is missing or damaged.
    """
    comparison = read_dataset(source, stage=COMPARISON)
    parts = [
        paragraph(
            "Numbers that the paper reports, and ours with standard errors. A number that the runs "
            "do not determine is not given; the remark says why."
        )
    ]
    for title, rows in compared_rows(comparison):
        parts += [heading(title), html_table(HEAD, rows)]
    return page("Beside the paper", "\n".join(parts))


def study_page(title: str, parts: Mapping[str, tuple[str, str]], source: Path) -> bytes:
    """Return a page with the tables of some parts of a study, from its datasets.

    Parameters
    ----------
    title
        Of the page.
    parts
        Such as `ACCURACY`.
    source
        Folder of the datasets.

    Raises
    ------
    DatasetError
        When a dataset is missing or damaged.
    """
    blocks = blocks_of(source)
    found = [paragraph(f"From the datasets in {source}; docs/accuracy.md says more.")]
    for name, (section, words) in parts.items():
        found += [heading(section), *([paragraph(words)] if words else [])]
        found.append(from_markdown(blocks[name]))
    return page(title, "\n".join(found))


def movie_page(source: Path) -> bytes:
    """Return a page that plays a movie, or says where it is when it is too large for a report.

    Raises
    ------
    DatasetError
        When the movie is missing or damaged.
    """
    check_figure(source)
    content = source.read_bytes()
    if len(content) > LARGEST_MOVIE:
        size = f"{len(content) / 1e6:.1f} MB"
        body = paragraph(f"The movie has {size}, too many for a report: open {source}.")
    else:
        data = base64.b64encode(content).decode()
        body = f'<video controls loop muted autoplay src="data:video/mp4;base64,{data}"></video>'
    return page("The sample as it yields", body)


PAGES: Mapping[str, Callable[[Path], bytes]] = {
    "comparison": comparison_page,
    "accuracy": partial(study_page, "How accurate the numerics are", ACCURACY),
    "stability": partial(study_page, "Where the scheme is stable", STABILITY),
    "movie": movie_page,
}
"""What makes each page, from a dataset, the folder of a study, or a movie."""


def write_page(name: str, source: Path, path: Path) -> None:
    """Write one of `PAGES` under its final name in one step.

    Raises
    ------
    DatasetError
        When what it shows is missing or damaged.
    StorageError
        When it cannot be written.
    """
    content = PAGES[name](source)
    with replacing(path) as temporary:
        temporary.write_bytes(content)
