"""Samples of one condition are averaged and judged together."""

import numpy as np
import pytest
import xarray as xr

from softslip.analysis.observables import mean_over_seeds
from softslip.analysis.observables.verdicts import DRIFTING, STEADY, TOO_SHORT, WITHIN_ERROR


def made(values, errors, verdicts=None, drifts=None, freedom=10.0):
    """Slip velocities of several samples."""
    count = len(values)
    variables = {
        "slip_velocity": values,
        "slip_velocity_error": errors,
        "slip_velocity_freedom": [freedom] * count,
        "slip_velocity_drift": [0.0] * count if drifts is None else drifts,
        "slip_velocity_drift_error": [0.1] * count,
        "steady_slip": [True] * count,
        "verdict_slip": verdicts or [STEADY] * count,
        "status": ["done"] * count,
    }
    return xr.Dataset({name: ("seed", each) for name, each in variables.items()})


def test_the_error_of_three_samples_is_their_scatter():
    found = mean_over_seeds(made([1.0, 2.0, 3.0], [0.1, 0.1, 5.0]))
    assert float(found["slip_velocity"]) == pytest.approx(2.0)
    assert float(found["slip_velocity_error"]) == pytest.approx(1 / np.sqrt(3))
    assert float(found["slip_velocity_freedom"]) == 2


def test_a_mean_depends_on_smoothing_by_no_more_than_its_samples_do_on_average():
    runs = made([1.0, 2.0, 3.0], [0.1, 0.1, 0.1])
    changes = {"two": [0.3, np.nan, 0.5], "lost": [0.3, 0.1, np.inf], "none": [np.nan] * 3}
    told = {f"{name}_smoothing": ("seed", each) for name, each in changes.items()}
    found = mean_over_seeds(runs.assign(told))
    assert float(found["two_smoothing"]) == pytest.approx(0.4)
    assert float(found["lost_smoothing"]) == np.inf
    assert np.isnan(float(found["none_smoothing"]))


def test_the_error_of_two_samples_is_their_own_unless_they_disagree():
    agreeing = mean_over_seeds(made([2.0, 2.0], [0.3, 0.4]))
    assert float(agreeing["slip_velocity_error"]) == pytest.approx(0.25)
    # Welch and Satterthwaite: (0.09 + 0.16)² / ((0.09² + 0.16²)/10).
    assert float(agreeing["slip_velocity_freedom"]) == pytest.approx(0.0625 / 0.00337)
    apart = mean_over_seeds(made([1.0, 3.0], [0.1, 0.1]))
    assert float(apart["slip_velocity_error"]) == pytest.approx(1.0)
    assert float(apart["slip_velocity_freedom"]) == 1


def test_one_sample_that_seems_to_drift_does_not_spoil_the_others():
    steady = [WITHIN_ERROR, STEADY, DRIFTING]
    found = mean_over_seeds(made([1.0, 1.01, 0.99], [0.01] * 3, steady, [0.1, -0.2, 0.3]))
    assert str(found["verdict_slip"].item()) == STEADY
    assert bool(found["steady_slip"])


def test_samples_drift_together_though_none_does_by_itself():
    found = mean_over_seeds(made([1.0, 1.0, 1.0], [0.1] * 3, drifts=[-0.21, -0.2, -0.19]))
    assert str(found["verdict_slip"].item()) == DRIFTING
    assert not bool(found["steady_slip"])


def test_most_samples_decide_unless_one_is_too_short():
    found = mean_over_seeds(made([1.0] * 3, [0.1] * 3, [DRIFTING, DRIFTING, STEADY]))
    assert str(found["verdict_slip"].item()) == DRIFTING
    short = mean_over_seeds(made([1.0] * 2, [0.1] * 2, [STEADY, TOO_SHORT]))
    assert str(short["verdict_slip"].item()) == TOO_SHORT
    assert not bool(short["steady_slip"])


def test_a_large_error_of_the_mean_is_said():
    found = mean_over_seeds(made([1.0, 2.0, 3.0], [0.1] * 3))
    assert str(found["verdict_slip"].item()) == WITHIN_ERROR
