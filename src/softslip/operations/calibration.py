"""Measuring what runs cost: short real runs of every stage, each by its own command.

They go through the command line, one after another, because a run's processor time is that of its
whole process: what it takes to start is most of a small run.
"""

import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import netCDF4

from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES
from softslip.errors import SoftslipError
from softslip.files.storage import replacing
from softslip.provenance.attribution import code, machine, read_provenance

SMALL = {"length": 0.0625, "height": 0.09375, "outer_gap": 0.0078125}
MEDIUM = {"length": 0.125, "height": 0.21875, "outer_gap": 0.03125}
WIDE = {"length": 0.125, "height": 0.21875, "outer_gap": 0.5625}
"""Channels of about 20 and 100 of the paper's particles, and with its outer gap [length unit]."""


def _flow(ageing: float, shear: float, stress: float, **groups: Any) -> dict[str, Any]:
    times = {"ageing_time": ageing, "shear_time": shear}
    stepping = {**groups.pop("time_stepping", {}), **times}
    return {
        "channel": SMALL,
        "recording": {"snapshots": [shear / 2], "bulk_margin": None},
        "rheometer": {"stress": stress},
        "time_stepping": stepping,
        **groups,
    }


SETTINGS: tuple[Mapping[str, Any], ...] = (
    # Each level, where steps are limited by records and where by motion.
    _flow(20, 60, 0.05, fidelity="preview"),
    _flow(20, 60, 0.5, fidelity="preview"),
    _flow(20, 60, 0.2, fidelity="standard"),
    _flow(20, 60, 0.5, fidelity="standard"),
    _flow(20, 40, 0.05, fidelity="paper"),
    _flow(20, 40, 0.5, fidelity="paper"),
    _flow(5, 20, 0.3, fidelity="converged"),
    # What the steps and the spectral radius depend on, apart from each other.
    _flow(5, 30, 0.5, fidelity="preview", time_stepping={"tolerance": 2e-3}),
    _flow(5, 30, 0.3, fidelity="preview", hydrodynamics={"regularisation": 0.5}),
    _flow(5, 20, 0.3, fidelity="preview", hydrodynamics={"node_spacing": 3.0}),
    # The size of the sample, and longer preparations.
    _flow(5, 30, 0.3, fidelity="preview", channel=MEDIUM),
    _flow(
        0.05,
        0.05,
        0.3,
        fidelity="preview",
        channel=MEDIUM,
        packing={"equilibration_steps": 50_000},
        expansion={"growth_nodes": 160, "ramp_steps": 4000},
    ),
    # The paper's scheme, up to a fifth of its points.
    _flow(0.1, 0.2, 0.3),
    _flow(0.2, 0.4, 0.3, hydrodynamics={"resolution": 4096}),
    _flow(0.02, 0.06, 0.3, channel=WIDE),
)
"""What is measured, as the bases of scenarios."""

_WARM_UP = _flow(0.05, 0.05, 0.3, fidelity="preview")


def calibrate(path: Path, tell: Callable[[str], None]) -> None:
    """Measure what runs cost on this machine and write the table that estimates are made from.

    It takes some minutes on one core, which should have nothing else to do.

    Parameters
    ----------
    path
        The table, JSON; see `operations.costs.read_table`.
    tell
        Told what is being measured.

    Raises
    ------
    SoftslipError
        When a run fails, or the table cannot be written.
    """
    with TemporaryDirectory(prefix="softslip-calibration-") as name:
        folder = Path(name)
        tell("compiling")
        _measured(folder / "warm", _WARM_UP)
        rows = []
        for number, settings in enumerate(SETTINGS):
            tell(f"running {number + 1} of {len(SETTINGS)}: {json.dumps(settings)}")
            stages = _measured(folder / f"run{number}", settings)
            rows.append({"settings": settings, "stages": stages})
    words = {"measured_by": "softslip calibrate", "machine": dict(machine())}
    words |= {key: code()[key] for key in ("commit", "environment")}
    lines = ",\n".join(f"  {json.dumps(row)}" for row in rows)
    head = json.dumps(words, indent=1).removesuffix("\n}")
    with replacing(path) as temporary:
        temporary.write_text(f'{head},\n "runs": [\n{lines}\n ]\n}}\n')


def _measured(folder: Path, settings: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Take a run through all stages, and return what each took."""
    folder.mkdir()
    scenario = folder / "calibration.yaml"
    # JSON is YAML.
    scenario.write_text(json.dumps({"description": "A measured run.", "base": dict(settings)}))
    (run,) = load_scenario(str(scenario)).runs()
    found = {}
    for place, stage in enumerate(STAGES):
        output = folder / f"{stage}.nc"
        parent = ["--parent", str(folder / f"{STAGES[place - 1]}.nc")] if place else []
        words = [stage, str(scenario), run.ids[stage], *parent, "--output", str(output)]
        done = subprocess.run(
            [sys.executable, "-m", "softslip", *words], capture_output=True, text=True, check=False
        )
        if done.returncode:
            last = (done.stderr.splitlines() or ["it said nothing"])[-1]
            raise SoftslipError(f"calibration: {stage} failed: {last}")
        found[stage] = _taken(output)
    return found


def _taken(path: Path) -> dict[str, Any]:
    with netCDF4.Dataset(path) as file:
        attributes = {name: file.getncattr(name) for name in file.ncattrs()}
    found = {
        "core_seconds": read_provenance(attributes)["core_seconds"],
        "size": path.stat().st_size,
    }
    counted = [name for name in ("steps", "evaluations") if name in attributes]
    return found | {name: int(attributes[name]) for name in counted}
