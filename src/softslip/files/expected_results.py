"""The results that the workflow makes of a scenario, and which run a figure of one run shows."""

import math
from collections.abc import Container, Iterator
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING

from softslip.config.fields import value_at
from softslip.config.paper_material import MATERIAL, departures
from softslip.config.stages import STAGES
from softslip.files.layout import DATASET, FIGURE, PAGE, benchmark_of
from softslip.files.products import (
    DATASETS,
    FIGURES,
    MOVIE,
    PAGES,
    SNAPSHOT,
    FigureEntry,
    figures_of,
)

if TYPE_CHECKING:
    from softslip.config.scenario import Scenario

UNLIKE = 100.0
"""Distance, in logarithms, of a run without a stress from one with any."""


def finished_shears(results: Path) -> frozenset[str]:
    """Return the runs whose shear is done, by their files in a folder of results."""
    return frozenset(path.stem for path in (results / "shear").glob(f"*{DATASET}"))


def run_shown(
    figure: FigureEntry, scenario: "Scenario", among: Container[str] | None = None
) -> str | None:
    """Return the run of a scenario that a figure of one run shows.

    Of the runs that keep enough snapshots it is the nearest to the paper's sample, by the sum of
    the differences in roughness and in the logarithms of stress and time; runs of the paper's
    material come before others, and among equals the first.

    Parameters
    ----------
    figure
        An entry with a sample.
    scenario
        Where to look.
    among
        Which runs are there, as those of a scenario that is not finished; all by default.

    Returns
    -------
    str or None
        Its identity in the shear stage; None where no run keeps enough snapshots.
    """
    sample = resolve_name(figure.sample)
    nearest: tuple[tuple[int, float], str] | None = None
    for run, row in scenario.stage_table("shear").items():
        given = row.parameters
        times = [time for time in given.recording.snapshots if time > 0]
        if len(times) < figure.snapshots or (among is not None and run not in among):
            continue
        values = {path: value_at(given, path) for path in MATERIAL}
        distance = min(abs(math.log(time / sample.time)) for time in times)
        if sample.roughness is not None:
            distance += abs(given.wall.roughness - sample.roughness)
        # A run at rest, or one whose shear rate is imposed, is no nearer than any under stress.
        stress = given.rheometer.stress
        distance += abs(math.log(stress / sample.stress)) if stress else UNLIKE
        place = len(list(departures(values))), distance
        if nearest is None or place < nearest[0]:
            nearest = place, run
    return None if nearest is None else nearest[1]


@dataclass(frozen=True)
class ExpectedResult:
    """A result that the workflow makes of a scenario.

    Attributes
    ----------
    rule
        The rule of the workflow that makes it.
    stage, run
        What its labels say that it is.
    name
        Its path in the folder of the results, with slashes.
    figure
        Which figure or page it is, nothing if it is a dataset.
    """

    rule: str
    stage: str
    run: str
    name: str
    figure: str = ""

    @property
    def benchmark(self) -> str:
        """Where Snakemake notes what the job took, in the folder of the results."""
        return benchmark_of(self.name)


def expected_results(
    scenario: "Scenario", among: Container[str] | None = None
) -> Iterator[ExpectedResult]:
    """Yield every result that the workflow makes of a scenario, parents before children.

    A figure that shows the run nearest to the paper's sample takes it from those ``among`` which it
    is to be, as of a scenario that is not finished; from all by default.
    """
    for stage in STAGES:
        for run in scenario.stage_table(stage):
            yield ExpectedResult(stage, stage, run, f"{stage}/{run}{DATASET}")
    for table in DATASETS.values():
        yield ExpectedResult(table.rule, table.name, scenario.name, f"{table.name}{DATASET}")
    for figure in (*figures_of("figure"), *figures_of(MOVIE)):
        entry = FIGURES[figure]
        shown = run_shown(entry, scenario, among) if entry.sample else scenario.name
        if shown is not None:
            name = f"figures/{figure}{entry.suffix}"
            yield ExpectedResult(entry.rule, FIGURE, shown, name, figure)
    for run, row in scenario.stage_table("shear").items():
        if row.parameters.recording.snapshots:
            name = f"figures/snapshots/{run}.png"
            yield ExpectedResult(SNAPSHOT, FIGURE, run, name, SNAPSHOT)
    for page, entry in PAGES.items():
        yield ExpectedResult(entry.rule, FIGURE, scenario.name, f"{page}{PAGE}", page)
