"""What the workflow makes of a scenario: tables, fits and figures, and where each is."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from softslip.config.scenario import Scenario
from softslip.config.stages import STAGES
from softslip.files.layout import DATASET
from softslip.files.stamps import FIGURE

TABLES = ("flow_curve", "creep", "profiles")
"""Datasets over all runs of a scenario."""

FITS = "fits"
"""Stage of the laws fitted to the flow curve."""

OVERVIEWS = ("flow_curves", "creep", "profiles")
"""Figures of all runs of a scenario."""

SNAPSHOT = "snapshot"
"""Figure of one run."""

ANY_MORE = "..."
"""Stands for any number of further datasets of the kind before it."""

FIGURES: Mapping[str, tuple[str, ...]] = {
    "flow_curves": ("flow_curve", FITS),
    "creep": ("creep",),
    "profiles": ("profiles",),
    SNAPSHOT: ("shear",),
    "benchmark": ("bench/scaling", "bench", ANY_MORE),
    "trajectory": ("bench/trajectory",),
    "validation": ("validation", ANY_MORE),
    "tradeoff": ("tradeoff",),
    "extrapolation": ("tradeoff",),
    "stability_map": ("stability_map",),
    "stability_limit": ("limits",),
}
"""Figures, and the datasets that each shows: their stage, or their stage and run."""


@dataclass(frozen=True)
class Wanted:
    """A result that the workflow makes of a scenario.

    Attributes
    ----------
    rule
        The rule of the workflow that makes it.
    stage, run
        What it says that it is.
    name
        Its path in the folder of the results, with slashes.
    """

    rule: str
    stage: str
    run: str
    name: str

    @property
    def benchmark(self) -> str:
        """Where Snakemake notes what the job took, in the folder of the results."""
        return f"benchmarks/{self.name.rpartition('.')[0]}.tsv"


def wanted(scenario: Scenario) -> Iterator[Wanted]:
    """Yield every result that the workflow makes of a scenario, parents before children."""
    for stage in STAGES:
        for run in scenario.stage_table(stage):
            yield Wanted(stage, stage, run, f"{stage}/{run}{DATASET}")
    for table in TABLES:
        yield Wanted("gather", table, scenario.name, f"{table}{DATASET}")
    yield Wanted("fit", FITS, scenario.name, f"{FITS}{DATASET}")
    for figure in OVERVIEWS:
        yield Wanted("figure", FIGURE, scenario.name, f"figures/{figure}.png")
    for run, row in scenario.stage_table("shear").items():
        if row.parameters.recording.snapshots:
            yield Wanted("snapshot", FIGURE, run, f"figures/snapshots/{run}.png")
