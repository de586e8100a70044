"""The first page of a report: what was run, with which code, and what is missing."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from softslip.analysis.figures.markers import MEANINGS, verdicts
from softslip.analysis.observables.tables import DONE
from softslip.config.scenario import Scenario
from softslip.config.stages import STAGES
from softslip.errors import DatasetError
from softslip.files.expected_results import expected_results
from softslip.files.products import EXPLORER
from softslip.files.storage import read_dataset
from softslip.messages import counted, duration, enumerated
from softslip.operations.report.html_parts import heading, html_table, item_list, paragraph
from softslip.operations.scenario_status import (
    STATES,
    RunStatus,
    ScenarioStatus,
    scenario_status,
)
from softslip.provenance.product_labels import Product, read_product

MOST_LISTED = 20
"""Runs and results that are named one by one."""

MOST_VALUES = 5
"""Different versions of the same thing that are named."""

NOT_STUDIED = (
    "Accuracy and stability of the numerics: this folder has no results/published/numerics; a "
    "clone of the repository has."
)
"""Said where the report shows no study."""

_SERIES = {
    "shear rate of the walls": "steady_wall",
    "shear rate of the bulk": "steady_bulk",
    "slip velocity": "steady_slip",
}


def first_page(scenario: Scenario, results: Path, *, studied: bool) -> str:
    """Return the first page of a report on a scenario's results, as they are now.

    Parameters
    ----------
    scenario
        What was to be run.
    results
        Folder of its results.
    studied
        Whether the report shows a study of the numerics.

    Returns
    -------
        HTML, to be put into a page.

    Raises
    ------
    DatasetError
        When the folder cannot be read.
    """
    status = scenario_status(scenario, results)
    products, unreadable = _products(scenario, results)
    parts = [
        f"<h1>{scenario.name}</h1>",  # Letters, digits, - and _.
        paragraph(scenario.description),
        *_what_was_run(scenario, status, results),
        *_what_is_missing(scenario, status, results, unreadable),
        *([] if studied else [paragraph(NOT_STUDIED)]),
        *_with_which_code(products),
        *_more(scenario, results),
    ]
    return "\n".join(parts)


def _products(scenario: Scenario, results: Path) -> tuple[list[Product], list[str]]:
    """Return the results that are there, and a sentence for each that cannot be read."""
    products, unreadable = list[Product](), list[str]()
    for each in expected_results(scenario):
        if (results / each.name).exists():
            try:
                products.append(read_product(results / each.name))
            except DatasetError as error:
                unreadable.append(str(error))
    return products, unreadable


def _what_was_run(scenario: Scenario, status: ScenarioStatus, results: Path) -> Iterator[str]:
    yield heading("What was run")
    yield paragraph(
        f"{counted(len(scenario.runs()), 'run')}"
        + (", all combinations of:" if scenario.axes else ".")
    )
    rows = [(axis.path, ", ".join(map(str, axis.values))) for axis in scenario.axes]
    if rows:
        yield html_table(("Swept", "Values"), rows)
    counts = {stage: status.counts(stage) for stage in STAGES}
    seen = [state for state in STATES if any(counts[stage][state] for stage in STAGES)]
    yield html_table(
        ("Stage", *seen),
        [(stage, *(str(counts[stage][state]) for state in seen)) for stage in STAGES],
    )
    yield from _steadiness(results)


def _steadiness(results: Path) -> Iterator[str]:
    """Yield how many runs have reached a steady state, where they were gathered."""
    path = results / "flow_curve.nc"
    if not path.exists():
        return  # It is among what is missing.
    try:
        curve = read_dataset(path, stage="flow_curve")
    except DatasetError as error:
        yield paragraph(f"Whether runs are steady is not known: {error}")
        return
    done = np.ravel(curve["status"].values == DONE)
    rows = []
    for name, flag in _SERIES.items():
        found = Counter(verdicts(curve, flag)[done].tolist())
        rows.append((name, *(str(found[verdict]) for verdict in MEANINGS)))
    yield paragraph("Finished runs by the verdict on their steady state:")
    yield html_table(("", *MEANINGS), rows)


def _with_which_code(products: Sequence[Product]) -> Iterator[str]:
    if not products:
        return
    records = [product.provenance for product in products]
    rows = [
        ("commit", _listed(map(_commit, records))),
        ("software", _listed(str(each.get("environment", "unknown")) for each in records)),
        ("processor", _listed(str(each.get("processor", "unknown")) for each in records)),
        ("machines", str(len({each.get("host") for each in records}))),
        ("processor time", duration(sum(float(each.get("core_seconds", 0)) for each in records))),
        ("first begun", min(_minute(each, "started") for each in records)),
        ("last ended", max(_minute(each, "ended") for each in records)),
    ]
    yield heading("With which code and on what")
    yield html_table((), rows)


def _commit(record: Mapping[str, Any]) -> str:
    commit = str(record.get("commit", "unknown"))
    return f"{commit} with changes that were not committed" if record.get("dirty") else commit


def _minute(record: Mapping[str, Any], when: str) -> str:
    """Return a time to the minute."""
    stamp = str(record.get(when, "unknown"))
    return f"{stamp[:16].replace('T', ' ')} UTC" if when in record else stamp


def _listed(values: Iterator[str]) -> str:
    """Return the different ones of some values, the most frequent first."""
    return enumerated([value for value, _ in Counter(values).most_common()], MOST_VALUES)


def _what_is_missing(
    scenario: Scenario,
    status: ScenarioStatus,
    results: Path,
    unreadable: Sequence[str],
) -> Iterator[str]:
    open_runs = [run for run in status.runs if run.state != "done"]
    expected = [each for each in expected_results(scenario) if each.rule not in STAGES]
    gone = [each.name for each in expected if not (results / each.name).exists()]
    yield heading("What is missing")
    if not (open_runs or gone or unreadable):
        yield paragraph("Nothing: every run is done, and every table and figure is there.")
    if open_runs:
        yield paragraph(f"Runs that are not done, stage by stage ({len(open_runs)}):")
        yield html_table(("Stage", "Run", "State", "Remark"), map(_row, open_runs[:MOST_LISTED]))
        yield from _and_more(len(open_runs), f"softslip status {scenario.name} --all")
    if gone:
        yield paragraph("Tables and figures; snakemake makes them when all their runs are done:")
        yield item_list(gone[:MOST_LISTED])
        yield from _and_more(len(gone), f"softslip crate {scenario.name} --partial")
    if unreadable:
        yield paragraph("Results that cannot be read:")
        yield item_list(unreadable[:MOST_LISTED])
        yield from _and_more(len(unreadable), f"softslip verify {scenario.name}")


def _and_more(count: int, command: str) -> Iterator[str]:
    if count > MOST_LISTED:
        yield paragraph(f"and {count - MOST_LISTED} more; to list them all: {command}")


def _row(run: RunStatus) -> tuple[str, str, str, str]:
    """Return the cells of a run that is not done."""
    where = ", ".join(f"{name} {value}" for name, value in run.coordinates.items())
    remarks = [] if run.failure is None else [str(run.failure)]
    if run.progress is not None:
        remarks.append(f"{run.progress.fraction:.0%} done")
    name = f"{run.run} ({where})" if where else run.run
    return run.stage, name, run.state, ", ".join(remarks)


def _more(scenario: Scenario, results: Path) -> Iterator[str]:
    yield heading("More")
    yield item_list(
        (
            f"{results}/{EXPLORER}.html shows all runs, to filter and to click.",
            f"softslip verify {scenario.name} checks that nothing was changed, lost or mixed up.",
            f"softslip trace {results}/figures/fig5.png says what a figure was made from.",
        )
    )
