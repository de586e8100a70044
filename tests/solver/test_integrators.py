import ast
import inspect
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import chebyshev
from numpy.random import SeedSequence, default_rng
from scipy.integrate import solve_ivp

from softslip.errors import NumericalError
from softslip.solver import integrators
from softslip.solver.integrators import (
    INTEGRATORS,
    Accuracy,
    Memory,
    euler,
    explicit,
    rkc2,
    spectral,
    stepping,
)
from softslip.solver.integrators import chebyshev as scheme

ORDERS = {"euler": 1, "rkc2": 2, "imex_rkc2": 2}
ANY = 1e300
"""A tolerance that everything meets, so that ``largest`` alone gives the step."""


def linear(vector, time):
    """Damped rotation: y' = A y."""
    return np.array([-0.3 * vector[0] - vector[1], vector[0] - 0.3 * vector[1]])


def nonlinear(vector, time):
    """y' = -t y²: y = y0/(1 + y0 t²/2), and z' = sin t."""
    return np.array([-time * vector[0] ** 2, np.sin(time)])


CASES = {
    "linear": (
        linear,
        np.array([1.0, 0.0]),
        lambda t: np.exp(-0.3 * t) * np.array([np.cos(t), np.sin(t)]),
    ),
    "nonlinear": (
        nonlinear,
        np.array([2.0, -1.0]),
        lambda t: np.array([2 / (1 + t * t), -np.cos(t)]),
    ),
}


class Watched:
    """A rate that remembers its calls."""

    def __init__(self, rate):
        self.rate, self.calls = rate, []

    def __call__(self, vector, time):
        self.calls.append((vector, vector.copy(), time))
        return self.rate(vector, time)


def march(integrate, rate, vector, end, step, tolerance=ANY, scale=1.0, largest=np.inf):
    """Integrate from time 0 to ``end``; return all steps."""
    accuracy = Accuracy(tolerance, np.broadcast_to(scale, vector.shape).copy())
    time, first, memory, steps = 0.0, rate(vector, 0.0), Memory.start(step), []
    while time < end:
        step = integrate(rate, vector, time, first, memory, accuracy, end, largest)
        vector, time, first, memory = step.vector, step.time, step.rate, step.memory
        steps.append(step)
    assert time == end
    return steps


def knowing(step, radius, size=1):
    """Memory with a fresh estimate, so that the number of stages is the test's choice."""
    return Memory(step_size=step, spectral_radius=radius, radius_age=0, direction=np.ones(size))


def radius_for(stages, step=1.0):
    """Radius for which ``stages`` are just enough."""
    return scheme.reach(stages) / scheme.RADIUS_SAFETY / step * (1 - 1e-12)


# --- accuracy -----------------------------------------------------------------------------------


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("name", INTEGRATORS)
def test_integrators_have_their_order(name, case):
    rate, vector, exact = CASES[case]
    errors = []
    for count in (200, 400):
        last = march(INTEGRATORS[name], rate, vector, 1.5, 1.5 / count, largest=1.5 / count)[-1]
        errors.append(np.abs(last.vector - exact(1.5)).max())
    order = np.log2(errors[0] / errors[1])
    assert order == pytest.approx(ORDERS[name], abs=0.05), f"order {order:.3f}"


@pytest.mark.parametrize("stages", [3, 5, 10, 40])
def test_every_number_of_stages_is_of_second_order_in_a_time_dependent_problem(stages):
    errors = []
    for count in (50, 100):
        vector, time, dt = np.array([2.0, -1.0]), 0.0, 1.5 / count
        for _ in range(count):
            memory = knowing(dt, radius_for(stages, dt), size=2)
            step = rkc2(
                nonlinear,
                vector,
                time,
                nonlinear(vector, time),
                memory,
                Accuracy(ANY, np.ones(2)),
                math.inf,
                math.inf,
            )
            assert step.stages == stages
            vector, time = step.vector, step.time
        errors.append(np.abs(vector - CASES["nonlinear"][2](1.5)).max())
    order = np.log2(errors[0] / errors[1])
    assert order == pytest.approx(2.0, abs=0.1), f"order {order:.3f}"


def polynomial(stages):
    """T_s(w0) and its first three derivatives from the Chebyshev series; with w0, w1 and b_s."""
    series = [0.0] * stages + [1.0]
    w0 = 1 + 2 / 13 / stages**2
    values = [
        chebyshev.chebval(w0, chebyshev.chebder(series, order)) if order <= stages else 0.0
        for order in range(4)
    ]
    return values, w0, values[1] / values[2], values[2] / values[1] ** 2


def closed_form(stages, z):
    """a_s + b_s T_s(w0 + w1 z)."""
    (T, *_), w0, w1, b = polynomial(stages)
    return 1 - b * T + b * chebyshev.chebval(w0 + w1 * z, [0.0] * stages + [1.0])


def amplification(stages, z):
    """What one step makes of 1 in y' = z y, for all z at once."""
    ones = np.ones_like(z)
    step = rkc2(
        lambda vector, time: z * vector,
        ones,
        0.0,
        z * ones,
        knowing(1.0, radius_for(stages), z.size),
        Accuracy(ANY, ones),
        math.inf,
        math.inf,
    )
    assert step.stages == step.evaluations == stages
    return step.vector


@pytest.mark.parametrize("stages", range(2, 21))
def test_a_mode_is_amplified_by_the_stability_polynomial(stages):
    z = -np.linspace(0, 1, 999) * scheme.reach(stages)
    amplified = amplification(stages, z)
    # A stage rounds five terms of size 2 at most; errors of the stages add up to s² of them.
    rounding = 10 * stages**2 * np.finfo(float).eps
    np.testing.assert_allclose(amplified, closed_form(stages, z), rtol=0, atol=rounding)
    assert np.abs(amplified).max() <= 1 + rounding
    (T, *_), w0, w1, b = polynomial(stages)
    fast = np.abs(amplified[w0 + w1 * z <= 1])
    # Where |T_s| <= 1; 1 - b (T_s(w0) - 1) is about 1 - ε/3.
    assert fast.max() <= 1 - b * (T - 1) + rounding
    assert fast.max() < 0.97


@pytest.mark.parametrize("stages", [2, 3, 7, 50, 200])
def test_the_stable_range_is_used_but_not_exceeded(stages):
    _, w0, w1, _ = polynomial(stages)
    exact = (1 + w0) / w1  # where w0 + w1 z = -1
    assert 0.99 * exact < scheme.reach(stages) <= exact


def test_stages_are_the_fewest_that_are_stable():
    for stiffness in np.geomspace(1e-3, 2e4, 500):
        stages = scheme._stages(stiffness)
        assert stages >= 2
        assert scheme.reach(stages) >= 1.2 * stiffness * (1 - 1e-12)
        assert stages == 2 or scheme.reach(stages - 1) < 1.2 * stiffness


def laplacian(vector, time):
    """Second difference on (0, 1) with the ends held at 0."""
    padded = np.pad(vector, 1)
    return np.diff(padded, 2) * (vector.size + 1) ** 2


def test_heat_flows_at_a_hundred_times_the_step_of_euler():
    count, end = 200, 0.1
    h = 1 / (count + 1)
    x = h * np.arange(1, count + 1)
    wave = {k: np.sin(k * np.pi * x) for k in (1, 3)}
    decay = {k: (2 / h * np.sin(k * np.pi * h / 2)) ** 2 for k in wave}
    step = 100 * h**2 / 2
    steps = march(rkc2, laplacian, wave[1] + wave[3], end, step, largest=step)
    exact = sum(wave[k] * np.exp(-decay[k] * end) for k in wave)
    # Leading error of the scheme, z³/15 a step and mode; half as much again for the next orders.
    bound = 1.5 * sum(end * decay[k] ** 3 * step**2 / 15 * np.exp(-decay[k] * end) for k in wave)
    assert np.abs(steps[-1].vector - exact).max() < bound
    assert sum(s.evaluations for s in steps) < 0.3 * end / (h**2 / 2)
    assert sum(s.rejections for s in steps) == 0


def brusselator(vector, time):
    """Reaction and diffusion of two species on (0, 1), 20 points each (Hairer & Wanner)."""
    u, v = vector.reshape(2, -1)
    left, right = np.array([1.0, 3.0])[:, None], np.array([1.0, 3.0])[:, None]
    padded = np.concatenate([left, vector.reshape(2, -1), right], axis=1)
    diffusion = 0.02 * (u.size + 1) ** 2 * np.diff(padded, 2, axis=1)
    return (diffusion + np.array([1 + u * u * v - 4 * u, 3 * u - u * u * v])).ravel()


def squeezed(vector, time):
    """Overdamped chain between a wall at rest and one that comes closer; contacts (1/r)^10."""
    wall = vector.size + 1 - 2 * time
    gap = np.diff(np.concatenate([[0.0], vector, [wall]]))
    with np.errstate(all="ignore"):
        push = np.where(gap > 0, gap, np.nan) ** -10
    return push[:-1] - push[1:]


x20 = np.arange(1, 21) / 21
STIFF = {
    "brusselator": (
        brusselator,
        np.concatenate([1 + np.sin(2 * np.pi * x20), np.full(20, 3.0)]),
        3.0,
    ),
    "squeezed": (squeezed, np.arange(1.0, 13.0) + 0.1 * np.sin(7.0 * np.arange(1, 13)), 2.0),
}


@pytest.mark.parametrize("case", STIFF)
def test_the_error_follows_the_tolerance(case):
    rate, vector, end = STIFF[case]
    reference = solve_ivp(
        lambda t, y: rate(y, t), (0, end), vector, method="LSODA", rtol=1e-12, atol=1e-12
    ).y[:, -1]
    tolerances = np.array([1e-2, 1e-3, 1e-4, 1e-5])
    errors = []
    for tolerance in tolerances:
        steps = march(rkc2, rate, vector, end, 1e-3, tolerance)
        assert all(0 <= s.error <= 1 for s in steps)
        errors.append(np.abs(steps[-1].vector - reference).max())
    if case == "brusselator":
        # A local error of the third order makes a global one of the power 2/3 of the tolerance.
        power = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
        assert power == pytest.approx(2 / 3, abs=0.15), f"errors {errors}, power {power:.2f}"
        assert max(errors / tolerances ** (2 / 3)) < 1
    else:
        # The contacts pull the chain back to one solution, so that errors do not add up.
        assert all(errors < tolerances), f"errors {errors}"
        assert all(np.diff(errors) < 0), f"errors {errors}"
        assert max(s.stages for s in steps) > 5


def one_step(rate, vector, stages, dt):
    return rkc2(
        rate,
        vector,
        0.0,
        rate(vector, 0.0),
        knowing(dt, radius_for(stages, dt), vector.size),
        Accuracy(1.0, np.ones_like(vector)),
        math.inf,
        math.inf,
    )


@pytest.mark.parametrize("stages", [2, 3, 5, 20])
def test_the_estimate_of_a_mode_is_the_true_error_times_a_known_factor(stages):
    dt = 1e-2
    step = one_step(lambda vector, time: -vector, np.ones(1), stages, dt)
    (*_, dddT), _, w1, b = polynomial(stages)
    missing = 1 / 6 - b * w1**3 * dddT / 6
    # The estimate is made with the new point, whose own error it therefore holds 12/15 times.
    factor = (1 + 12 * missing) / (15 * missing)
    assert 1.2 <= factor < 1.82
    true = abs(step.vector[0] - np.exp(-dt))
    assert step.error / true == pytest.approx(factor, rel=2 * dt)  # the next order


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("stages", [2, 3, 5, 20])
def test_the_estimate_is_the_local_error_to_a_factor_of_two_and_a_half(stages, case):
    rate, vector, exact = CASES[case]
    step = one_step(rate, vector, stages, 1e-2)
    true = np.abs(step.vector - exact(1e-2)).max()
    assert 1 / 2.5 < step.error / true < 2.5, f"ratio {step.error / true:.2f}"


def test_a_component_of_infinite_scale_does_not_count_but_must_be_finite():
    def rate(vector, time):
        return np.array([-vector[0], 1e9 * np.sin(1e9 * time)])

    vector, scale = np.array([1.0, 0.0]), np.array([1.0, math.inf])
    first = rate(vector, 0.0)

    def one(rate):
        memory = knowing(1e-3, 1.0, size=2)
        return rkc2(rate, vector, 0.0, first, memory, Accuracy(1e-6, scale), math.inf, math.inf)

    assert one(rate).rejections == 0
    with pytest.raises(NumericalError, match="not finite"):
        one(lambda vector, time: np.array([-vector[0], np.nan]))


# --- the spectral radius ------------------------------------------------------------------------


def estimated(rate, vector, memory=None, scale=None):
    """Memory after a step that estimates the radius at ``vector``, and the evaluations it took."""
    scale = np.ones_like(vector) if scale is None else scale
    step = rkc2(
        rate,
        vector,
        0.0,
        rate(vector, 0.0),
        memory or Memory.start(1e-9),
        Accuracy(ANY, scale),
        math.inf,
        math.inf,
    )
    return step.memory, step.evaluations - step.stages


def random_symmetric(rng, size):
    square = rng.standard_normal((size, size))
    return -square @ square.T


def constrained_product(rng, size):
    """-diag(I, -K) M diag(H, -K): forces from shape and control, carried by a mobility."""
    square = rng.standard_normal((size, size))
    mobility = square @ square.T / size + 0.1 * np.eye(size)
    gain = 3.0
    shape = 10 ** rng.uniform(-3, 2, size - 1)
    left = np.diag(np.append(np.ones(size - 1), -gain))
    right = np.diag(np.append(shape, -gain))
    return -left @ mobility @ right


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("matrix", [random_symmetric, constrained_product])
def test_the_power_iteration_finds_the_radius_within_its_safety(matrix, seed):
    rng = default_rng(SeedSequence([1998, seed]))
    jacobian = matrix(rng, 80)
    memory, evaluations = estimated(
        lambda vector, time: jacobian @ vector + 0.1 * np.sin(vector), rng.standard_normal(80)
    )
    exact = np.abs(np.linalg.eigvals(jacobian)).max()
    assert 1 / 1.2 < memory.spectral_radius / exact < 1.2, (
        f"{memory.spectral_radius / exact:.3f} of the radius"
    )
    assert evaluations < 25
    assert memory.radius_age == 1


def test_a_smooth_point_hides_no_stiff_mode():
    x = np.arange(1, 201) / 201
    memory, _ = estimated(laplacian, np.sin(np.pi * x))
    exact = 4 * 201**2
    assert 1 / 1.2 < memory.spectral_radius / exact < 1.2


def test_a_spot_that_became_stiff_is_found_though_the_remembered_direction_misses_it():
    stiffness = np.array([10.0, 1.0, 40.0])
    old = Memory(1e-9, 10.0, scheme.RADIUS_AGE, np.array([1.0, 0.0, 0.0]))
    memory, _ = estimated(lambda vector, time: -stiffness * vector, np.ones(3), old)
    assert memory.spectral_radius == pytest.approx(40.0, rel=0.02)


def test_the_radius_is_kept_for_some_steps_and_then_costs_little():
    rng = default_rng(SeedSequence(4))
    jacobian = random_symmetric(rng, 80)
    steps = march(
        rkc2, lambda y, t: jacobian @ y, rng.standard_normal(80), 6e-2, 1e-3, 1.0, 1e3, 1e-3
    )
    extra = [step.evaluations - step.stages for step in steps]
    assert len(steps) == 60
    assert [n for n, spent in enumerate(extra) if spent] == [0, 25, 50]
    assert max(extra[25], extra[50]) < extra[0]


def test_complex_eigenvalues_leave_room_above_the_radius():
    turn = np.array([[0.0, -100.0], [1.0, 0.0]])  # eigenvalues ±10i, and the norm never settles
    memory, evaluations = estimated(lambda vector, time: turn @ vector, np.array([1.0, 0.3]))
    assert evaluations == spectral.MOST_ITERATIONS
    assert memory.spectral_radius >= 10.0


@pytest.mark.parametrize("scale", [1.0, math.inf])
def test_a_system_at_rest_takes_two_stages(scale):
    step = march(rkc2, lambda y, t: np.zeros_like(y), np.ones(5), 1.0, 1.0, 1e-9, scale)[0]
    assert step.stages == 2
    assert step.memory.spectral_radius == 0.0
    assert step.vector.tolist() == [1.0] * 5


def test_an_unstable_rest_is_seen_without_any_rate_to_go_by():
    memory, _ = estimated(lambda vector, time: -70.0 * vector, np.zeros(3))
    assert memory.spectral_radius == pytest.approx(70.0)


def test_a_step_too_stiff_for_the_most_stages_is_shortened():
    step = rkc2(
        lambda y, t: -1e9 * y,
        np.zeros(2),
        0.0,
        np.zeros(2),
        Memory.start(1.0),
        Accuracy(ANY, np.ones(2)),
        1.0,
        math.inf,
    )
    assert step.stages == scheme.MOST_STAGES
    assert 1.2 * 1e9 * step.time <= scheme.reach(200) * (1 + 1e-8)


# --- step control -------------------------------------------------------------------------------


def refusing(vector, time, refusal):
    """y' = -100 (y - cos t) - sin t, which has no value far from where the solution goes."""
    assert np.isfinite(vector).all(), "a rate is not asked at a point that is no point"
    if abs(vector[0]) > 3:
        if isinstance(refusal, Exception):
            raise refusal
        return np.full_like(vector, refusal)
    return -100 * (vector - np.cos(time)) - np.sin(time)


@pytest.mark.parametrize("refusal", [math.nan, math.inf, NumericalError("y", 0, 0, "too far")])
def test_a_trial_without_a_rate_is_rejected_and_the_run_gets_the_right_answer(refusal):
    def rate(vector, time):
        return refusing(vector, time, refusal)

    vector, time, memory, rejections = np.array([1.5]), 0.0, knowing(1.0, 1.0), []
    while time < 2.0:
        step = rkc2(
            rate,
            vector,
            time,
            rate(vector, time),
            memory,
            Accuracy(1e-5, np.ones(1)),
            2.0,
            math.inf,
        )
        vector, time, memory = step.vector, step.time, step.memory
        rejections.append(step.rejections)
    assert rejections[0] > 0
    assert memory.spectral_radius == pytest.approx(100.0, rel=0.01)
    # Off the slow solution the stiff mode forgets: the error of a step lives for 1/100 only.
    assert abs(vector[0] - np.cos(2.0)) < 1e-5


def test_an_unstable_trial_is_seen_by_its_error_and_leads_to_more_stages():
    stiffness = np.geomspace(1.0, 1e4, 60)
    vector = 1e-3 * np.ones(60)
    step = rkc2(
        lambda y, t: -stiffness * y,
        vector,
        0.0,
        -stiffness * vector,
        knowing(0.1, 1.0, 60),
        Accuracy(1e-3, np.ones(60)),
        math.inf,
        math.inf,
    )
    assert step.rejections > 0
    assert step.memory.spectral_radius == pytest.approx(1e4, rel=0.1)
    assert np.abs(step.vector).max() <= 1e-3


def test_a_stiff_spot_that_only_the_failed_trial_shows_is_found():
    stiffness = np.array([100.0, 10.0, 1000.0])
    vector = np.array([1.0, 1.0, 1e-9])
    step = rkc2(
        lambda y, t: -stiffness * y,
        vector,
        0.0,
        -stiffness * vector,
        Memory(0.1, 100.0, 3, np.array([1.0, 0.0, 0.0])),
        Accuracy(1e-2, np.ones(3)),
        math.inf,
        math.inf,
    )
    assert step.rejections > 0
    assert step.memory.spectral_radius == pytest.approx(1000.0, rel=0.02)


def test_a_step_does_not_grow_right_after_a_rejection():
    def rate(vector, time):
        return np.full_like(vector, 1.0 if time < 0.03 else math.nan)

    step = rkc2(
        rate,
        np.zeros(1),
        0.0,
        np.ones(1),
        knowing(0.1, 1.0),
        Accuracy(1e-3, np.ones(1)),
        math.inf,
        math.inf,
    )
    assert step.rejections == 1
    assert step.time == step.memory.step_size == 0.025


NOWHERE = {
    "nan": lambda vector, time: np.full_like(vector, np.nan),
    "inf": lambda vector, time: np.full_like(vector, np.inf),
}


@pytest.mark.parametrize("bad", NOWHERE)
@pytest.mark.parametrize("memory", [Memory.start(0.1), knowing(0.1, 1.0)])
@pytest.mark.parametrize("first", ["good", "bad"])
def test_a_rate_without_a_value_anywhere_ends_the_run(bad, memory, first):
    rate, vector = Watched(NOWHERE[bad]), np.ones(1)
    known = np.ones(1) if first == "good" else NOWHERE[bad](vector, 0.0)
    with pytest.raises(NumericalError, match=r"step_size.* not finite at time 0 "):
        rkc2(rate, vector, 0.0, known, memory, Accuracy(1e-3, np.ones(1)), math.inf, math.inf)
    assert len(rate.calls) < 5


def test_a_rate_that_refuses_everywhere_ends_the_run_and_is_named_as_the_cause():
    cause = NumericalError("film", 3, 7, "closed")

    def rate(vector, time):
        raise cause

    with pytest.raises(NumericalError, match="not finite") as caught:
        rkc2(
            rate,
            np.ones(2),
            0.0,
            np.ones(2),
            Memory.start(1.0),
            Accuracy(1.0, np.ones(2)),
            1.0,
            math.inf,
        )
    assert caught.value.__cause__ is cause


@pytest.mark.parametrize("refusal", ["raises", "nan", "jumps"])
def test_a_wall_in_time_ends_the_run_after_a_bounded_number_of_trials(refusal):
    cause = NumericalError("film", 3, 7, "closed")

    def rate(vector, time):
        if time > 0 and refusal == "raises":
            raise cause
        height = {"nan": math.nan, "jumps": 1e30}.get(refusal, 0.0) if time > 0 else 0.0
        return height - vector

    watched = Watched(rate)
    with pytest.raises(NumericalError, match=f"rejected {scheme.MOST_REJECTIONS} ") as caught:
        rkc2(
            watched,
            np.ones(2),
            0.0,
            -np.ones(2),
            Memory.start(1.0),
            Accuracy(1e-3, np.ones(2)),
            10.0,
            math.inf,
        )
    assert caught.value.__cause__ is (cause if refusal == "raises" else None)
    assert ("the rate jumps there" in str(caught.value)) == (refusal == "jumps")
    assert len(watched.calls) <= 2 * scheme.MOST_REJECTIONS + spectral.MOST_ITERATIONS


def test_a_step_is_never_silently_zero():
    with pytest.raises(NumericalError, match="no longer advance the time"):
        rkc2(
            linear,
            np.ones(2),
            1e9,
            linear(np.ones(2), 0.0),
            knowing(1e-9, 1.0, 2),
            Accuracy(1.0, np.ones(2)),
            math.inf,
            math.inf,
        )


def wish_after(wish, until=math.inf, largest=math.inf):
    vector = np.array([1.0, 0.0])
    step = rkc2(
        linear,
        vector,
        0.0,
        linear(vector, 0.0),
        knowing(wish, 1.0, 2),
        Accuracy(2e-3, np.ones(2)),
        until,
        largest,
    )
    assert step.rejections == 0
    return step


@pytest.mark.parametrize("limit", [{"until": 1e-9}, {"largest": 1e-6}, {"until": 0.02}])
def test_a_step_cut_short_does_not_lower_the_wish(limit):
    step = wish_after(0.2, **limit)
    assert step.time == pytest.approx(min(limit.values()))
    assert step.memory.step_size == 0.2


def test_a_step_cut_short_lowers_the_wish_where_its_own_error_forbids_it():
    step = wish_after(10.0, until=0.2)
    assert 0.5 < step.error <= 1
    assert step.memory.step_size == pytest.approx(0.2 * 0.8 * step.error ** (-1 / 3))


def test_the_wish_meets_the_tolerance_and_grows_five_times_at_most():
    assert wish_after(1e-3).memory.step_size == pytest.approx(5e-3)
    assert wish_after(1e-3, largest=5e-4).memory.step_size == pytest.approx(2.5e-3)
    step = wish_after(0.2)
    assert step.memory.step_size == pytest.approx(0.2 * 0.8 * step.error ** (-1 / 3))
    # The next step has 0.8³ = 0.51 of the tolerance, up to the next order.
    assert wish_after(step.memory.step_size).error == pytest.approx(0.51, rel=0.2)


@pytest.mark.parametrize("name", INTEGRATORS)
def test_the_last_step_ends_at_the_very_number(name):
    time, until = -3.0, -0.9
    assert time + (until - time) != until
    step = INTEGRATORS[name](
        linear,
        np.ones(2),
        time,
        linear(np.ones(2), time),
        knowing(2 * (until - time), 1.0, 2),
        Accuracy(ANY, np.ones(2)),
        until,
        math.inf,
    )
    assert step.time == until


@given(
    time=st.floats(-10, 10),
    span=st.floats(1e-3, 10),
    ratio=st.floats(1e-2, 1e2),
    name=st.sampled_from(sorted(INTEGRATORS)),
)
def test_steps_land_evenly_and_exactly(time, span, ratio, name):
    until, wanted, start = time + span, ratio * span, time
    vector, rate = np.zeros(1), np.ones(1)
    memory, taken = knowing(wanted, 1.0), []
    while time < until:
        step = INTEGRATORS[name](
            lambda y, t: np.ones(1),
            vector,
            time,
            rate,
            memory,
            Accuracy(1.0, np.ones(1)),
            until,
            wanted,
        )
        taken.append(step.time - time)
        vector, time = step.vector, step.time
    assert time == until
    assert len(taken) == math.ceil((until - start) / wanted * (1 - 1e-9))
    # A time is rounded to an ulp of 20 at most.
    np.testing.assert_allclose(taken, (until - start) / len(taken), rtol=0, atol=1e-14 * len(taken))
    assert max(taken) <= wanted * (1 + 2e-9) + 1e-14 * len(taken)


# --- the contract of a stepper ------------------------------------------------------------------


def settings(name, rejected=False):
    """A stiff step; with a rejection on its way if asked."""
    stiffness = np.geomspace(1.0, 50.0, 7)

    def rate(vector, time):
        return np.cos(time) - stiffness * vector**3

    vector = np.linspace(0.5, 2.0, 7)
    memory = replace(Memory.start(0.3), step_size=30.0 if rejected else 2e-4)
    return rate, vector, 0.25, rate(vector, 0.25), memory, Accuracy(1e-2, np.ones(7)), 50.0, 40.0


@pytest.mark.parametrize(
    ("name", "rejected"),
    [
        ("euler", False),
        ("rkc2", False),
        ("rkc2", True),
        ("imex_rkc2", False),
        ("imex_rkc2", True),
    ],
)
def test_no_argument_is_modified_and_the_last_rate_is_that_of_the_result(name, rejected):
    rate, *rest = settings(name, rejected)
    watched = Watched(rate)
    vector, _, first, memory, accuracy, *_ = rest
    arrays = [vector, first, memory.direction, accuracy.scale]
    before = [array.copy() for array in arrays]
    step = INTEGRATORS[name](watched, *rest)
    assert [a.tobytes() for a in arrays] == [b.tobytes() for b in before]
    assert step.evaluations == len(watched.calls)
    if name != "euler":
        assert (step.rejections > 0) == rejected
    _, seen, time = watched.calls[-1]
    assert seen.tobytes() == step.vector.tobytes()
    assert time == step.time
    assert rate(step.vector, step.time).tobytes() == step.rate.tobytes()
    for passed, then, _ in watched.calls[:-1]:
        assert not np.shares_memory(passed, vector)
        assert not np.shares_memory(passed, step.vector) or not np.array_equal(then, seen)


@pytest.mark.parametrize("name", INTEGRATORS)
def test_a_run_goes_on_bit_for_bit_from_what_is_remembered(name):
    rate, vector, end = STIFF["squeezed"]
    step = 1e-4 if name == "euler" else 2e-3
    end = 300 * step if name == "euler" else end
    # So small that the radius is estimated again on the way.
    tolerance = 2e-4 if name == "imex_rkc2" else 1e-3
    whole = march(INTEGRATORS[name], rate, vector, end, step, tolerance)
    assert len(whole) > 41
    accuracy = Accuracy(tolerance, np.ones_like(vector))
    for cut in (1, 198, 199, 200, 250) if name == "euler" else (1, 24, 25, 26, 40):
        step = whole[cut]
        remembered = step.memory
        memory = replace(
            remembered, direction=remembered.direction.copy(), drift=remembered.drift.copy()
        )
        again = INTEGRATORS[name](
            rate,
            step.vector.copy(),
            step.time,
            rate(step.vector, step.time),
            memory,
            accuracy,
            end,
            math.inf,
        )
        after = whole[cut + 1]
        assert again.vector.tobytes() == after.vector.tobytes()
        assert again.memory.direction.tobytes() == after.memory.direction.tobytes()
        assert again.memory.drift.tobytes() == after.memory.drift.tobytes()
        assert (
            again.time,
            again.memory.step_size,
            again.memory.spectral_radius,
            again.memory.radius_age,
            again.memory.shift,
        ) == (
            after.time,
            after.memory.step_size,
            after.memory.spectral_radius,
            after.memory.radius_age,
            after.memory.shift,
        )


def test_euler_adds_the_known_rate_and_evaluates_once():
    watched = Watched(lambda vector, time: 10 * vector + time)
    step = euler(
        watched,
        np.array([1.0, 2.0]),
        1.0,
        np.array([3.0, -4.0]),
        knowing(0.5, 1.0, 2),
        Accuracy(0.0, np.ones(2)),
        math.inf,
        0.1,
    )
    assert step.vector.tolist() == [2.5, 0.0]
    assert step.time == 1.5
    assert step.rate.tolist() == [26.5, 1.5]
    assert len(watched.calls) == 1
    assert (step.error, step.stages, step.evaluations, step.rejections) == (0.0, 1, 1, 0)
    assert step.memory.step_size == 0.5
    assert step.memory.radius_age == 1


STIFFNESSES = np.array([1.0, 3.0, 7.0, 40.0])
"""Decay rates of a test of Euler's limit: 2/40 is stable, longer steps are not."""


def euler_step(step, memory=None, rate=lambda vector, time: -STIFFNESSES * vector):
    vector = np.array([1.0, 1.0, 1.0, 0.01])
    memory = memory or Memory.start(step)
    first = rate(vector, 0.0)
    return euler(rate, vector, 0.0, first, memory, Accuracy(1.0, np.ones(4)), math.inf, math.inf)


@pytest.mark.parametrize("ratio", [0.5, 0.94, 1.01, 3.0])
def test_euler_refuses_just_the_steps_that_are_not_stable(ratio):
    limit = 2 / STIFFNESSES.max()
    if ratio < 1:
        assert euler_step(ratio * limit).memory.spectral_radius == pytest.approx(40.0, rel=0.01)
        return
    with pytest.raises(NumericalError, match=r"state\[3\].*time_stepping.step") as caught:
        euler_step(ratio * limit)
    stable, advised = (
        float(each) for each in re.findall(r"stable (\S+); .* at most (\S+),", str(caught.value))[0]
    )
    assert stable * explicit.RADIUS_SAFETY == pytest.approx(limit, rel=0.01)
    assert advised == pytest.approx(explicit.ADVISED * stable, rel=0.02)
    euler_step(advised)


def test_euler_looks_again_after_some_steps():
    """A mode that became stiff since the last look is found at the next one, and not before."""
    known = Memory(step_size=0.06, spectral_radius=1.0, radius_age=0, direction=np.ones(4))
    for age in (0, explicit.RADIUS_AGE - 1):
        assert euler_step(0.06, replace(known, radius_age=age)).memory.radius_age == age + 1
    with pytest.raises(NumericalError, match="longer than the stable"):
        euler_step(0.06, replace(known, radius_age=explicit.RADIUS_AGE))


def test_euler_leaves_a_lost_rate_to_its_caller():
    step = euler_step(0.01, rate=NOWHERE["nan"])
    assert np.isnan(step.vector).all()


def test_a_zigzag_that_forces_hold_at_a_finite_size_is_refused():
    """y' = -sin y at 1.2 times its limit at 0: y flips for ever between finite values."""
    rate, y, dt = (lambda vector, time: -np.sin(vector)), np.array([0.5]), 2.4
    flips = []
    for _ in range(400):
        y = y + dt * rate(y, 0.0)
        flips.append(float(y[0]))
    assert np.isfinite(flips).all()
    assert min(np.abs(flips[-10:])) > 0.1, "nothing zigzags"
    with pytest.raises(NumericalError, match="longer than the stable"):
        euler(
            rate,
            np.zeros(1),
            0.0,
            rate(np.zeros(1), 0.0),
            Memory.start(dt),
            Accuracy(1.0, np.ones(1)),
            math.inf,
            math.inf,
        )


def test_integrators_know_no_physics():
    imported = {
        name
        for module in (integrators, explicit, scheme, spectral, stepping)
        for node in ast.walk(ast.parse(inspect.getsource(module)))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in [getattr(node, "module", None), *(alias.name for alias in node.names)]
        if name and name.startswith("softslip")
    }
    assert {name for name in imported if not name.startswith("softslip.solver.integrators")} == {
        "softslip.errors",
        "softslip.solver.stepper_memory",
    }
