import numpy as np
import pytest
import scenes

from softslip.simulation.assembly import mean_flow
from softslip.simulation.observer import Observer
from softslip.solver.mobility.profile import MeanFlow


def test_bulk_rate_is_the_slope_of_a_linear_profile():
    """Pure solvent under stress: the bulk shears at σ/η, whatever the walls do."""
    given = scenes.empty(rheometer={"stress": 0.3}, recording={"bulk_margin": 3.0})
    suspension, state = scenes.of_rings([], given)
    observer = Observer(given, suspension.layout, mean_flow(given))
    values = observer.measure(state, suspension.evaluate(state))
    assert values["shear_rate_bulk"] == pytest.approx(0.3, rel=1e-10)
    assert values["stress_deviation"] <= 1e-13
    # The regularised walls lag, which counts as a negative slip of 0.9 mesh sizes at most.
    assert abs(values["slip_velocity"]) <= 0.3 / given.hydrodynamics.resolution


def ring_profile(spacing):
    """Velocity profile of a stretched, tilted ring at rest, by the corrected quadrature."""
    given = scenes.empty(
        hydrodynamics={"mobility": "ewald", "node_spacing": spacing, "quadrature": "corrected"},
        membrane={"order": 6},
    )
    length, height = given.channel.length, given.channel.height
    around = round(0.6 * np.pi * height * given.hydrodynamics.resolution / spacing)
    half_axes = (0.35 * height, 0.25 * height)
    ring = scenes.ellipse((0.5 * length, 0.5 * height), half_axes, around, 0.4)
    suspension, state = scenes.of_rings([ring], given, stress=0.0)
    observer = Observer(given, suspension.layout, mean_flow(given))
    return observer.measure(state, suspension.evaluate(state))["velocity_profile"]


def test_profile_is_that_of_membranes_not_of_lumps_at_their_nodes(monkeypatch):
    close, membranes = np.diff(ring_profile(1.0)), np.diff(ring_profile(6.0))
    monkeypatch.setattr("softslip.simulation.observer.PROFILE_SPACING", 6.0)
    lumps = np.diff(ring_profile(6.0))
    assert np.abs(membranes - close).max() <= 0.1 * np.abs(lumps - close).max()


def test_no_bulk_observables_where_none_are_asked_for(foam):
    given = scenes.parameters(recording={"bulk_margin": None})
    suspension, state = scenes.of_foam(foam, given)
    observer = Observer(given, suspension.layout, mean_flow(given))
    values = observer.measure(state, suspension.evaluate(state))
    assert not {"shear_rate_bulk", "slip_velocity", "slip_velocity_wall"} & set(values)


def test_without_particles_no_body_carries_stress(monkeypatch):
    """Leaving it out is leaving out an exact zero."""
    given = scenes.empty(rheometer={"stress": 0.3})
    suspension, state = scenes.of_rings([], given)
    evaluation = suspension.evaluate(state)
    flow = mean_flow(given)
    density = flow.force_density(evaluation.positions[:, 1], evaluation.body_forces[:, 0])
    assert not flow.carried_stress(density).any()
    monkeypatch.delattr(MeanFlow, "carried_stress")
    values = Observer(given, suspension.layout, flow).measure(state, evaluation)
    viscous = flow.viscous_stress(
        flow.velocity(flow.force_density(evaluation.positions[:, 1], evaluation.forces[:, 0]))
    )
    clear = (flow.heights > 0.02) & (flow.heights < given.channel.height - 0.02)
    assert np.abs(viscous[clear] - 0.3).max() <= values["stress_deviation"] <= 1e-13
