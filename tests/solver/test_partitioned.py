import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softslip.solver.integrators import Accuracy, Memory, imex_rkc2
from softslip.solver.integrators.partitioned import FEWEST_STAGES
from softslip.solver.integrators.partitioned_stages import fixed_imex_step, partitioned_scheme
from softslip.solver.integrators.recurrence import MOST_STAGES
from softslip.solver.integrators.step_control import RADIUS_SAFETY

RATES = np.array([1.0, 30.0, 1e3, 1e5])
"""Of modes that relax towards a slow motion."""

MIX = np.linalg.qr(np.random.default_rng(3).standard_normal((4, 4)))[0]
"""What the modes are made of."""


def relaxing(rates=RATES):
    """y' = J (y - s(t)) + s'(t) with s(t) = (sin t, cos t, ...) in the modes: y = s in the end."""
    phase = np.arange(rates.size)

    def rate(vector, time):
        modes = MIX.T @ vector
        return MIX @ (-rates * (modes - np.sin(time + phase)) + np.cos(time + phase))

    return rate, lambda time: MIX @ np.sin(time + phase)


def knowing(known):
    """P_g of modes of which some part of the rates is known."""

    def response(vector, shift):
        return lambda change: MIX @ ((MIX.T @ change) / (1 + shift * known))

    return response


def march(rate, vector, end, count, stages, response):
    """March with steps of one length and one number of stages."""
    dt, drift = end / count, np.empty(0)
    for n in range(count):
        after = fixed_imex_step(rate, vector, n * dt, dt, stages, response, drift)
        vector, drift = after, (after - vector) / dt
    return vector


@pytest.mark.parametrize("stages", [2, 3, 5, 9])
@pytest.mark.parametrize("part", [0.0, 0.5, 1.0, 1.7])
def test_the_order_is_two_whatever_part_of_the_jacobian_is_known(stages, part):
    rates = np.array([0.5, 1.0, 2.0, 4.0])
    rate, exact = relaxing(rates)

    def error(count):
        known = knowing(part * rates)
        return np.abs(march(rate, exact(0) + 0.1, 2.0, count, stages, known) - end).max()

    end = march(rate, exact(0) + 0.1, 2.0, 20000, 2, knowing(0 * rates))
    order = math.log2(error(200) / error(400))
    # With two stages errors of second and third order may nearly cancel.
    assert 1.9 < order < (2.1 if stages > 2 else 2.7), f"order {order:.3f}"


@pytest.mark.parametrize("part", [0.6, 1.0, 1.7])
def test_the_order_is_two_in_stiff_modes_that_follow_slow_ones(part):
    rate, exact = relaxing()

    def error(count):
        return np.abs(
            march(rate, exact(0), 4.0, count, FEWEST_STAGES, knowing(part * RATES)) - exact(4.0)
        ).max()

    errors = [error(count) for count in (16, 32, 64)]
    assert math.log2(errors[0] / errors[2]) / 2 > 1.8, errors


def test_without_the_drift_stiff_modes_lose_an_order():
    rate, exact = relaxing()

    def error(count):
        vector, dt = exact(0), 4.0 / count
        for n in range(count):
            vector = fixed_imex_step(
                rate, vector, n * dt, dt, FEWEST_STAGES, knowing(0.6 * RATES), np.zeros(4)
            )
        return np.abs(vector - exact(4.0)).max()

    assert math.log2(error(16) / error(64)) / 2 < 1.3


@settings(max_examples=40)
@given(
    stages=st.integers(2, 20),
    part=st.floats(0.51, 30.0),
    stiffness=st.floats(1e-3, 1e6),
)
def test_steps_of_any_length_are_stable_where_half_of_the_rate_is_known(stages, part, stiffness):
    rates = np.array([stiffness])
    drift, values, value = np.zeros(1), [], np.ones(1)
    for n in range(60):
        after = fixed_imex_step(
            lambda y, t: -rates * y,
            value,
            float(n),
            1.0,
            stages,
            lambda vector, shift: lambda change: change / (1 + shift * part * rates),
            drift,
        )
        value, drift = after, after - value
        values.append(abs(after[0]))
    assert max(values[30:]) <= max(values[:30]) * (1 + 1e-9)


# With three stages the smoothing makes steps stable somewhat beyond it.
@given(stages=st.integers(4, 60), excess=st.floats(0.0, 0.9))
def test_the_reach_is_where_steps_become_unstable(stages, excess):
    scheme = partitioned_scheme(stages)
    # With the part l known, g λ/(1 + g l) is what the recurrence sees.
    for factor, stable in ((1 - 1e-6, True), (1.3, False)):
        shift = scheme.shift
        known = excess / shift
        rate = factor * scheme.reach / shift * (1 + shift * known)
        after = fixed_imex_step(
            lambda y, t, rate=rate: -rate * y,
            np.ones(1),
            0.0,
            1.0,
            stages,
            lambda vector, shift, known=known: lambda change: change / (1 + shift * known),
            np.zeros(1),
        )
        assert (abs(after[0]) <= 1.0) == stable


def step_of(rate, vector, step, tolerance, response, **memory):
    return imex_rkc2(
        rate,
        vector,
        0.0,
        rate(vector, 0.0),
        replace(Memory.start(step), **memory),
        Accuracy(tolerance, np.ones_like(vector)),
        math.inf,
        math.inf,
        response,
    )


def test_stages_follow_what_the_response_does_not_know():
    rate, exact = relaxing()
    count = {}
    for part in (1.0, 0.0):
        taken = step_of(rate, exact(0), 0.1, 1e300, knowing(part * RATES))
        count[part] = taken.stages
        stiffness = taken.memory.shift * taken.memory.spectral_radius
        assert stiffness == pytest.approx(
            taken.memory.shift * RATES[-1] / (1 + taken.memory.shift * part * RATES[-1]), rel=0.02
        )
        scheme = partitioned_scheme(taken.stages)
        assert RADIUS_SAFETY * 0.1 * taken.memory.spectral_radius * scheme.shift <= scheme.reach
    assert count[1.0] == FEWEST_STAGES
    assert count[0.0] > 100
    longer = step_of(rate, exact(0), 10.0, 1e300, knowing_nothing)
    assert longer.stages == MOST_STAGES
    assert longer.time < 1.0
    assert np.abs(longer.vector).max() < 10


def test_the_estimate_does_not_count_the_rate_of_stiff_modes_at_rest():
    rate, exact = relaxing()
    before = (exact(0) - exact(-0.05)) / 0.05
    off = 1e-3 * MIX @ np.array([0.0, 0.0, 0.0, 1.0])
    taken = step_of(rate, exact(0) + off, 0.05, 1.0, knowing(RATES), drift=before)
    true = np.abs(taken.vector - exact(0.05)).max()
    # Δt times the rate, 5, is what an unfiltered estimate would have of it.
    assert taken.error < 0.05
    assert true < 2e-3


def test_a_step_that_leaves_the_numbers_is_taken_again_shorter():
    def rate(vector, time):
        return 1 / (1.0 - vector) if vector[0] < 1 else np.full(1, np.nan)

    taken = step_of(rate, np.zeros(1), 30.0, 1e-2, knowing_nothing)
    assert taken.rejections > 0
    assert taken.vector[0] == pytest.approx(1 - math.sqrt(1 - 2 * taken.time), abs=2e-2)


def knowing_nothing(vector, shift):
    return np.copy
