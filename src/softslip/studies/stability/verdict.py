"""Whether a cell is right: what was seen on the way, and a finer run that shares no step.

None of it asks the guards that run with the scheme, so that what they miss shows as `wrong`.
"""

import math
import time
from dataclasses import dataclass
from typing import Literal

import numpy as np

from softslip.config.parameters import Parameters
from softslip.errors import NumericalError, SoftslipError
from softslip.simulation.assembly import regularisation_of
from softslip.studies import scenes
from softslip.studies.boxes import merged
from softslip.studies.membrane_nodes import on_chains
from softslip.studies.stability.cells import Cell
from softslip.studies.stability.map_scenes import periodic_difference, scene_of
from softslip.studies.stability.watched_run import Evidence, WatchedRun, watched

Verdict = Literal["correct", "stopped", "wrong"]

POSITION_ERROR = 0.15
"""Largest rms difference of the nodes from the finer run, over the contact range: half of what a
film gives way to before its pressure doubles."""

RATE_ERROR = 0.03
"""Largest relative difference of the mean γ̇_wall from the finer run."""

RATE_FLOOR = 0.02
"""Difference of the walls' displacement that does not count, over the contact range."""

REST_DRIFT = 0.01
"""Largest displacement of anything at rest, over the contact range."""

LOST_DIGITS = 1e-9
"""Largest relative change of rates when whole periods are taken from the walls' displacements: a
hundred periods cost two digits of sixteen, and stiff forces some more."""

TIGHTER = 10.0
"""Ratio of the tolerances of a cell and of its finer run."""

SHARPER = 4.0
"""Ratio of the regularisation lengths of a cell and of its sharper run."""

TIGHTEST, LOOSEST = 1e-5, 1e-3
"""Bounds of the tolerance of a finer run."""

FIRST, LONGEST = 1e-3, 0.1
"""First and longest step of a finer run [time unit]."""


@dataclass(frozen=True)
class Judgement:
    """What became of a cell, why, and the numbers behind it."""

    verdict: Verdict
    message: str
    evidence: Evidence


def judge(cell: Cell) -> Judgement:
    """Run a cell and say what became of it."""
    evidence = Evidence()
    clock = time.process_time()
    try:
        scene = scene_of(cell.start, cell.tree)
        run = watched(scene, cell.duration, evidence)
    except SoftslipError as error:
        evidence.seconds = time.process_time() - clock
        return Judgement("stopped", f"{type(error).__name__}: {error}", evidence)
    evidence.seconds = time.process_time() - clock
    faults = run.faults()
    if cell.criterion == "rest":
        faults += _drift(scene, run, evidence)
    else:
        faults += _against_finer(cell, scene, run, evidence)
    if cell.criterion == "sharper":
        _sharpen(cell, scene, run, evidence)
    if cell.group == "far_shear":
        faults += _lost_digits(scene, run)
    return Judgement("wrong" if faults else "correct", "; ".join(faults), evidence)


def _tight(cell: Cell) -> dict[str, object]:
    """Return a cell's parameters with steps of high accuracy."""
    stepping = Parameters.from_mapping(cell.tree).time_stepping
    tight = {
        "integrator": "rkc2",
        "tolerance": min(max(stepping.tolerance / TIGHTER, TIGHTEST), LOOSEST),
        "step": min(stepping.step, FIRST),
        "longest_step": LONGEST,
    }
    return merged(cell.tree, {"time_stepping": tight})


def _against_finer(
    cell: Cell, scene: scenes.Scene, run: WatchedRun, evidence: Evidence
) -> list[str]:
    """Say how a run differs from one on twice the nodes, or from one on its own if that stops."""
    tight, problems = _tight(cell), []
    spacing = scene.parameters.hydrodynamics.node_spacing
    closer = merged(tight, {"hydrodynamics": {"node_spacing": spacing / 2}})
    for tree in [tight] if cell.criterion == "rates" else [closer, tight]:
        try:
            finer = scene_of(cell.start, tree)
            other = watched(finer, cell.duration, Evidence())
        except NumericalError as error:
            problems.append(str(error))
            continue
        rate, position = _differences(cell, scene, run, (finer, other))
        evidence.rate_error, evidence.position_error = rate, position
        return _too_far(rate, position)
    return [f"no finer run to compare with: {problems[0]}"]


def _too_far(rate: float, position: float) -> list[str]:
    """Say what differs by too much; a position error of NaN says that there are no positions."""
    faults = []
    if not rate <= RATE_ERROR:
        faults.append(f"the shear rate is off by {rate:.2g}, more than {RATE_ERROR:g}")
    if position > POSITION_ERROR:
        faults.append(f"nodes are off by {position:.2g} contact ranges, more than {POSITION_ERROR}")
    return faults


def _sharpen(cell: Cell, scene: scenes.Scene, run: WatchedRun, evidence: Evidence) -> None:
    """Note how much of the shear rate hangs on the regularisation length."""
    given = scene.parameters
    epsilon = regularisation_of(given) * given.hydrodynamics.resolution / SHARPER
    tree = merged(_tight(cell), {"hydrodynamics": {"regularisation": epsilon}})
    sharper = scene_of(cell.start, tree)
    other = watched(sharper, cell.duration, Evidence())
    evidence.regularisation_error, _ = _differences(cell, scene, run, (sharper, other))


def _differences(
    cell: Cell, scene: scenes.Scene, run: WatchedRun, finer: tuple[scenes.Scene, WatchedRun]
) -> tuple[float, float]:
    """Return how far shear rates and nodes differ; NaN for nodes that are not to be compared."""
    given = scene.parameters
    contact, span = given.steric.length, given.channel.height * cell.duration
    floor = RATE_FLOOR * contact / (span * RATE_ERROR)
    finer_rate = finer[1].shear_rate
    rate = abs(run.shear_rate - finer_rate) / (abs(finer_rate) + floor)
    if cell.criterion == "rates" or not scene.layout.particles:
        return rate, math.nan
    before, after = (np.diff(each.layout.offsets) for each in (finer[0], scene))
    theirs = on_chains(finer[1].stretch.state.node_position, before, after)
    ours = run.stretch.state.node_position
    apart = periodic_difference(ours, theirs, given.channel.length)
    return rate, float(np.sqrt(np.mean(np.sum(apart**2, axis=1)))) / contact


def _drift(scene: scenes.Scene, run: WatchedRun, evidence: Evidence) -> list[str]:
    before, after = scene.state, run.stretch.state
    given = scene.parameters
    apart = periodic_difference(after.node_position, before.node_position, given.channel.length)
    walls = after.wall_displacement - before.wall_displacement
    largest = max(np.abs(apart).max(initial=0.0), np.abs(walls).max())
    evidence.position_error = float(largest) / given.steric.length
    if evidence.position_error <= REST_DRIFT:
        return []
    return [f"something at rest moved by {evidence.position_error:.2g} contact ranges"]


def _lost_digits(scene: scenes.Scene, run: WatchedRun) -> list[str]:
    """Say what walls far from where they began have cost.

    The equations must not see whole periods: with these taken away from the walls' displacements,
    rates are the same but for rounding.
    """
    state, length = run.stretch.state, scene.parameters.channel.length
    first = state.node_position[scene.layout.offsets[:-1], 0]
    faults = []
    if not ((first >= 0) & (first < length)).all():
        faults.append("a particle lies outside the period")
    near = state.replace(state.vector.copy(), state.time, state.step)
    near.wall_displacement[:] = np.mod(near.wall_displacement, length)
    far_rate, near_rate = scene.suspension.rate(state), scene.suspension.rate(near)
    positions = slice(0, 2 * state.particle_nodes)
    apart = np.abs(far_rate - near_rate)[positions].max() / np.abs(near_rate)[positions].max()
    if not apart <= LOST_DIGITS:
        faults.append(f"rates depend on the walls' whole periods by {apart:.2g}")
    return faults
