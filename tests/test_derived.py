from typing import Any

import pytest

from softslip.derived import (
    SPLIT_OVER_REGULARISATION,
    SPLIT_OVER_SPACING,
    bump_count,
    bump_radius,
    farthest_reach,
    split_length,
)
from softslip.parameters import Parameters


@pytest.mark.parametrize(
    ("hydrodynamics", "wanted"),
    [
        ({"split": 6.0}, 6.0),
        ({"node_spacing": 5.0, "quadrature": "corrected"}, SPLIT_OVER_SPACING * 5),
        ({"node_spacing": 0.5}, SPLIT_OVER_REGULARISATION),
        ({"node_spacing": 0.5, "regularisation": 2.0}, SPLIT_OVER_REGULARISATION * 2),
    ],
)
def test_a_split_is_chosen_where_none_is_given(
    hydrodynamics: dict[str, Any], wanted: float
) -> None:
    held = Parameters.from_mapping({"hydrodynamics": {"mobility": "ewald", **hydrodynamics}})
    assert split_length(held) * held.hydrodynamics.resolution == pytest.approx(wanted, rel=1e-14)


@pytest.mark.parametrize(("length", "gap", "wanted"), [(0.5, 0.02, 0.02), (0.03, 0.02, 0.01)])
def test_the_near_sum_reaches_neither_across_the_gap_nor_around(
    length: float, gap: float, wanted: float
) -> None:
    tree = {
        "channel": {"length": length, "height": 0.5, "outer_gap": gap},
        "hydrodynamics": {"resolution": 5000},
        "suspension": {"area_fraction": 0},
    }
    assert farthest_reach(Parameters.from_mapping(tree)) == pytest.approx(wanted, rel=1e-14)


@pytest.mark.parametrize(("separation", "count"), [(5.0, 20), (5.2, 19), (10.0, 10)])
def test_bumps_are_as_many_as_fit_the_wanted_separation_best(separation: float, count: int) -> None:
    """In a period of 0.5, bumps of radius 0.005."""
    wall = {"roughness": 0.5, "bump_separation": separation}
    rough = Parameters.from_mapping({"wall": wall, "suspension": {"mean_radius": 0.01}})
    assert bump_radius(rough) == 0.005
    assert bump_count(rough) == count


def test_a_smooth_wall_has_no_bumps() -> None:
    assert (bump_radius(Parameters()), bump_count(Parameters())) == (0.0, 0)
