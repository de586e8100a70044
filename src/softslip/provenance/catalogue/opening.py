"""Results opened from a folder alone, or by a scenario with the runs that it still lacks."""

import json
from collections.abc import Mapping
from pathlib import Path

from softslip.config.scenario import Scenario
from softslip.config.stages import STAGES, stage_parameters
from softslip.errors import DatasetError
from softslip.messages import file_text
from softslip.provenance.catalogue.runs import (
    DONE,
    LAST,
    StoredRun,
    read_folder,
    swept_parameters,
    with_file,
)
from softslip.provenance.catalogue.selection import Results
from softslip.provenance.trees import flat_tree


def open_results(folder: str | Path) -> Results:
    """Return the runs in a folder, whatever scenario they are of.

    Swept are the parameters that the folder's tables name as axes, and others in which its sheared
    runs differ.

    Parameters
    ----------
    folder
        Such as ``results/demo``, or any other with results below it. Hidden ones are passed over.

    Raises
    ------
    DatasetError
        When there is no such folder, or no run in it.
    """
    place = Path(folder)
    if not place.is_dir():
        raise DatasetError(f"{file_text(place)}: is no folder; give one such as results/demo")
    every, tables, unreadable = read_folder(place)
    if not every:
        raise DatasetError(
            f"{file_text(place)}: holds no run; give a folder such as results/demo"
            + (f" ({unreadable[0]})" if unreadable else "")
        )
    return Results(place, every, swept_parameters(every, tables), unreadable)


def scenario_results(
    scenario: Scenario, folder: Path, states: Mapping[tuple[str, str], str]
) -> Results:
    """Return the runs of a scenario, those that are not done too.

    Parameters
    ----------
    scenario
        What the runs are of.
    folder
        Where its results are.
    states
        The state of each stage and run, as `operations.scenario_status.scenario_status` has it.
    """
    swept = {axis.label: axis.path for axis in scenario.axes}
    own = {run.ids[LAST]: run.coordinates for run in scenario.runs()}
    every: list[StoredRun] = []
    unreadable: list[str] = []
    for stage in STAGES:
        for identity, row in scenario.stage_table(stage).items():
            path = folder / stage / f"{identity}.nc"
            labels = own[identity] if stage == LAST else {}
            flat = flat_tree(json.loads(stage_parameters(row.parameters, stage)))
            run = StoredRun(stage, identity, path, states[stage, identity], flat, labels)
            try:
                every.append(with_file(run) if run.state == DONE else run)
            except DatasetError as error:
                unreadable.append(f"{error}; it is left out")
    return Results(folder, every, swept, unreadable)
