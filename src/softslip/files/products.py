"""What the workflow makes of runs: tables, fits, figures and pages, one entry each.

A new figure is a function that draws it and its entry in `FIGURES`; a new table is a function that
gathers it and its entry in `DATASETS`; a page for a browser has its entry in `PAGES`. Functions
are named by text, ``module:function``, and imported by those who call them, so that neither the
workflow nor the stages need what draws.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from softslip.config.stages import STAGES

ANY_MORE = "..."
"""Stands for any number of further datasets of the kind before it."""

FITS = "fits"
"""Stage of the laws fitted to the flow curve."""

COMPARISON = "comparison"
"""Stage of what is held against the paper."""

EFFORT = "effort"
"""Stage of what the runs of a scenario took, which no rule makes: it is there once published."""

REPRODUCTION = "reproduction"
"""Stage of what published runs are beside the same runs made again, which no rule makes either."""

WITHOUT_RULE = (EFFORT, REPRODUCTION)
"""Stages of results of a scenario that say something of others, and are not made again."""

SNAPSHOT = "snapshot"
"""Figure of one run, and its rule."""

EXPLORER = "explorer"
"""Page that shows all runs of a scenario, its rule and its command."""

MOVIE = "movie"
"""Movie of one run, and its rule."""

MOVIE_SNAPSHOTS = 5
"""Fewest snapshots of a run that a movie is made of."""


@dataclass(frozen=True)
class TableEntry:
    """A dataset over all runs of a scenario.

    Attributes
    ----------
    name
        Of its stage and its file.
    rule
        The rule of the workflow that makes it, and its command.
    parents
        The stages of what it is made from.
    function
        What computes it.
    summary
        One or two sentences for people who look for data.
    schema
        What it must look like: a `files.schema.Schema`; empty where it is not checked.
    level
        How far the data have come from the simulation.
    """

    name: str
    rule: str
    parents: tuple[str, ...]
    function: str
    summary: str
    schema: str = ""
    level: str = "averages of simulations"


@dataclass(frozen=True)
class FigureEntry:
    """A figure, or a page for a browser.

    Attributes
    ----------
    name
        Of the figure and its file.
    rule
        The rule of the workflow that draws it: ``figure`` shows all runs of a scenario, `SNAPSHOT`
        and `MOVIE` one run, `EXPLORER` is a page; ``bench_figure`` and ``numerics_figure`` show
        measurements of the software.
    parents
        The datasets that it shows: their stage, or their stage and run.
    function
        What draws it from these datasets.
    sample
        Where a figure of a scenario shows one run: the `analysis.paper.Sample` that the paper
        shows, of which the run is the nearest.
    snapshots
        How many snapshots that run has at least.
    suffix
        Of its file, as the workflow draws it.
    summary
        What a figure of a scenario shows, in a few words.
    """

    name: str
    rule: str
    parents: tuple[str, ...]
    function: str
    sample: str = ""
    snapshots: int = 1
    suffix: str = ".png"
    summary: str = ""


_OBSERVABLES = "softslip.analysis.observables.tables"
_FIGURES = "softslip.analysis.figures"
_PAPER = "softslip.analysis.paper"
_SCHEMAS = "softslip.files.table_schemas"

DATASETS: Mapping[str, TableEntry] = {
    entry.name: entry
    for entry in (
        TableEntry(
            "flow_curve",
            "gather",
            ("shear",),
            f"{_OBSERVABLES}:flow_curve",
            "Steady shear rates and slip velocities of dense suspensions of soft particles, with "
            "standard errors, for each stress and wall.",
            f"{_SCHEMAS}:FLOW_CURVE",
        ),
        TableEntry(
            "creep",
            "gather",
            ("shear",),
            f"{_OBSERVABLES}:creep",
            "Shear rates and slip velocities of dense suspensions of soft particles in time since "
            "the stress began.",
            f"{_SCHEMAS}:CREEP",
        ),
        TableEntry(
            "profiles",
            "gather",
            ("shear",),
            f"{_OBSERVABLES}:profiles",
            "Mean velocity profiles between the walls of dense suspensions of soft particles in "
            "steady flow.",
            f"{_SCHEMAS}:PROFILES",
        ),
        TableEntry(
            "structure",
            "gather",
            ("shear",),
            "softslip.analysis.observables.structure:structure",
            "Shapes of particles, films along walls, fluidity and lengths of correlation in dense "
            "suspensions of soft particles in steady flow.",
            f"{_SCHEMAS}:STRUCTURE",
        ),
        TableEntry(
            FITS,
            "fit",
            ("flow_curve",),
            "softslip.analysis.fits:fit_laws",
            "Parameters of the Herschel-Bulkley law and of laws of wall slip, with standard "
            "errors, fitted to steady flow of dense suspensions of soft particles.",
            "softslip.files.fit_schemas:FITS",
            "fits to averages of simulations",
        ),
        TableEntry(
            COMPARISON,
            "compare",
            ("flow_curve", FITS),
            "softslip.analysis.against_paper:against_paper",
            "Yield stress, exponents and times of dense suspensions of soft particles beside those "
            "of the paper, with the differences in standard errors.",
            f"{_SCHEMAS}:COMPARISON",
            "fits to averages of simulations",
        ),
    )
}
"""Datasets over all runs of a scenario, each after what it is made from."""

TABLES: Mapping[str, TableEntry] = {
    name: entry for name, entry in DATASETS.items() if entry.rule == "gather"
}
"""Those that are gathered from the runs themselves."""

FIGURES: Mapping[str, FigureEntry] = {
    entry.name: entry
    for entry in (
        FigureEntry(
            "fig1",
            "figure",
            ("shear",),
            f"{_FIGURES}.samples:flowing_sample",
            f"{_PAPER}:FLOWING_SAMPLE",
            summary="a flowing sample",
        ),
        FigureEntry(
            "fig3",
            "figure",
            ("shear",),
            f"{_FIGURES}.samples:yielding_sample",
            f"{_PAPER}:YIELDING_SAMPLE",
            summary="a sample as it yields",
        ),
        FigureEntry(
            "fig4",
            "figure",
            ("profiles",),
            f"{_FIGURES}.velocity:profiles",
            summary="velocity profiles",
        ),
        FigureEntry(
            "fig5",
            "figure",
            ("flow_curve", FITS),
            f"{_FIGURES}.rheology:flow_curves",
            summary="flow curves",
        ),
        FigureEntry(
            "fig6",
            "figure",
            ("flow_curve", FITS),
            f"{_FIGURES}.slip_panels:slip",
            summary="slip velocity and heterogeneity",
        ),
        FigureEntry(
            "fig7",
            "figure",
            ("flow_curve", FITS),
            f"{_FIGURES}.slip_length_panels:lengths",
            summary="slip lengths",
        ),
        FigureEntry(
            "fig8",
            "figure",
            ("creep", "flow_curve", FITS),
            f"{_FIGURES}.transient:transients",
            summary="creep and yielding",
        ),
        FigureEntry(
            "fig9",
            "figure",
            ("creep", "flow_curve", FITS),
            f"{_FIGURES}.separations:separations",
            summary="distance between the walls",
        ),
        FigureEntry(
            "structure",
            "figure",
            ("structure",),
            f"{_FIGURES}.structure_panels:structure_page",
            summary="structure between the walls",
        ),
        FigureEntry(SNAPSHOT, SNAPSHOT, ("shear",), f"{_FIGURES}.membranes:snapshot"),
        FigureEntry(
            MOVIE,
            MOVIE,
            ("shear",),
            f"{_FIGURES}.moving_particles:moving_sample",
            f"{_PAPER}:YIELDING_SAMPLE",
            MOVIE_SNAPSHOTS,
            ".mp4",
            summary="the sample as it yields",
        ),
        FigureEntry(
            "benchmark",
            "bench_figure",
            ("bench/scaling", "bench", ANY_MORE),
            f"{_FIGURES}.benchmark:benchmark",
        ),
        FigureEntry(
            "trajectory",
            "bench_figure",
            ("bench/trajectory",),
            f"{_FIGURES}.trajectories_compared:trajectory",
        ),
        FigureEntry(
            "validation",
            "numerics_figure",
            ("validation", ANY_MORE),
            f"{_FIGURES}.validation:validation",
        ),
        FigureEntry("tradeoff", "numerics_figure", ("tradeoff",), f"{_FIGURES}.tradeoff:tradeoff"),
        FigureEntry(
            "extrapolation", "numerics_figure", ("tradeoff",), f"{_FIGURES}.tradeoff:extrapolation"
        ),
        FigureEntry(
            "stability_map",
            "numerics_figure",
            ("stability_map",),
            f"{_FIGURES}.stability:stability_map",
        ),
        FigureEntry(
            "stability_limit",
            "numerics_figure",
            ("limits",),
            f"{_FIGURES}.stability:stability_limit",
        ),
    )
}
"""Figures."""

PAGES: Mapping[str, FigureEntry] = {
    entry.name: entry
    for entry in (
        FigureEntry(
            EXPLORER,
            EXPLORER,
            ("flow_curve", "creep", "profiles", "shear", ANY_MORE),
            "softslip.analysis.explorer.page:explorer_page",
        ),
    )
}
"""Pages for a browser: figures that can be asked, each in one file beside the datasets."""


def figures_of(rule: str) -> tuple[str, ...]:
    """Return the names of the figures that a rule of the workflow draws."""
    return tuple(name for name, entry in FIGURES.items() if entry.rule == rule)


def shows_one_run(figure: str) -> bool:
    """Return whether a figure, or what is called so, shows one run of a scenario."""
    return figure in FIGURES and FIGURES[figure].parents == ("shear",)


def rules_before(rule: str) -> tuple[str, ...]:
    """Return the rules whose results a rule reads that makes results of a scenario."""
    if rule in STAGES:
        return STAGES[: STAGES.index(rule)][-1:]
    makers = {**{stage: stage for stage in STAGES}, **{t.name: t.rule for t in DATASETS.values()}}
    entries: list[TableEntry | FigureEntry] = [
        *DATASETS.values(),
        *FIGURES.values(),
        *PAGES.values(),
    ]
    parents = (parent for entry in entries if entry.rule == rule for parent in entry.parents)
    return tuple(dict.fromkeys(makers[each] for each in parents if each != ANY_MORE))
