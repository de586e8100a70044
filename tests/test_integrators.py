import ast
import inspect

import numpy as np
import pytest

from softslip import integrators
from softslip.integrators import INTEGRATORS, euler

ORDERS = {"euler": 1}


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


def error(integrate, case, steps, end=1.5):
    rate, vector, exact = CASES[case]
    step = end / steps
    for n in range(steps):
        vector = integrate(rate, vector, n * step, step, rate(vector, n * step))
    return np.abs(vector - exact(end)).max()


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("name", INTEGRATORS)
def test_integrators_have_their_order(name, case):
    errors = [error(INTEGRATORS[name], case, steps) for steps in (200, 400)]
    order = np.log2(errors[0] / errors[1])
    assert order == pytest.approx(ORDERS[name], abs=0.05), f"order {order:.3f}"


def test_euler_does_not_evaluate_the_rate_again_nor_change_its_arguments():
    def forbidden(vector, time):
        raise AssertionError("the first rate is already known")

    vector, first = np.array([1.0, 2.0]), np.array([3.0, -4.0])
    advanced = euler(forbidden, vector, 0.0, 0.5, first)
    assert advanced.tolist() == [2.5, 0.0]
    assert vector.tolist() == [1.0, 2.0]
    assert first.tolist() == [3.0, -4.0]


def test_integrators_know_no_physics():
    tree = ast.parse(inspect.getsource(integrators))
    imported = {
        name
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in [getattr(node, "module", None), *(alias.name for alias in node.names)]
        if name
    }
    assert not [name for name in imported if name.startswith("softslip")]
