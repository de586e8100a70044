"""Observed orders of accuracy of a collision, and that a wrong one would be seen."""

import numpy as np
import pytest

from softslip.errors import ConfigError, NumericalError
from softslip.studies.validation import order
from softslip.studies.validation.order import ORDERS, Level, Order, apart

SHORT = {"fidelity": "paper", "halvings": 2, "strain": 0.1}


@pytest.mark.parametrize(
    ("integrator", "vary"), [("euler", "step"), ("rkc2", "step"), ("rkc2", "regularisation")]
)
def test_short_collision_has_the_expected_order(integrator, vary):
    outcome = Order.of({**SHORT, "integrator": integrator, "vary": vary}).solve()
    assert outcome.passed, outcome.result
    # Twice the order would mean that something else than the wanted is refined.
    assert outcome.result["order"] < 1.5 * ORDERS[integrator if vary == "step" else vary]
    assert outcome.result["film_thickness"] < 1.0, "no contact"
    assert set(outcome.result) <= set(Order.units)


def test_scheme_of_a_lower_order_fails(monkeypatch):
    monkeypatch.setitem(ORDERS, "euler", 2.0)
    outcome = Order.of({**SHORT, "integrator": "euler"}).solve()
    assert not outcome.passed
    assert outcome.error == pytest.approx(1.0, abs=0.1)


def test_doing_better_than_expected_is_no_error(monkeypatch):
    monkeypatch.setitem(ORDERS, "rkc2", 1.0)
    assert Order.of(SHORT).solve().error == 0.0


def test_the_same_curve_on_other_nodes_is_no_distance_apart():
    def level(count, shift=0.0):
        angle = 2 * np.pi * np.arange(count) / count
        ring = np.column_stack((np.cos(angle) + 0.2 * np.sin(2 * angle), np.sin(angle)))
        return Level(1.0, (ring + np.array([shift, 0.0]),), 1.0, 1.0)

    assert apart(level(20), level(33)) < 1e-14
    assert apart(level(20), level(33, order.LENGTH)) < 1e-14, "moved by a period"
    assert apart(level(20), level(33, 0.01)) == pytest.approx(0.01)


def test_only_what_is_varied_changes():
    first, last = (Order.of({"vary": "regularisation"}).parameters(n) for n in (0, 3))
    assert first.hydrodynamics.regularisation == 8 * last.hydrodynamics.regularisation
    assert first.time_stepping == last.time_stepping
    assert first.membrane == last.membrane
    assert first.hydrodynamics.node_spacing == last.hydrodynamics.node_spacing


def test_mesh_has_no_regularisation_to_vary():
    with pytest.raises(ConfigError, match="regularisation"):
        Order.of({"fidelity": "literal", "vary": "regularisation"}).solve()


def test_steps_that_something_else_limits_are_refused():
    with pytest.raises(NumericalError, match="has limited the steps"):
        Order.of({**SHORT, "coarsest": 0.05, "strain": 1.2}).solve()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("integrator", "vary"),
    [
        ("euler", "step"),
        ("rkc2", "step"),
        ("rkc2", "node_spacing"),
        ("rkc2", "regularisation"),
        ("rkc2", "resolution"),
    ],
)
def test_whole_collision_has_the_expected_order(integrator, vary):
    halvings = 2 if vary == "resolution" else 3
    outcome = Order.of({"integrator": integrator, "vary": vary, "halvings": halvings}).solve()
    assert outcome.passed, outcome.result
