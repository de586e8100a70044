import numpy as np
import pytest
import scenes

from softslip.config import contact_points
from softslip.config.parameters import Parameters
from softslip.errors import ConfigError

RANGE, ENERGY = 9 / 8192, 1e-9


def test_stiffer_contacts_leave_fewer_points_in_range():
    found = [
        contact_points.points_in_range(given(energy), 2)
        for energy in (1e-11, 1e-10, 1e-9, 1e-8, 1e-7)
    ]
    assert np.all(np.diff(found) < 0)
    assert contact_points.points_in_range(given(ENERGY), 4) == pytest.approx(
        2 * found[2], rel=1e-12
    )


def given(energy, fidelity="standard", **groups):
    tree = {"fidelity": fidelity, "steric": {"energy": energy}, **groups}
    return Parameters.from_mapping(tree)


@pytest.mark.parametrize("fidelity", [None, "preview", "standard", "paper", "converged"])
@pytest.mark.parametrize("energy", [0.0, 1e-11, 1e-9, 1e-8])
def test_every_level_resolves_the_contacts_of_the_paper_and_stiffer_ones(fidelity, energy):
    given(energy, fidelity)


def stiff(refinement):
    steric = {"energy": 1e-7, "refinement": refinement}
    return Parameters.from_mapping(
        {"fidelity": "standard", "steric": steric, "hydrodynamics": {"node_spacing": 5.0}}
    )


def test_contacts_that_interlock_are_refused_with_what_would_do():
    with pytest.raises(ConfigError, match=r"steric\.refinement: 2 .* use at least 3,") as caught:
        stiff(2)
    assert caught.value.key == "steric.refinement"
    stiff(3)


def test_nothing_is_refused_where_nothing_touches():
    given(1e-7, suspension={"area_fraction": 0.0})


def test_a_scenario_with_contacts_that_interlock_is_refused_before_anything_runs():
    with pytest.raises(ConfigError, match=r"steric\.refinement"):
        scenes.parameters(steric={"energy": 1e-6})
