"""The balance of the walls, their tethers, and the equations of the control."""

import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st

from softslip.errors import NumericalError
from softslip.solver import rheometer
from softslip.solver.geometry import Box


@given(
    st.floats(0.05, 2.0),
    st.floats(0.01, 1.0),
    st.floats(0.5, 1.0),
    st.floats(-3, 3),
    st.floats(-3, 3),
    st.booleans(),
)
def test_traction_and_stress_are_inverse_to_each_other(height, gap, arm, stress, rest, still):
    balance = rheometer.Balance(Box(1.0, height, gap), arm * height, still)
    back = balance.stress(balance.traction(stress, rest), rest)
    size = (abs(stress) + abs(rest)) * (1 + height / gap)
    assert abs(back - stress) <= 1e-14 * (size + 1), f"off by {back - stress:.1e}"


def test_tether_rate_opposes_the_deviation_from_the_target():
    velocity = scenes.generator(1).standard_normal((2, 5, 2))
    rate = rheometer.tether_rate(velocity, np.array([0.3, -0.2]), 7.0)
    target = np.zeros((2, 1, 2))
    target[:, 0, 0] = 0.3, -0.2
    assert rate == pytest.approx(-7.0 * (velocity - target), rel=1e-14)


def test_unit_drive_is_one_on_the_upper_wall_and_minus_one_on_the_lower():
    drive = rheometer.unit_drive(7, 0.35)
    assert drive.sum(axis=1) == pytest.approx([-0.35, 0.35], rel=1e-14)
    assert np.ptp(drive, axis=1).tolist() == [0.0, 0.0]


def test_printed_acceleration_balances_the_printed_equation():
    """Eq. 26 over L_x, K_w being per unit length: η (V̂₁' + V̂₂')/(L_y - H) = -K_w (V̄ - V̂)."""
    box, viscosity, stiffness = Box(0.7, 0.44, 0.9), 1.7, 11.0
    speed, ahead = np.array([-0.2, 0.5]), 0.03
    rate = rheometer.printed_acceleration(speed, speed + ahead, box, viscosity, stiffness)
    left = viscosity * rate.sum() / (box.period - box.height)
    assert left == pytest.approx(-stiffness * ahead, rel=1e-13)
    lower = rheometer.printed_acceleration(
        speed, speed + np.array([ahead, 0.0]), box, viscosity, stiffness
    )
    assert lower.tolist() == [pytest.approx(rate[0], rel=1e-13), 0.0], "one wall drives the other"


@pytest.mark.parametrize("traction", [float("nan"), float("inf")])
def test_a_traction_that_is_no_number_is_refused(traction):
    with pytest.raises(NumericalError, match=r"traction\[0\] at step 12: .*smaller"):
        rheometer.check_traction(traction, 12)
