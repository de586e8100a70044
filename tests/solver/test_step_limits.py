import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st

from softslip.errors import NumericalError
from softslip.solver.step_limits import (
    CAUSES,
    REJECTION_STEPS,
    Rejections,
    cause_of,
    check_move,
    longest_step,
)

RANGE = 9 / 8192


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.51 * RANGE / 0.002])
def test_no_node_may_jump_over_a_contact(value):
    rate = np.full((9, 2), 0.49 * RANGE / 0.002)
    check_move(rate, 0.002, RANGE, 5)
    rate[6, 1] = value
    with pytest.raises(NumericalError, match=r"node_velocity\[6\] at step 5: .*time_stepping"):
        check_move(rate, 0.002, RANGE, 5)


def test_the_longest_step_is_half_a_contact_and_half_a_film():
    velocities = np.array([[0.02, -0.3], [0.1, 0.0]])
    alone = 0.5 * RANGE / 0.3
    assert longest_step(velocities, 0.0, RANGE, 0) == pytest.approx(alone, rel=1e-15)
    # A film that loses its thickness at this rate is half as thick after half of 1/rate.
    closing = 3 / alone
    found = longest_step(velocities, closing, RANGE, 0)
    assert found == pytest.approx(0.5 / closing, rel=1e-15)
    slow = longest_step(velocities, 0.9 / alone * 0.5, RANGE, 0)
    assert slow == pytest.approx(alone, rel=1e-15)


def test_a_uniform_shear_does_not_count_where_heights_are_given():
    heights = np.linspace(0.1, 0.3, 30)
    noise = 1e-3 * scenes.generator(5).standard_normal((30, 2))
    # Noise without a shear of its own, so that the fit finds just what is added.
    basis = np.column_stack((np.ones(30), heights))
    noise[:, 0] -= basis @ np.linalg.lstsq(basis, noise[:, 0], rcond=None)[0]
    alone = longest_step(noise, 0.0, RANGE, 0)
    sheared = noise + np.column_stack((0.2 + 3.0 * heights, np.zeros(30)))
    assert longest_step(sheared, 0.0, RANGE, 0, heights) == pytest.approx(alone, rel=1e-9)
    assert longest_step(sheared, 0.0, RANGE, 0) < 0.01 * alone


def test_nothing_that_moves_leaves_any_step():
    assert longest_step(np.zeros((4, 2)), 0.0, RANGE, 0) == np.inf
    assert longest_step(np.empty((0, 2)), 0.0, RANGE, 0) == np.inf


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_velocity_that_is_lost_has_no_longest_step(value):
    velocities = np.zeros((5, 2))
    velocities[3, 0] = velocities[4, 1] = value
    with pytest.raises(NumericalError, match=r"node_velocity\[3\] at step 8: is not finite"):
        longest_step(velocities, 1.0, RANGE, 8)


@given(st.floats(1e-6, 10.0), st.sampled_from([-2, -1, 0, 1, 2]))
def test_a_step_is_refused_just_when_it_is_longer_than_the_longest(speed, places):
    """At the limit too, to the last bit, where a quotient rounds either way."""
    velocities = np.array([[0.0, 0.0], [0.0, speed]])
    longest = longest_step(velocities, 0.0, RANGE, 3)
    step = longest + places * np.spacing(longest)
    if step <= longest:
        check_move(velocities, step, RANGE, 3)
    else:
        with pytest.raises(NumericalError, match=r"node_velocity\[1\] at step 3: .*well below"):
            check_move(velocities, step, RANGE, 3)


def test_refused_trials_end_a_run_when_they_outnumber_the_steps():
    refused = Rejections()
    for step in range(500):
        refused.add(step % 2, step)
    for step in range(500, 500 + REJECTION_STEPS // 4):
        refused.add(2, step)
    with pytest.raises(NumericalError, match=r"step_size\[0\] at step 700: .*node_spacing"):
        refused.add(REJECTION_STEPS, 700)


def test_a_few_refused_trials_at_the_start_end_nothing():
    refused = Rejections()
    refused.add(11, 0)
    for step in range(1, 200):
        refused.add(0, step)


@pytest.mark.parametrize("name", CAUSES[:-1])
def test_the_shortest_limit_sets_the_step(name):
    limits = dict.fromkeys(CAUSES[:-1], 2.0) | {name: 1.0}
    # Up to a record, steps are shortened evenly.
    for taken in (1.0, 0.51):
        assert cause_of(taken, limits) == name
    assert cause_of(0.2, limits) == "stiffness"
