import numpy as np
import pytest

from softslip.errors import ConfigError
from softslip.studies.validation.quadrature_case import Quadrature
from softslip.studies.validation.unbounded import Unbounded


@pytest.mark.parametrize("fidelity", ["literal", "preview", "standard", "paper", "converged"])
def test_every_level_resolves_smooth_forces(fidelity):
    outcome = Quadrature.of({"fidelity": fidelity}).solve()
    assert outcome.passed, outcome.as_mapping()


def test_a_level_is_judged_by_its_own_rule():
    plain, corrected = (
        Quadrature.of({"fidelity": fidelity, "node_spacing": 5.0}).solve()
        for fidelity in ("literal", "standard")
    )
    assert plain.result["nodes"] == corrected.result["nodes"]
    assert plain.error == plain.result["plain"]
    assert not plain.passed
    assert corrected.error == corrected.result["corrected"]
    assert corrected.error < 0.05 * plain.error


def test_forces_of_the_ellipses_balance():
    nodes, forces = Quadrature().membranes([120, 110])
    assert len(np.concatenate(nodes)) == len(forces)
    # Whole waves sum to zero on equally spaced nodes.
    assert np.abs(forces.sum(axis=0)).max() < 1e-13 * np.abs(forces).sum()


def test_unbounded_flow_of_a_pair_of_forces_decays_as_that_of_a_dipole():
    fluid = Unbounded(0.01, 1.7)
    positions, forces = np.array([[-0.5, 0.0], [0.5, 0.0]]), np.array([[-1.0, 0.0], [1.0, 0.0]])
    near, far = fluid.velocities_at(np.array([[50.0, 0.0], [100.0, 0.0]]), positions, forces)
    # The next term of the expansion is (d/r)³, here 1e-6 of the first.
    assert near[0] == pytest.approx(2 * far[0], rel=1e-3)


def test_parameters_out_of_range_are_named():
    with pytest.raises(ConfigError, match="stretch"):
        Quadrature.of({"stretch": 1.0})
