import pytest

from softslip.errors import ConfigError
from softslip.studies.validation.couette import Couette

FIDELITIES = ["literal", "preview", "standard", "paper", "converged"]


@pytest.mark.parametrize("outside", ["still", "periodic"])
@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_walls_slide_past_each_other_at_the_exact_speed(fidelity, outside):
    outcome = Couette(fidelity=fidelity, outside=outside).solve()
    assert outcome.passed, outcome.errors
    assert outcome.error <= 5e-3
    assert set(outcome.errors) == set(outcome.tolerances)
    assert set(outcome.result) | set(outcome.errors) == set(Couette.units)


@pytest.mark.parametrize("stress", [0.01, 3.0])
def test_speed_follows_the_stress(stress):
    outcome = Couette(fidelity="standard", stress=stress).solve()
    assert outcome.passed, outcome.errors
    assert outcome.reference["relative_speed"] == pytest.approx(0.44 * stress)


@pytest.mark.parametrize(("height", "gap"), [(0.05, 0.02), (0.1234, 0.0456)])
def test_any_size_is_solved_with_the_nearest_box(height, gap):
    outcome = Couette(fidelity="standard", channel_height=height, outer_gap=gap).solve()
    assert outcome.passed, outcome.errors
    assert outcome.result["outer_gap"] == pytest.approx(gap, abs=0.5 / 8192)


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_the_thinnest_channel_is_solved_but_for_the_lag_of_its_walls(fidelity):
    outcome = Couette(
        fidelity=fidelity, channel_height=65 / 8192, outer_gap=65 / 8192, outside="periodic"
    ).solve()
    for name, error in outcome.errors.items():
        assert error <= outcome.tolerances[name] or name == "relative_speed", name


def test_the_lag_of_regularised_walls_is_what_is_left_of_the_error():
    """Where the outer gap is thin and sheared, a wall lags by much more than the sum errs."""
    outcome = Couette(fidelity="paper", outside="periodic", outer_gap=1 / 64).solve()
    assert not outcome.passed
    assert outcome.errors["relative_speed"] > 5e-3
    assert outcome.result["lag"] == pytest.approx(outcome.reference["lag"], rel=0.01)
    assert outcome.errors["regularised_speed"] <= outcome.tolerances["regularised_speed"]


def test_a_tolerance_replaces_that_of_the_speed():
    outcome = Couette(fidelity="standard", tolerance=1e-6).solve()
    assert not outcome.passed
    assert outcome.tolerances["relative_speed"] == 1e-6


def test_walls_too_close_are_refused():
    with pytest.raises(ConfigError, match="channel_height"):
        Couette.of({"channel_height": 1e-4})
