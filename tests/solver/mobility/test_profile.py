import numpy as np
import pytest
import scenes
from exact_flows import ShearWave
from hypothesis import given, settings
from hypothesis import strategies as st
from twins import mesh_velocity

from softslip.solver.geometry import Box
from softslip.solver.mobility.grid import GridMobility
from softslip.solver.mobility.outside import StillOutside
from softslip.solver.mobility.profile import MeanFlow

BOX = Box(length=0.25, height=0.375, outer_gap=0.125)
RESOLUTION, VISCOSITY = 64, 1.3

symbols = st.sampled_from(["compact", "wide"])


def channel_nodes(seed, count=30):
    """Nodes within the channel whose x-forces sum to zero."""
    random = scenes.generator(seed)
    positions = random.uniform(0, 1, (count, 2)) * (BOX.length, BOX.height)
    forces = random.standard_normal((count, 2))
    return positions, forces - forces.mean(axis=0)


@settings(max_examples=20)
@given(st.integers(0, 2**31), symbols)
def test_profile_is_the_x_average_of_the_field(seed, symbol):
    positions, forces = channel_nodes(seed)
    solver = GridMobility(BOX, RESOLUTION, VISCOSITY, symbol)
    average = mesh_velocity(solver, positions, forces)[..., 0].mean(axis=0)
    flow = MeanFlow(BOX, RESOLUTION, VISCOSITY, symbol, "periodic")
    profile = flow.velocity(flow.force_density(positions[:, 1], forces[:, 0]))
    error = np.abs(profile - average).max() / np.abs(average).max()
    assert error <= 1e-12, f"off by {error:.1e}"


@settings(max_examples=10)
@given(st.integers(0, 2**31), symbols)
def test_profile_is_the_x_average_with_a_still_outside_too(seed, symbol):
    positions, forces = channel_nodes(seed)
    solver = StillOutside(GridMobility(BOX, RESOLUTION, VISCOSITY, symbol), BOX, VISCOSITY)
    flow = MeanFlow(BOX, RESOLUTION, VISCOSITY, symbol, "still")
    profile = flow.velocity(flow.force_density(positions[:, 1], forces[:, 0]))
    lines = np.flatnonzero(flow.heights <= BOX.height)
    # Averages of δ_h along a mesh row are plain sums over its points, at mesh points themselves.
    x = np.arange(round(BOX.length * RESOLUTION)) / RESOLUTION
    weights = []
    for line in lines:
        points = np.column_stack((x, np.full_like(x, flow.heights[line])))
        weights.append(solver.velocities_at(points, positions, forces)[:, 0].mean())
    smoothed = profile.copy()
    # `velocities_at` interpolates with δ_h: apply the kernel's weights at offset 0 to the profile.
    centre, side, outer = 3 / 8 + np.pi / 32, 1 / 4, 1 / 16 - np.pi / 64
    inner = lines[(lines > 2) & (lines < lines[-1] - 2)]
    smoothed = (
        centre * profile[inner]
        + side * (profile[inner - 1] + profile[inner + 1])
        + outer * (profile[inner - 2] + profile[inner + 2])
    )
    error = np.abs(smoothed - np.array(weights)[inner]).max() / np.abs(profile).max()
    assert error <= 1e-12, f"off by {error:.1e}"


@pytest.mark.parametrize("symbol", ["compact", "wide"])
def test_shear_wave_converges_at_second_order(symbol):
    exact, errors = ShearWave(BOX.length, BOX.period), []
    for resolution in (128, 256):
        flow = MeanFlow(BOX, resolution, exact.viscosity, symbol, "periodic")
        points = np.column_stack((np.zeros_like(flow.heights), flow.heights))
        found = flow.velocity(exact.force(points)[:, 0])
        wanted = exact.velocity(points)[:, 0]
        errors.append(np.abs(found - wanted).max() / np.abs(wanted).max())
    order = np.log2(errors[0] / errors[1])
    assert errors[1] < 5e-3, f"error {errors[1]:.1e}"
    assert 1.9 < order < 2.2, f"order {order:.2f}"


@pytest.mark.parametrize("outside", ["still", "periodic"])
@settings(max_examples=10)
@given(st.integers(0, 2**31), symbols)
def test_viscous_and_carried_stress_add_up_to_a_constant(outside, seed, symbol):
    """Momentum balance of the discrete scheme: exact at every height, whatever the forces."""
    positions, forces = channel_nodes(seed)
    flow = MeanFlow(BOX, RESOLUTION, VISCOSITY, symbol, outside)
    density = flow.force_density(positions[:, 1], forces[:, 0])
    viscous = flow.viscous_stress(flow.velocity(density))
    total = viscous + flow.carried_stress(density)
    # The still solvent's added shear jumps back in the middle of the outer gap.
    away = np.arange(total.size) != round((BOX.height + 0.5 * BOX.outer_gap) * RESOLUTION) - 1
    spread = np.ptp(total[away])
    assert spread <= 1e-12 * np.abs(viscous).max(), f"varies by {spread:.1e}"


def test_nothing_is_carried_in_the_outer_solvent():
    positions, forces = channel_nodes(5)
    positions[:, 1] = 0.1 + 0.5 * positions[:, 1]
    flow = MeanFlow(BOX, RESOLUTION, VISCOSITY)
    carried = flow.carried_stress(flow.force_density(positions[:, 1], forces[:, 0]))
    outside = flow.heights > BOX.height
    error = np.abs(carried[outside]).max() / np.abs(carried).max()
    assert error < 1e-12, f"carries {error:.1e}"


def test_no_net_flow_in_the_periodic_box():
    positions, forces = channel_nodes(6)
    flow = MeanFlow(BOX, RESOLUTION, VISCOSITY, "compact", "periodic")
    velocity = flow.velocity(flow.force_density(positions[:, 1], forces[:, 0]))
    assert abs(velocity.mean()) <= 1e-14 * np.abs(velocity).max()
