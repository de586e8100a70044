"""An imposed stress, an imposed shear rate, and the control that the paper prints."""

import math

import numpy as np
import pytest
import scenes
from scipy.optimize import brentq

from softslip.simulation.assembly import mean_flow
from softslip.solver import rheometer
from softslip.solver.geometry import LOWER, UPPER

ROUGHNESS = [0.0, 0.59]
OUTSIDE = ["still", "periodic"]


def packed(roughness=0.0, outside="periodic", **drive):
    """A few deformed membranes off the middle, loaded tethers, walls off their start."""
    given = scenes.parameters(wall={"roughness": roughness}, channel={"outside": outside}, **drive)
    rings = [
        scenes.ellipse((0.015, 0.0155), (0.011, 0.006), 52, 0.6),
        scenes.ellipse((0.045, 0.05), (0.012, 0.007), 56, -0.4),
        scenes.ellipse((0.030, 0.09), (0.009, 0.006), 46, 0.2),
    ]
    suspension, state = scenes.of_rings(
        rings, given, stress=given.rheometer.stress, shear_rate=given.rheometer.shear_rate
    )
    state = scenes.stepped(suspension, state, 15, 0.002)
    state.wall_displacement[:] = -0.013, 0.021
    return given, suspension, state


def measured_stress(given, suspension, evaluation, traction):
    """Mean over the gap of viscous and elastic stress, from the flow at any traction."""
    layout, flow = suspension.layout, mean_flow(given)
    forces = evaluation.forces.copy()
    drive = rheometer.unit_drive(layout.wall_nodes, suspension.box.length)
    forces[layout.particle_nodes :, 0] += (traction - evaluation.traction) * drive.ravel()
    heights = evaluation.positions[:, 1]
    velocity = flow.velocity(flow.force_density(heights, forces[:, 0]))
    carried = flow.carried_stress(flow.force_density(heights, evaluation.body_forces[:, 0]))
    bump = layout.wall_reference[LOWER, :, 1].max()
    inside = np.abs(flow.heights - 0.5 * given.channel.height) < 0.4 * given.channel.height - bump
    return (flow.viscous_stress(velocity) + carried)[inside].mean()


@pytest.mark.parametrize("outside", OUTSIDE)
@pytest.mark.parametrize("roughness", ROUGHNESS)
def test_closed_form_traction_is_what_bisection_finds(roughness, outside):
    given, suspension, state = packed(roughness, outside, rheometer={"stress": 0.4})
    evaluation = suspension.evaluate(state)
    found = brentq(
        lambda f: measured_stress(given, suspension, evaluation, f) - 0.4, -50, 50, xtol=1e-14
    )
    assert evaluation.traction == pytest.approx(found, rel=1e-10)
    assert evaluation.stress == pytest.approx(0.4, rel=1e-13)


@pytest.mark.parametrize("outside", OUTSIDE)
@pytest.mark.parametrize("roughness", ROUGHNESS)
def test_imposed_rate_is_the_wall_speed_exactly(roughness, outside):
    drive = {"mode": "rate", "stress": None, "shear_rate": 0.7}
    given, suspension, state = packed(roughness, outside, rheometer=drive)
    for _ in range(3):
        evaluation = suspension.evaluate(state)
        speed = evaluation.wall_velocity[UPPER] - evaluation.wall_velocity[LOWER]
        assert speed == pytest.approx(0.7 * given.channel.height, rel=1e-10)
        state = scenes.stepped(suspension, state, 1, 0.002)


@pytest.mark.parametrize("outside", OUTSIDE)
@pytest.mark.parametrize("roughness", ROUGHNESS)
def test_rate_control_reports_the_stress_that_would_give_this_rate(roughness, outside):
    """Feeding the reported stress back as the imposed one gives the same flow."""
    drive = {"mode": "rate", "stress": None, "shear_rate": 0.7}
    _, suspension, state = packed(roughness, outside, rheometer=drive)
    under_rate = suspension.evaluate(state)
    _, other, _ = packed(roughness, outside, rheometer={"stress": under_rate.stress})
    under_stress = other.evaluate(state)
    assert under_stress.traction == pytest.approx(under_rate.traction, rel=1e-11)
    speeds = under_rate.wall_velocity, under_stress.wall_velocity
    assert speeds[1] == pytest.approx(speeds[0], rel=1e-9)


@pytest.mark.parametrize("outside", OUTSIDE)
@pytest.mark.parametrize("roughness", ROUGHNESS)
def test_tethers_keep_zero_mean_along_x(roughness, outside):
    _, suspension, state = packed(roughness, outside, rheometer={"stress": 0.4})
    state = scenes.stepped(suspension, state, 30, 0.002)
    largest = np.abs(state.tether).max()
    mean = np.abs(state.tether[:, :, 0].mean(axis=1)).max()
    assert largest > 0.1
    assert mean <= 1e-13 * largest * math.sqrt(45), f"mean {mean:.1e} of {largest:.1e}"


def printed_and_exact(steps):
    """Wall speeds of both controls over the first steps, in the paper's box and at its K_w, Δt.

    Without particles nothing depends on x, so that a short period does.
    """
    speeds = {}
    for control in ("printed", "exact"):
        given = scenes.empty(
            channel={
                "length": 1 / 32,
                "height": 0.44,
                "outer_gap": 0.56,
                "outside": "periodic",
            },
            hydrodynamics={"resolution": 1024},
            rheometer={"stress": 0.3, "control": control},
        )
        suspension, state = scenes.of_rings([], given, stress=0.3)
        state, found = suspension.load(state), []
        for _ in range(steps):
            evaluation = suspension.evaluate(state)
            found.append(float(np.diff(evaluation.wall_velocity)[0]))
            vector = state.vector + given.time_stepping.step * evaluation.rate
            state = state.replace(vector, 0.0, state.step + 1)
        speeds[control] = np.array(found)
    return speeds


def test_printed_control_diverges_where_the_exact_one_holds():
    speeds = printed_and_exact(30)
    wanted = 0.3 * 0.44
    assert speeds["exact"] == pytest.approx(wanted, rel=0.01)
    assert np.abs(speeds["printed"][-1]) > 1e6 * wanted, f"{speeds['printed'][-1]:.3g}"


def test_printed_control_starts_from_the_whole_stress_on_the_tethers():
    given = scenes.empty(
        channel={"outside": "periodic"}, rheometer={"stress": 0.3, "control": "printed"}
    )
    suspension, state = scenes.of_rings([], given, stress=0.3)
    loaded = suspension.load(state)
    spacing, length = suspension.layout.wall_spacing, given.channel.length
    total = loaded.tether.sum(axis=1) * spacing / length
    assert total == pytest.approx(np.array([[-0.3, 0.0], [0.3, 0.0]]), rel=1e-13)
    assert not state.tether.any(), "loading changed the state it was given"
