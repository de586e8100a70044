import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from twins import evaluate_kernel

from softslip.solver.kernels import (
    SECOND_MOMENT,
    SUPPORT,
    difference_weights,
    kernel_weights,
)

coordinates = st.floats(-1e4, 1e4)


def weights_at(coordinate):
    weights = np.empty(SUPPORT)
    first = kernel_weights(coordinate, weights)
    return weights, first + np.arange(SUPPORT)


@given(coordinates)
def test_weights_sum_to_one(coordinate):
    total = weights_at(coordinate)[0].sum()
    assert abs(total - 1) <= 1e-15, f"off by {total - 1:.1e}"


@given(coordinates)
def test_first_moment_vanishes_at_every_offset(coordinate):
    weights, lines = weights_at(coordinate)
    moment = weights @ (lines - coordinate)
    assert abs(moment) <= 1e-12, f"off by {moment:.1e} mesh sizes"


@given(st.floats(-50, 50))
def test_weights_are_the_printed_branches(coordinate):
    # Rounding of an offset near a branch point enters through a square root: 1e-16 becomes 1e-8,
    # times a factor that vanishes there.
    weights, lines = weights_at(coordinate)
    printed = evaluate_kernel(lines - coordinate)
    assert weights == pytest.approx(printed, abs=1e-12), np.abs(weights - printed).max()


@given(coordinates)
def test_weights_are_never_negative_beyond_rounding(coordinate):
    assert weights_at(coordinate)[0].min() >= -1e-15


def test_kernel_is_even_and_vanishes_beyond_its_support():
    offsets = np.linspace(0, 4, 4001)
    values = evaluate_kernel(offsets)
    assert np.array_equal(values, evaluate_kernel(-offsets))
    assert not values[offsets > 2.5].any()
    assert abs(values[np.searchsorted(offsets, 2.5)]) < 1e-15


@pytest.mark.parametrize("edge", [0.5, 1.5, 2.5])
def test_kernel_is_continuous_with_its_slope(edge):
    step = 1e-5
    below, at, above = evaluate_kernel(edge + np.array([-step, 0.0, step]))
    # A smooth function changes by 2 h φ'; the slopes on both sides differ by O(√h) here.
    assert abs(above - below) < 2 * step
    assert (above - at) / step == pytest.approx((at - below) / step, abs=5e-3)


@pytest.mark.parametrize("edge", [-0.5, 0.5, 3.5])
def test_weights_do_not_jump_where_the_nearest_line_changes(edge):
    lines = np.arange(-4, 9)

    def on_lines(coordinate):
        return {line: weight for weight, line in zip(*weights_at(coordinate), strict=True)}

    before, after = on_lines(edge - 1e-9), on_lines(edge + 1e-9)
    for line in lines:
        jump = after.get(line, 0.0) - before.get(line, 0.0)
        assert abs(jump) < 1e-8, f"line {line} jumps by {jump:.1e}"


def test_mean_second_moment_is_the_one_that_sets_the_regularisation_length():
    moments = []
    for coordinate in (np.arange(2000) + 0.5) / 2000:
        weights, lines = weights_at(coordinate)
        moments.append(weights @ (lines - coordinate) ** 2)
    assert np.mean(moments) == pytest.approx(SECOND_MOMENT, abs=5e-5)


@given(coordinates)
def test_difference_weights_are_the_central_difference(coordinate):
    weights, _ = weights_at(coordinate)
    differences = np.empty(SUPPORT + 2)
    difference_weights(weights, differences)
    padded = np.pad(weights, 2)
    assert differences == pytest.approx(0.5 * (padded[2:] - padded[:-2]), abs=1e-16)


def test_a_position_that_is_no_number_gives_weights_that_are_none():
    weights = np.empty(SUPPORT)
    kernel_weights(float("nan"), weights)
    assert np.isnan(weights).all()
