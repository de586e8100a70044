"""A run from its packing to its shear: what is missing is computed, the rest is reused."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import xarray as xr

from softslip.config.scenario import Scenario, StageRun
from softslip.config.stages import FLOWING, STAGES
from softslip.files.layout import CHECKPOINTS, DATASET
from softslip.files.storage import read_dataset
from softslip.messages import counted, duration, file_text
from softslip.operations.failures import failure_path, read_failure
from softslip.operations.planning import make_plan
from softslip.operations.progress import progress_report, silent_report, tell
from softslip.operations.schedule import Plan, PlannedRun
from softslip.workbench.arguments import single_run
from softslip.workbench.stage_process import run_command

FOLDER = Path("results") / "python"
"""Folder of the results of calls that name none."""


def shear(
    scenario: str | Path | None = None,
    /,
    *,
    folder: str | Path = FOLDER,
    threads: int = 1,
    progress: bool = True,
    **parameters: Any,
) -> xr.Dataset:
    """Shear a suspension, from a packing of discs on, and return the run's dataset.

    Packing, expansion, ageing and shear are done by the commands of the same names, each in a
    process of its own, so that the datasets are those that Snakemake makes of such a run. They are
    kept in ``folder``, laid out as a scenario's results. What is there by the same parameters and
    the same code is reused: of two calls that differ in the stress, the second only shears. After
    Ctrl-C the same call resumes.

    Parameters
    ----------
    scenario
        Name or path of a scenario to start from, with the first value of each of its axes. Without
        one, the run starts from the defaults: the paper's sizes and its own scheme, which takes
        more than a day.
    folder
        Where results are kept; those of a scenario too, such as ``results/demo``.
    threads
        Threads at most; a run uses up to 2, for the same numbers.
    progress
        Whether to show, on standard error or in the notebook, what is computed and how far it is.
    **parameters
        Any parameters of config/README.md by the last part of their name (``stress=0.3``), by
        group (``channel={"length": 0.125}``), or by path (``**{"channel.length": 0.125}``); they
        are checked as those of a scenario.

    Returns
    -------
    xarray.Dataset
        Records in time, profiles and snapshots; ``run.softslip`` draws them.

    Raises
    ------
    ConfigError
        When a parameter does not exist or cannot be run, in one sentence with the remedy.
    SoftslipError
        What a stage fails with: `PackingError`, `ExpansionError`, `NumericalError`, or
        `LockedError` where another process works on the run.

    Examples
    --------
    >>> import softslip as ss
    >>> run = ss.shear("demo", stress=0.3, roughness=0.59)  # doctest: +SKIP
    >>> run.softslip.creep()  # doctest: +SKIP
    """
    meant = single_run(None if scenario is None else str(scenario), parameters)
    place = Path(folder)
    plan = make_plan(meant, place)
    if progress and plan.core_seconds:
        tell(_announced(plan, place))
    heard = set[str]()
    for run in plan.runs:
        if run.is_open:
            row = meant.stage_table(run.stage)[run.run]
            for line in _computed(row, meant, place, threads, progress):
                if line not in heard:
                    tell(line)
                heard.add(line)
    row = _last(meant)
    return read_dataset(_output(place, row.stage, row.id), stage=row.stage, run=row.id)


def _last(meant: Scenario) -> StageRun:
    (row,) = meant.stage_table(STAGES[-1]).values()
    return row


def _output(folder: Path, stage: str, run: str) -> Path:
    return folder / stage / f"{run}{DATASET}"


def _announced(plan: Plan, folder: Path) -> str:
    """Say what will be computed and how long it will take."""
    todo = [run for run in plan.runs if run.is_open]
    stages = ", ".join(_in_words(run) for run in todo)
    return (
        f"{counted(len(todo), 'stage')} to do ({stages}), about {duration(plan.core_seconds)} of "
        f"processor time within a factor of {plan.factor:.1f}; results in {file_text(folder)}"
    )


def _in_words(run: PlannedRun) -> str:
    return f"{run.stage}, {run.reason}" if run.reason != "missing" else run.stage


def _computed(
    row: StageRun, meant: Scenario, folder: Path, threads: int, progress: bool
) -> Iterator[str]:
    """Run a stage's command; yield what it says besides where its result is."""
    output = _output(folder, row.stage, row.id)
    words = [row.stage, meant.name, row.id, "--output", str(output)]
    words += ["--parameters", row.parameters.model_dump_json()]
    if row.parent is not None:
        before = STAGES[STAGES.index(row.stage) - 1]
        words += ["--parent", str(_output(folder, before, row.parent))]
    if row.stage in FLOWING:
        words += ["--threads", str(threads)]
    record = failure_path(output.parent / CHECKPOINTS, row.id)
    with (progress_report if progress else silent_report)(row.stage) as report:
        said = run_command(words, report, lambda: read_failure(record))
    yield from (line for line in said if line and not line.endswith(f": wrote {output}"))
