from typing import Any

import pytest

from softslip.config.parameters import Parameters
from softslip.simulation.assembly import split_length_of
from softslip.simulation.sample import channel_box
from softslip.solver.splitting import (
    SPLIT_OVER_REGULARISATION,
    SPLIT_OVER_SPACING,
    farthest_reach,
)


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
    assert split_length_of(held) * held.hydrodynamics.resolution == pytest.approx(wanted, rel=1e-14)


@pytest.mark.parametrize(("length", "gap", "wanted"), [(0.5, 0.02, 0.02), (0.03, 0.02, 0.01)])
def test_the_near_sum_reaches_neither_across_the_gap_nor_around(
    length: float, gap: float, wanted: float
) -> None:
    tree = {
        "channel": {"length": length, "height": 0.5, "outer_gap": gap},
        "hydrodynamics": {"resolution": 5000},
        "suspension": {"area_fraction": 0},
    }
    box = channel_box(Parameters.from_mapping(tree))
    assert farthest_reach(box) == pytest.approx(wanted, rel=1e-14)
