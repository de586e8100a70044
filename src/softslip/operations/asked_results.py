"""Results that are asked for by name on Snakemake's command line, and why one cannot be made.

Snakemake itself says of them that there is no rule, or shows a traceback of the workflow.
"""

import os
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

from softslip.config.scenario import FOLDER, Scenario
from softslip.config.stages import STAGES
from softslip.files.expected_results import expected_results, run_shown
from softslip.files.layout import DATASET
from softslip.files.products import FIGURES
from softslip.files.stamps import FORMATS
from softslip.messages import counted, file_text

_OF_RUNS = {stage: stage for stage in STAGES} | {"figures/snapshots": "shear"}
"""Folders with a file for each run, and the stage whose runs these are."""


def no_such_run(stage: str, run: str, scenario: Scenario) -> str:
    """Say that a scenario has no such run of a stage."""
    short = scenario.file == FOLDER / f"{scenario.name}.yaml"
    listing = f"softslip runs {scenario.name if short else file_text(scenario.file)}"
    return f"{stage} {run}: is no run of scenario {scenario.name}; list them with: {listing}"


def no_run_to_show(figure: str, scenario: Scenario) -> str:
    """Say that no run of a scenario keeps enough snapshots for a figure of one run."""
    least = FIGURES[figure].snapshots
    return (
        f"{figure}: no run of {scenario.name} keeps {counted(least, 'snapshot')} or more after "
        "time 0; set recording.snapshots, for example to [5, 10, 17.5, 30, 254]"
    )


def why_not(word: str, scenario: Scenario, results: Path) -> str:
    """Say why the workflow does not make a file of a scenario, or a figure called by its name.

    Parameters
    ----------
    word
        Of the command line: a file, a figure's name, or anything else.
    scenario, results
        Which scenario is chosen, and the folder of its results.

    Returns
    -------
        A sentence; nothing if it makes the file, or if the word does not name one of its kind.
    """
    if _shows_nothing(word, scenario):
        return no_run_to_show(word, scenario)
    path = Path(os.path.relpath(word)) if word else Path()
    if path.suffix not in (DATASET, *FORMATS):
        return ""
    if not path.is_relative_to(results):
        return _of_another(path, scenario, results)
    name = path.relative_to(results).as_posix()
    names = [each.name for each in expected_results(scenario)]
    return "" if name in names else _unknown(path, name, names, scenario)


def _of_another(path: Path, scenario: Scenario, results: Path) -> str:
    if not path.is_relative_to(results.parent):
        return ""
    other = path.relative_to(results.parent).parts[0]
    if not (FOLDER / f"{other}.yaml").is_file():
        return ""
    return (
        f"{file_text(path)}: is no result of scenario {scenario.name}; choose the other scenario "
        f"with --config scenario={other}"
    )


def _unknown(path: Path, name: str, names: Sequence[str], scenario: Scenario) -> str:
    folder, run = os.path.split(name.removesuffix(path.suffix))
    stage = _OF_RUNS.get(folder)
    if stage is not None and run not in scenario.stage_table(stage):
        return no_such_run(stage, run, scenario)
    if folder == "figures" and _shows_nothing(run, scenario):
        return no_run_to_show(run, scenario)
    near = get_close_matches(name, names, n=3)
    meant = f"did you mean {' or '.join(near)}?" if near else f"it has {', '.join(_some(names))}"
    return f"{file_text(path)}: is no result of scenario {scenario.name}; {meant}"


def _shows_nothing(figure: str, scenario: Scenario) -> bool:
    """Return whether a figure shows one run of a scenario, and there is none for it."""
    entry = FIGURES.get(figure)
    return entry is not None and bool(entry.sample) and run_shown(entry, scenario) is None


def _some(names: Sequence[str]) -> list[str]:
    """Return the results that are not of single runs."""
    return [name for name in names if not name.startswith(tuple(_OF_RUNS))]
