import pytest

from softslip.studies.validation.friction import Friction


def solved(**values):
    return Friction.of(values).solve()


@pytest.mark.parametrize("shape", ["sheets", "circles"])
@pytest.mark.parametrize("fidelity", ["literal", "preview", "standard", "paper", "converged"])
def test_contact_points_of_every_level_slide(shape, fidelity):
    outcome = solved(shape=shape, fidelity=fidelity)
    assert outcome.passed, outcome.as_mapping()
    # An exact zero would mean that nothing touched.
    assert outcome.result["friction"] > 0


@pytest.mark.parametrize("shape", ["sheets", "circles"])
def test_points_too_far_apart_interlock(shape):
    outcome = solved(shape=shape, node_spacing=8.0, refinement=1)
    assert not outcome.passed
    assert outcome.error > 0.1
    assert solved(shape=shape, node_spacing=8.0, refinement=4).passed


def test_points_between_nodes_are_as_good_as_nodes_on_a_straight_line():
    refined = solved(node_spacing=4.0, refinement=2).result
    nodes = solved(node_spacing=2.0, refinement=1, offsets=32).result
    # A whole node spacing of one is two of the other: the sixteen offsets differ, not the curve.
    assert refined["friction"] == pytest.approx(nodes["friction"], rel=0.05)
    assert refined["point_spacing"] == nodes["point_spacing"] == 2.0
