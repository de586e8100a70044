import math

import pytest

from softslip.analysis.figures.validation import PUBLISHED_DRAG
from softslip.errors import ConfigError
from softslip.studies.validation.cylinders import Cylinders


@pytest.mark.parametrize("concentration", PUBLISHED_DRAG)
@pytest.mark.parametrize("fidelity", ["preview", "paper", "converged"])
def test_drag_is_within_a_hundredth(fidelity, concentration):
    outcome = Cylinders(fidelity=fidelity, concentration=concentration).solve()
    assert outcome.passed, outcome.errors
    # Up to 1.8e-3 by the regularisation of `paper`, and 2.4e-4 rms by how far and near are split.
    assert outcome.error < 2.5e-3
    assert set(outcome.result) | set(outcome.errors) == set(Cylinders.units)
    drawn = math.pi * (outcome.result["radius"] / outcome.result["period"]) ** 2
    assert drawn == pytest.approx(concentration, rel=1e-12)


@pytest.mark.parametrize(("concentration", "passes"), [(0.1, True), (0.3, True), (0.5, False)])
def test_drag_on_the_mesh_is_within_a_hundredth_unless_few_cells_part_the_cylinders(
    concentration, passes
):
    """Small ones: at c = 0.5 the 17 mesh sizes between them feel more than the lag of a sheet."""
    outcome = Cylinders(fidelity="literal", concentration=concentration, radius=0.004).solve()
    assert outcome.passed == passes, outcome.errors
    assert outcome.error < 0.05


def test_what_is_left_in_is_the_hydrodynamic_radius():
    """At a fraction of the regularisation the drag comes as much closer to the rings' own."""
    errors = {
        level: Cylinders(fidelity=level, concentration=0.1).solve().errors["bare_drag"]
        for level in ("paper", "converged")
    }
    assert 0.01 < errors["paper"] < 0.015
    assert errors["converged"] == pytest.approx(errors["paper"] * 0.06 / 0.856, rel=0.05)


@pytest.mark.parametrize("radius", [0.003, 0.03])
def test_drag_is_right_for_any_size(radius):
    outcome = Cylinders(fidelity="standard", concentration=0.2, radius=radius).solve()
    assert outcome.passed, outcome.errors
    assert outcome.result["radius"] == pytest.approx(radius, rel=0.02)


def test_concentrations_beyond_the_range_are_refused():
    with pytest.raises(ConfigError, match="concentration"):
        Cylinders.of({"concentration": 0.7})
