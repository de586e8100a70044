"""Measuring what runs cost: short real runs of every stage, each by its own command.

They go through the command line, one after another, because a run's processor time is that of its
whole process: what it takes to start is most of a small run.
"""

import json
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import netCDF4

from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES
from softslip.errors import SoftslipError
from softslip.files.storage import replacing
from softslip.operations.costs import TABLE
from softslip.provenance.attribution import code, machine, read_provenance

Settings = Mapping[str, Any]
"""Base of a scenario."""


def calibrate(
    path: Path, say: Callable[[str], None], settings: Sequence[Settings] | None = None
) -> None:
    """Measure what runs cost on this machine and write the table that estimates are made from.

    It takes some minutes on one core, which should have nothing else to do.

    Parameters
    ----------
    path
        The table, JSON; see `operations.costs.read_table`.
    say
        Called with what is being measured.
    settings
        Runs to measure, by default those of the table that comes with the package. The first is
        run once more before, so that everything is compiled.

    Raises
    ------
    SoftslipError
        When a run fails, or the table cannot be written.
    """
    if settings is None:
        settings = [run["settings"] for run in json.loads(TABLE.read_text())["runs"]]
    with TemporaryDirectory(prefix="softslip-calibration-") as name:
        folder = Path(name)
        say("compiling")
        _measured(folder / "compiling", settings[0])
        rows = []
        for number, each in enumerate(settings):
            say(f"running {number + 1} of {len(settings)}: {json.dumps(each)}")
            rows.append({"settings": each, "stages": _measured(folder / f"run{number}", each)})
    origin = {"measured_by": "softslip calibrate", "machine": dict(machine())}
    origin |= {key: code()[key] for key in ("commit", "environment")}
    lines = ",\n".join(f"  {json.dumps(row)}" for row in rows)
    head = json.dumps(origin, indent=1).removesuffix("\n}")
    with replacing(path) as temporary:
        temporary.write_text(f'{head},\n "runs": [\n{lines}\n ]\n}}\n')


def _measured(folder: Path, settings: Settings) -> dict[str, dict[str, Any]]:
    """Take a run through all stages, and return what each took."""
    folder.mkdir()
    scenario = folder / "calibration.yaml"
    # JSON is YAML.
    scenario.write_text(json.dumps({"description": "A measured run.", "base": dict(settings)}))
    (run,) = load_scenario(str(scenario)).runs()
    stages = {}
    for place, stage in enumerate(STAGES):
        output = folder / f"{stage}.nc"
        parent = ["--parent", str(folder / f"{STAGES[place - 1]}.nc")] if place else []
        options = [*parent, "--output", str(output)]
        done = subprocess.run(
            [sys.executable, "-m", "softslip", stage, str(scenario), run.ids[stage], *options],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            last = (done.stderr.splitlines() or ["without a message"])[-1]
            raise SoftslipError(f"calibration: {stage} failed: {last}")
        stages[stage] = _cost(output)
    return stages


def _cost(path: Path) -> dict[str, Any]:
    with netCDF4.Dataset(path) as file:
        attributes = {name: file.getncattr(name) for name in file.ncattrs()}
    cost = {
        "core_seconds": read_provenance(attributes)["core_seconds"],
        "size": path.stat().st_size,
    }
    counted = [name for name in ("steps", "evaluations") if name in attributes]
    return cost | {name: int(attributes[name]) for name in counted}
