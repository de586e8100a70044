"""What is in memory comes back from what a file has, whatever it is; conventions hold there."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from softslip.files.conventions import EARTHLY, as_stored, as_used, file_units
from softslip.files.discovery import COMMON, DESCRIPTIONS, discovery, without_discovery

UNITS = st.sampled_from(
    [
        "1",
        "s",
        "length unit",
        "1 / time unit",
        "s / time unit",
        "degree",
        "MiB",
        "as of each quantity",
    ]
)
ATTRIBUTES = st.fixed_dictionaries(
    {}, optional={"units": UNITS, "long_name": st.text("abc ", min_size=1), "symbol": st.just("σ")}
)
NUMBERS = st.floats() | st.integers(-3, 3).map(float)
NAMES = st.sampled_from([*sorted(EARTHLY), "stress", "axis", "wall", "cell"])


def arrays(elements, size, kind):
    return st.lists(elements, min_size=size, max_size=size).map(lambda each: np.array(each, kind))


def values(size):
    """Numbers in any order, with gaps or twice; whole numbers, truth values, or words."""
    return st.one_of(
        arrays(NUMBERS, size, float),
        st.just(np.linspace(0, 1, size)),
        st.just(np.arange(size)[::-1]),
        st.lists(st.booleans(), min_size=size, max_size=size).map(
            lambda each: np.array(each, bool)
        ),
        st.lists(st.text("xyz"), min_size=size, max_size=size).map(
            lambda each: np.array(each, "U9")
        ),
    )


@st.composite
def datasets(draw):
    sizes = draw(st.dictionaries(NAMES, st.integers(0, 4), min_size=1, max_size=3))
    dataset = xr.Dataset(attrs={"particles": 7})
    for dim, size in sizes.items():
        if draw(st.booleans()):
            coordinate = dim, draw(values(size)), draw(ATTRIBUTES)
            dataset = dataset.assign_coords({dim: coordinate})
        for name in draw(st.sets(st.sampled_from(["rate", "rate_error", "flag"]))):
            dataset[f"{name}_{dim}"] = dim, draw(values(size)), draw(ATTRIBUTES)
    dataset["whole"] = tuple(sizes), np.zeros(tuple(sizes.values())), draw(ATTRIBUTES)
    return dataset.assign_coords(wall_separation=((), draw(NUMBERS), draw(ATTRIBUTES)))


@given(datasets())
def test_what_is_stored_is_used_as_it_was(dataset):
    before = dataset.copy(deep=True)
    used = as_used(as_stored(dataset))
    assert used.identical(dataset), f"{used} is not {dataset}"
    for name, variable in dataset.variables.items():
        assert used[name].dtype == variable.dtype, name
        if variable.dtype.kind in "fib":
            assert used[name].values.tobytes() == variable.values.tobytes(), name
    assert list(used.data_vars) == list(dataset.data_vars)
    assert dataset.identical(before), "it was changed"


@given(datasets())
def test_a_coordinate_variable_is_known_numbers_in_order_of_no_name_of_the_earth(dataset):
    stored = as_stored(dataset)
    assert not EARTHLY & set(stored.dims)
    for dim in set(stored.dims) & set(stored.variables):
        found = stored[dim].values
        assert found.dtype.kind in "if", f"{dim} has values of type {found.dtype}"
        rising = found if len(found) < 2 or found[0] < found[-1] else found[::-1]
        assert sorted(set(found.tolist())) == rising.tolist(), f"{dim} is {found}"
        assert not np.isnan(found).any(), f"{dim} is {found}"


@given(datasets())
def test_every_variable_says_what_kind_of_content_it_is(dataset):
    stored = as_stored(dataset)
    for name, variable in stored.variables.items():
        kind = variable.attrs["coverage_content_type"]
        assert (kind == "coordinate") == (name in stored.coords), name
        if variable.dtype.kind == "b":
            assert variable.attrs["flag_meanings"].split() == ["false", "true"]
            assert variable.attrs["flag_values"].dtype == np.int8


@pytest.mark.parametrize(
    ("units", "wanted"),
    [
        ("1", "1"),
        ("length unit", "1"),
        ("length unit2", "1"),
        ("1 / time unit", "1"),
        ("length unit / time unit / stress unit", "1"),
        ("stress unit * (time unit)^n", "1"),
        ("products of the parameters' units", "1"),
        ("as of each quantity", "1"),
        ("radius", "1"),
        ("contact range", "1"),
        ("s / time unit", "s"),
        ("byte / s", "byte / s"),
        ("1 / s", "1 / s"),
        ("degree", "degree"),
        ("MiB", "1048576 byte"),
        ("MiB / time unit", "1048576 byte"),
        ("length unit / s", "1 / s"),
    ],
)
def test_units_of_the_model_are_pure_numbers(units, wanted):
    assert file_units(units) == wanted
    assert file_units(wanted) == wanted


def test_content_is_told_by_what_it_is():
    numbers = ("cell", np.zeros(2))
    dataset = xr.Dataset(
        {
            "rate": (*numbers, {"units": "1 / time unit"}),
            "rate_error": (*numbers, {"units": "1 / time unit"}),
            "cost": (*numbers, {"units": "s / time unit"}),
            "flops": (*numbers, {"units": "1 / s"}),
            "peak": (*numbers, {"units": "MiB"}),
            "steady": ("cell", np.zeros(2, dtype=bool)),
            "status": ("cell", ["done", "missing"]),
        },
        coords={"label": ("cell", ["a", "b"])},
    )
    stored = as_stored(dataset)
    assert {
        name: each.attrs["coverage_content_type"] for name, each in stored.variables.items()
    } == {
        "rate": "modelResult",
        "rate_error": "qualityInformation",
        "cost": "physicalMeasurement",
        "flops": "physicalMeasurement",
        "peak": "physicalMeasurement",
        "steady": "qualityInformation",
        "status": "auxiliaryInformation",
        "label": "coordinate",
    }
    named = {name for name, each in stored.variables.items() if "ancillary_variables" in each.attrs}
    assert named == {"rate"}
    assert stored["rate"].attrs["ancillary_variables"] == "rate_error"


@pytest.mark.parametrize(
    "dataset",
    [
        xr.Dataset({"rate": ("model_time", np.zeros(2))}),
        xr.Dataset({"rate": (("time", "model_time"), np.zeros((2, 2)))}),
        xr.Dataset({"model_time": ("cell", np.zeros(2))}, coords={"time": ("time", np.arange(2))}),
        xr.Dataset(coords={"axis_label": ("axis", ["x", "y"])}),
        xr.Dataset(coords={"axis": ["x", "y"], "axis_label": ("axis", ["u", "v"])}),
        xr.Dataset({"axis_label": ("cell", np.zeros(2)), "rate": ("axis", np.zeros(3))}),
    ],
)
def test_names_that_only_files_have_are_refused(dataset):
    with pytest.raises(ValueError, match="is a name that only files have"):
        as_stored(dataset)


def test_what_was_written_without_conventions_is_used_as_it_is():
    old = xr.Dataset(
        {"rate": ("time", np.zeros(2), {"units": "1 / time unit", "long_name": "rate"})},
        coords={"time": ("time", [1.0, 2.0], {"units": "time unit"}), "axis": ["x", "y"]},
        attrs={"stage": "creep", "run": "demo"},
    )
    assert as_used(old).identical(old)
    assert without_discovery(old.attrs) == old.attrs


@pytest.mark.parametrize("stage", [*DESCRIPTIONS, "toy"])
def test_attributes_for_discovery_go_as_they_came(stage):
    own = {"stage": stage, "run": "a run", "summary": "its own", "particles": np.int64(7)}
    given = discovery(stage, "a run")
    assert set(COMMON) < set(given)
    assert " " not in given["id"]
    assert all(text.isascii() and text for text in given.values())
    assert without_discovery({**given, **own}) == own
    del own["summary"]
    assert without_discovery({**given, **own}) == own
