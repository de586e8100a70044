import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from softslip.simulation.arrays import below, under

names = st.text("abc/", min_size=1, max_size=6)
groups = st.text("abc", min_size=1, max_size=3)


@given(groups, st.dictionaries(names, st.floats(allow_nan=False)))
def test_what_is_put_under_a_group_is_found_below_it(group, values):
    arrays = under(group, values)
    assert all(isinstance(array, np.ndarray) for array in arrays.values())
    assert below(arrays, group) == values


def test_groups_whose_names_begin_alike_are_kept_apart():
    arrays = under("mean", {"a": 1.0}) | under("means", {"a": 2.0}) | {"mean": np.asarray(3.0)}
    assert below(arrays, "mean") == {"a": 1.0}
