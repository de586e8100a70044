"""The independent reference: its quadrature, its linear limit, and its steady capsules."""

import numpy as np
import pytest

from softslip.studies.validation.boundary_integral import (
    BoundaryIntegral,
    derivative_matrix,
    logarithm_matrix,
    resampled,
    steady_capsule,
)
from softslip.studies.validation.inertia import deformation, moments
from softslip.studies.validation.ring_theory import Ring


def wavy(nodes):
    """A smooth closed curve that is neither round nor symmetric."""
    angle = 2 * np.pi * np.arange(nodes) / nodes
    radius = 1 + 0.2 * np.cos(2 * angle + 0.4) + 0.1 * np.sin(3 * angle)
    return np.column_stack((1.3 * radius * np.cos(angle), radius * np.sin(angle)))


@pytest.mark.parametrize("mode", [0, 1, 5, 9])
def test_logarithm_is_integrated_exactly_over_every_resolved_wave(mode):
    nodes = 21
    angle = 2 * np.pi * np.arange(nodes) / nodes
    exact = -2 * np.pi / mode * np.cos(mode * angle) if mode else np.zeros(nodes)
    np.testing.assert_allclose(logarithm_matrix(nodes) @ np.cos(mode * angle), exact, atol=1e-13)


def test_derivative_is_exact_and_knows_no_sawtooth():
    angle = 2 * np.pi * np.arange(15) / 15
    np.testing.assert_allclose(
        derivative_matrix(15) @ np.sin(6 * angle), 6 * np.cos(6 * angle), atol=1e-12
    )
    with pytest.raises(ValueError, match="odd"):
        derivative_matrix(14)


@pytest.mark.parametrize("nodes", [40, 41])
def test_moments_of_an_inclined_ellipse(nodes):
    long, short, tilt = 2.0, 0.5, np.radians(25)
    angle = 2 * np.pi * np.arange(nodes) / nodes
    x, y = long * np.cos(angle), short * np.sin(angle)
    turned = np.column_stack(
        (np.cos(tilt) * x - np.sin(tilt) * y + 3, np.sin(tilt) * x + np.cos(tilt) * y - 1)
    )
    area, centre, second = moments(turned)
    assert area == pytest.approx(np.pi * long * short, rel=1e-12)
    np.testing.assert_allclose(centre, [3, -1], rtol=1e-12)
    assert np.trace(second) == pytest.approx(area * (long**2 + short**2) / 4, rel=1e-12)
    assert deformation(second) == pytest.approx(((long - short) / (long + short), 25.0), rel=1e-12)


def test_velocity_converges_spectrally():
    def error(nodes):
        flow = BoundaryIntegral(0.3, nodes)
        return np.abs(resampled(flow.velocities(wavy(nodes)), 241) - finest).max()

    finest = BoundaryIntegral(0.3, 241).velocities(wavy(241))
    coarse, fine = error(41), error(81)
    assert coarse < 1e-3
    # Twice the nodes gain a factor 2**p of a scheme of order p: no fixed order up to 10 does this.
    assert fine < coarse / 2**10, (coarse, fine)


def test_flow_conserves_area_and_momentum():
    flow = BoundaryIntegral(0.3, 161)
    points = wavy(161)
    velocities, tangent = flow.velocities(points), flow.tangent(points)
    flux = velocities[:, 0] @ tangent[:, 1] - velocities[:, 1] @ tangent[:, 0]
    assert abs(flux) / np.abs(velocities).sum() < 1e-12
    np.testing.assert_allclose(flow.forces(points).sum(axis=0), 0.0, atol=1e-10)


@pytest.mark.parametrize("mode", [2, 3, 6])
@pytest.mark.parametrize("branch", [0, 1])
def test_both_modes_of_a_taut_circle_decay_as_linear_theory_says(mode, branch):
    rates, columns = Ring(1.0, 1.2, mode).modes()
    flow = BoundaryIntegral(0.0, 41, rest_stretch=1.2)
    angle = 2 * np.pi * np.arange(41) / 41
    outward = flow.circle()
    around = np.column_stack((-outward[:, 1], outward[:, 0]))
    w, v = columns[:, branch]
    shape = w * np.cos(mode * angle)[:, None] * outward + v * np.sin(mode * angle)[:, None] * around
    # A central difference has no second-order terms: what is left is of the order of its square.
    size = 1e-4
    rate = (flow.velocities(outward + size * shape) - flow.velocities(outward - size * shape)) / (
        2 * size
    )
    np.testing.assert_allclose(rate, -rates[branch] * shape, atol=1e-6)


@pytest.mark.parametrize(
    ("capillary", "taylor", "inclination"), [(0.04, 0.3569, 26.74), (0.125, 0.4947, 20.94)]
)
def test_steady_capsules_of_an_earlier_program(capillary, taylor, inclination):
    steady = steady_capsule(capillary, 65)
    assert steady.taylor_deformation == pytest.approx(taylor, abs=1e-4)
    assert steady.inclination == pytest.approx(inclination, abs=1e-2)
    assert steady.residual < 1e-6


def test_steady_capsule_converges_with_its_nodes():
    coarse, fine = (steady_capsule(0.125, nodes) for nodes in (65, 97))
    # 4e-7, to which 65 nodes are known to be good.
    assert coarse.taylor_deformation == pytest.approx(fine.taylor_deformation, abs=1e-6)
    assert fine.residual < 1e-2 * coarse.residual


def test_steady_capsule_stays_as_it_is():
    steady = steady_capsule(0.125, 65)
    flow = BoundaryIntegral(0.125, 65)
    later = flow.moved(steady.points, 1 / 0.125)
    np.testing.assert_allclose(
        moments(later)[2], moments(steady.points)[2], rtol=1e-5, err_msg="after a unit of shear"
    )


@pytest.mark.slow
@pytest.mark.parametrize("capillary", [0.0125, 0.25, 0.4])
def test_steady_capsule_at_the_extremes(capillary):
    coarse, fine = (steady_capsule(capillary, nodes) for nodes in (97, 129))
    # 4e-6 at G = 0.4, the least resolved.
    assert coarse.taylor_deformation == pytest.approx(fine.taylor_deformation, abs=1e-5)
    assert coarse.inclination == pytest.approx(fine.inclination, abs=1e-3)
