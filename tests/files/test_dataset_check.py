"""What stages write passes; what is damaged in any way is refused by the name of the variable."""

import json

import numpy as np
import pytest
import scenes
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import shear_run, sweep

from softslip.analysis.against_paper import COMPARED, against_paper
from softslip.analysis.fits import fit_laws
from softslip.analysis.observables.structure import structure
from softslip.analysis.observables.tables import creep, flow_curve, profiles
from softslip.errors import DatasetError
from softslip.files.dataset_check import SCHEMAS, check_dataset
from softslip.files.faults import _value_faults
from softslip.files.quantities import dataset_quantity
from softslip.files.schema import Variable
from softslip.files.storage import read_dataset, write_dataset
from softslip.simulation import hydrodynamics
from softslip.simulation.expansion import expand
from softslip.simulation.packing import pack

STAGES = ("packing", "expansion", "ageing", "shear")
TABLES = ("flow_curve", "creep", "profiles", "structure", "fits", "comparison")

UNKNOWN = {
    "packing": set(),
    "expansion": set(),
    "ageing": {"film_thickness"},
    "shear": {"film_thickness"},
    "creep": {"shear_rate_wall", "shear_rate_bulk", "slip_velocity"},
    "comparison": {
        f"{name}{end}"
        for name in COMPARED
        for end in ("", "_error", "_reported_error", "_difference")
    },
}
"""Variables whose values may be NaN, of the stages that say no other way what is known."""

KNOWN = {
    "flow_curve": {"shear_rate_wall", "steady_from", "shear_stress", "snapshots_used"},
    "profiles": {"shear_rate_wall"},
    "structure": {"shear_rate_wall", "structure_snapshots"},
    "fits": {
        *("reduced_chi_square", "yield_stress", "consistency", "flow_index"),
        *("pooled_reduced_chi_square", "pooled_yield_stress", "pooled_consistency"),
        *("joint_reduced_chi_square", "joint_yield_stress", "joint_consistency"),
        *("joint_flow_index", "joint_slip_coefficient", "joint_newtonian_slip_coefficient"),
        *("pooled_flow_index", "slip_coefficient", "slip_coefficient_reduced_chi_square"),
        *("newtonian_slip_coefficient", "newtonian_slip_coefficient_reduced_chi_square"),
        "critical_roughness",
        *("slip_exponent", "slip_exponent_reduced_chi_square"),
        *("slip_yield_stress", "slip_yield_stress_reduced_chi_square"),
        *("slip_time_exponent", "slip_time_exponent_reduced_chi_square"),
        *("yielding_exponent", "yielding_exponent_reduced_chi_square"),
        *("pooled_yielding_exponent", "pooled_yielding_exponent_reduced_chi_square"),
    },
}
"""Variables whose values must be known where a run is done or a fit was made."""

POSITIVE = {
    "packing": {"radius", "final_radius"},
    "expansion": {"area", "target_area", "nodes_per_particle"},
    "ageing": {"reference_area", "nodes_per_particle"},
    "shear": {"time", "interval", "profile_time", "nodes_per_particle"},
    "creep": {"time"},
    "flow_curve": {"yielding_time", "slip_time"},
}
"""Variables that mean nothing at zero or below."""

GROWING = {
    "shear": {"time", "profile_time", "wall_distance", "field_x", "field_y"},
    "creep": {"time"},
    "profiles": {"normalised_position"},
    "structure": {"distance_from_wall", "particle_distance", "quantile"},
    "fits": {"confidence"},
}
"""Variables whose values follow one another."""

FEW = settings(max_examples=5)
"""Each example damages every variable of a stage."""

STRESSES, ROUGHNESSES = (0.01, 0.03, 0.15, 0.2, 0.3, 0.5), (0.0, 0.59)


def labelled(dataset, given):
    """A stage's result with the parameters that the command line adds."""
    return dataset.assign_attrs(parameters=given.model_dump_json())


@pytest.fixture(scope="module")
def datasets(aged, tmp_path_factory):
    """One small dataset of each stage, written and read back."""
    few = scenes.parameters(suspension={"area_fraction": 0.6}, expansion={"ramp_steps": 400})
    packed = pack(few)
    kept = scenes.parameters(
        rheometer={"stress": 0.5},
        time_stepping={"shear_time": 0.05},
        recording={"snapshots": [0.02, 0.05], "profile_interval": 0.02},
    )
    runs = sweep(
        STRESSES, ROUGHNESSES, missing={(0.15, 0.59, 1)}, duration=1000.0, noise=0.03, profiles=4
    )
    curve = flow_curve(runs)
    found = {
        "packing": labelled(packed, few),
        "expansion": labelled(expand(packed, few), few),
        "ageing": labelled(aged, kept),
        "shear": labelled(hydrodynamics.shear(aged, kept), kept),
        "flow_curve": curve,
        "creep": creep(runs),
        "profiles": profiles(runs),
        "structure": structure(
            sweep((0.1, 0.3), ROUGHNESSES, duration=600.0, snapshots=(450.0, 500.0, 550.0))
        ),
        "fits": fit_laws(curve),
        "comparison": against_paper(curve, fit_laws(curve)),
    }
    folder = tmp_path_factory.mktemp("schema")
    for stage, dataset in found.items():
        path = folder / f"{stage}.nc"
        write_dataset(dataset, path, stage=stage, run="test", title="test")
        found[stage] = read_dataset(path, stage=stage, run="test")
    return found


def refused(dataset, stage):
    with pytest.raises(DatasetError) as caught:
        check_dataset(dataset, stage)
    message = str(caught.value)
    assert message.splitlines() == [message], f"not one line: {message!r}"
    assert message.isprintable(), ascii(message)
    assert len(message) < 400, f"{len(message)} characters"
    assert message.endswith("; delete the file and rerun its job"), message
    return message


def assert_refused(dataset, stage, name, *parts):
    message = refused(dataset, stage)
    assert message.split()[:2] == ["variable", message.split()[1]], message
    assert message.split()[1].partition("[")[0] == name, f"{name} is not named in {message!r}"
    for part in parts:
        assert part in message, f"{part!r} is not in {message!r}"


def with_variable(dataset, name, dims, values, attrs):
    """The dataset with another variable of that name; nothing is copied but that."""
    others = {key: held for key, held in dataset.variables.items() if key != name}
    return xr.Dataset({**others, name: (dims, values, attrs)}, attrs=dataset.attrs)


def with_values(dataset, name, values):
    held = dataset.variables[name]
    return with_variable(dataset, name, held.dims, values, held.attrs)


def with_value(dataset, name, place, value):
    values = dataset.variables[name].values.copy()
    values[place] = value
    return with_values(dataset, name, values)


def place_in(data, shape):
    return tuple(data.draw(st.integers(0, size - 1)) for size in shape)


def sweeps_of(stage):
    """The variables whose dimensions are those of the sweep for themselves and for others."""
    schema = SCHEMAS[stage]
    return {"status", *(schema.sweep_of(variable) for variable in schema.variables.values())}


def read_names(dataset, stage):
    """The variables that a stage's schema speaks of, and the values swept."""
    return [str(name) for name in dataset.variables if name in SCHEMAS[stage].variables]


# --- what passes ------------------------------------------------------------------------------


@pytest.mark.parametrize("stage", SCHEMAS)
def test_stages_write_the_units_and_meanings_of_the_table(datasets, stage):
    described = 0
    for name, variable in datasets[stage].variables.items():
        found = dataset_quantity(name)
        # Swept values are described as parameters.
        if found is None or (name in ("stress", "roughness") and stage in TABLES):
            continue
        expected = found.attributes
        if (stage, name) == ("creep", "time"):
            expected |= {"long_name": "middle of each interval"}
        assert variable.attrs == expected, name
        described += 1
    assert described >= 4


@pytest.mark.parametrize("stage", SCHEMAS)
def test_what_a_stage_writes_passes(datasets, stage):
    check_dataset(datasets[stage], stage)
    missing = set(SCHEMAS[stage].variables) - set(datasets[stage].variables)
    assert not missing, f"the example has no {missing}, so that nothing below tries them"


def test_every_number_of_the_chain_is_looked_at(datasets):
    for stage in SCHEMAS:
        swept = {"stress", "roughness", "wall_separation", "seed"}
        strange = set(datasets[stage].variables) - set(SCHEMAS[stage].variables) - swept
        assert not strange, f"{stage} writes {strange}, which its schema leaves out"


def test_a_channel_without_particles_passes():
    given = scenes.empty(time_stepping={"ageing_time": 0.004, "shear_time": 0.02})
    packed = pack(given)
    grown = expand(packed, given)
    aged = hydrodynamics.age(grown, given)
    sheared = hydrodynamics.shear(aged, given)
    found = dict(zip(STAGES, (packed, grown, aged, sheared), strict=True))
    assert found["expansion"].sizes["node"] == 0
    assert "shear_rate_bulk" not in sheared, "the bulk is what this leaves out"
    for stage, dataset in found.items():
        check_dataset(labelled(dataset, given), stage)
        check_dataset(dataset, stage)  # As before the command line has added anything.


def test_runs_made_up_from_laws_pass_but_for_what_no_analysis_reads():
    run = shear_run(0.3, 0.59, snapshots=(5.0, 17.5), duration=30.0, profiles=3)
    whole = run.assign(traction=run["stress"])
    whole = whole.assign_coords(wall=["lower", "upper"], axis=["x", "y"])
    units = {"nodes_per_particle": "1", "stress_deviation": "stress unit"}
    for name, unit in (units | {"profile_time": "time unit"}).items():
        whole[name].attrs["units"] = unit
    check_dataset(whole, "shear")


EXTRA = {
    "seed": (1, 2),
    "wall_separation": (0.125, 0.25),
    "channel_length": (0.25, 0.5),
    "surface": ("soft", "hard"),
}


@pytest.mark.parametrize("extra", EXTRA)
def test_tables_over_any_further_parameter_pass(extra):
    values = EXTRA[extra]
    few = sweep((0.1, 0.3), (0.0,), duration=30.0, profiles=2)
    runs = [({**labels, extra: value}, run) for labels, run in few for value in values]
    curve = flow_curve(runs)
    check_dataset(curve, "flow_curve")
    check_dataset(creep(runs), "creep")
    check_dataset(profiles(runs), "profiles")
    check_dataset(fit_laws(curve), "fits")


def over_separations():
    """The fits of a curve along stress and wall separation, of which two stresses have a slope."""
    heights = (0.125, 0.25, 0.5)
    runs = [
        ({"stress": stress, "wall_separation": height}, run)
        for stress in (0.15, 0.3, 0.5)
        for height in heights
        for run in [shear_run(stress, height=height, duration=1000.0, noise=0.03, profiles=2)]
    ]
    runs[0] = runs[0][0], None
    return fit_laws(flow_curve(runs))


def test_fits_over_wall_separations_have_the_stress_as_a_dimension_and_pass(tmp_path):
    fits = over_separations()
    name = "mooney_slip_velocity"
    assert fits[name].dims == ("stress",)
    assert fits[f"{name}_message"].values.tolist() == [
        "too few steady points: 2 of at least 3 wall separations", "fitted", "fitted",
    ]  # fmt: skip
    # A trend with the wall separation is of each stress, and a yield stress of each separation.
    assert fits["shear_rate_bulk_separation_trend"].dims == ("stress",)
    assert fits["yield_stress"].dims == ("wall_separation",)
    write_dataset(fits, tmp_path / "fits.nc", stage="fits", run="test", title="test")
    back = read_dataset(tmp_path / "fits.nc", stage="fits", run="test")
    xr.testing.assert_equal(back, fits)
    unknown = with_value(fits, name, 1, np.nan)
    assert_refused(unknown, "fits", name, f"a number where {name}_message says 'fitted'")
    check_dataset(with_value(fits, name, 0, np.nan), "fits")
    bare = fits.drop_vars("stress")
    assert_refused(bare, "fits", "stress", "is missing", "swept")
    held = fits.variables[name]
    over = np.stack([held.values] * 3, axis=1)
    turned = with_variable(fits, name, ("stress", "wall_separation"), over, held.attrs)
    assert_refused(turned, "fits", name, "dimensions")


def test_tables_of_a_single_run_and_of_imposed_rates_pass():
    alone = [({}, shear_run(0.3, duration=30.0, profiles=2))]
    driven = [
        ({"imposed_shear_rate": rate}, shear_run(stress, duration=30.0, profiles=2))
        for rate, stress in ((0.1, 0.1), (0.5, 0.3))
    ]
    for runs in (alone, driven):
        curve = flow_curve(runs)
        for stage, table in (
            ("flow_curve", curve),
            ("creep", creep(runs)),
            ("profiles", profiles(runs)),
            ("fits", fit_laws(curve)),
        ):
            check_dataset(table, stage)


def test_variables_that_nobody_knows_are_left_alone(datasets):
    check_dataset(datasets["packing"].assign(colour=("paint", ["red"])), "packing")


# --- what is refused --------------------------------------------------------------------------


@pytest.mark.parametrize("stage", SCHEMAS)
def test_an_empty_dataset_is_refused(stage):
    first = next(iter(SCHEMAS[stage].variables))
    assert_refused(xr.Dataset(), stage, first, "is missing")


@pytest.mark.parametrize("stage", SCHEMAS)
def test_a_missing_variable_is_refused(datasets, stage):
    for name in read_names(datasets[stage], stage):
        assert_refused(datasets[stage].drop_vars(name), stage, name, "is missing")


@pytest.mark.parametrize("stage", TABLES)
def test_missing_swept_values_are_refused(datasets, stage):
    for name in set(datasets[stage].dims) & {"stress", "roughness"}:
        assert_refused(datasets[stage].drop_vars(name), stage, name, "is missing", "swept")


@pytest.mark.parametrize(
    ("group", "first"), [("bulk", "shear_rate_bulk"), ("snapshots", "snapshot_time")]
)
def test_a_group_that_the_parameters_ask_for_may_not_be_missing(datasets, group, first):
    members = [name for name, each in SCHEMAS["shear"].variables.items() if each.group == group]
    without = datasets["shear"].drop_vars(members)
    assert_refused(without, "shear", first, "is missing")
    bare = without.copy()
    del bare.attrs["parameters"]
    check_dataset(bare, "shear")
    tree = json.loads(without.attrs["parameters"])
    tree["recording"] |= {"bulk_margin": None, "snapshots": []}
    check_dataset(without.assign_attrs(parameters=json.dumps(tree)), "shear")


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "{}", '{"recording": 3}', "[" * 10**5, 7])
def test_parameters_that_cannot_be_read_are_refused(datasets, text):
    without = datasets["shear"].drop_dims("snapshot").assign_attrs(parameters=text)
    without = without.drop_vars(["field_x", "field_y", "axis"])
    assert refused(without, "shear").startswith("attribute parameters is ")


@pytest.mark.parametrize("stage", SCHEMAS)
def test_other_dimensions_are_refused(datasets, stage):
    for name in read_names(datasets[stage], stage):
        held = datasets[stage].variables[name]
        renamed = tuple(f"{dim}_" for dim in held.dims) or ("other",)
        values = held.values if held.ndim else held.values[None]
        damaged = with_variable(datasets[stage], name, renamed, values, held.attrs)
        if name in sweeps_of(stage):
            refused(damaged, stage)  # All others are then measured against it.
            continue
        assert_refused(damaged, stage, name, "dimensions")
        if held.ndim > 1:
            turned = with_variable(
                datasets[stage], name, held.dims[::-1], held.values.T, held.attrs
            )
            assert_refused(turned, stage, name, "dimensions")


TYPES = ("float32", ">f8", "int32", "complex128", "object", "U5", "datetime64[s]")


@pytest.mark.parametrize("stage", SCHEMAS)
@pytest.mark.parametrize("kind", TYPES)
def test_other_types_are_refused(datasets, stage, kind):
    for name in read_names(datasets[stage], stage):
        held = datasets[stage].variables[name]
        if held.dtype.kind in "OUT":
            continue
        values = np.ones(held.shape).astype(kind)
        assert_refused(with_values(datasets[stage], name, values), stage, name, "of type")


@pytest.mark.parametrize("stage", SCHEMAS)
def test_numbers_for_words_are_refused(datasets, stage):
    for name in read_names(datasets[stage], stage):
        held = datasets[stage].variables[name]
        if held.dtype.kind not in "OUT":
            continue
        for values in (np.ones(held.shape), np.full(held.shape, None, dtype=object)):
            assert_refused(with_values(datasets[stage], name, values), stage, name, "not words")


@pytest.mark.parametrize("stage", SCHEMAS)
@FEW
@given(units=st.none() | st.text() | st.integers() | st.sampled_from(["m", "1 ", "Length unit"]))
def test_other_units_are_refused(datasets, stage, units):
    for name in read_names(datasets[stage], stage):
        held = datasets[stage].variables[name]
        if units == held.attrs.get("units"):
            continue
        attrs = {**held.attrs, "units": units}
        damaged = with_variable(datasets[stage], name, held.dims, held.values, attrs)
        assert_refused(damaged, stage, name, "units")


def test_units_of_swept_and_shared_parameters_are_looked_at(datasets):
    curve = datasets["flow_curve"]
    for name in ("stress", "roughness", "wall_separation"):
        held = curve.variables[name]
        damaged = with_variable(curve, name, held.dims, held.values, {"units": "m"})
        assert_refused(damaged, "flow_curve", name, "units")


@pytest.mark.parametrize("stage", UNKNOWN)
@FEW
@given(data=st.data(), value=st.sampled_from([np.nan, np.inf, -np.inf]))
def test_what_must_be_known_and_finite_is(datasets, stage, data, value):
    dataset = datasets[stage]
    for name in read_names(dataset, stage):
        held = dataset.variables[name]
        if held.dtype.kind != "f":
            continue
        damaged = with_value(dataset, name, place_in(data, held.shape), value)
        if np.isnan(value) and name in UNKNOWN[stage]:
            check_dataset(damaged, stage)
        else:
            assert_refused(damaged, stage, name)


@pytest.mark.parametrize("name", ["normalised_velocity", "normalised_velocity_error"])
@FEW
@given(data=st.data(), value=st.sampled_from([np.nan, np.inf, -np.inf]))
def test_profiles_may_be_unknown_but_are_finite(datasets, name, data, value):
    dataset = datasets["profiles"]
    place = place_in(data, dataset.variables[name].shape)
    damaged = with_value(dataset, name, place, value)
    if np.isnan(value):
        check_dataset(damaged, "profiles")
    else:
        assert_refused(damaged, "profiles", name)


@pytest.mark.parametrize("stage", KNOWN)
@FEW
@given(data=st.data())
def test_what_was_measured_is_known_and_what_was_not_may_be_unknown(datasets, stage, data):
    dataset = datasets[stage]
    for name in read_names(dataset, stage):
        held = dataset.variables[name]
        if held.dtype.kind != "f" or name in GROWING.get(stage, ()):
            continue
        if name in KNOWN[stage]:
            assert np.isfinite(held.values).any(), f"the example knows nothing of {name}"
        place = place_in(data, held.shape)
        damaged = with_value(dataset, name, place, np.nan)
        if name in KNOWN[stage] and np.isfinite(held.values[place]):
            assert_refused(damaged, stage, name, "a number where")
        else:
            check_dataset(damaged, stage)


def test_infinite_means_are_refused(datasets):
    for stage, infinite in (
        (
            "flow_curve",
            ("_drift", "drift", "_drift_error", "total_slip_length_error", "_smoothing"),
        ),
        ("fits", ("_error", "covariance", "_interval", "_evidence")),
    ):
        for name in read_names(datasets[stage], stage):
            held = datasets[stage].variables[name]
            if held.dtype.kind != "f":
                continue
            damaged = with_values(datasets[stage], name, np.full(held.shape, np.inf))
            if name.endswith(infinite):
                check_dataset(damaged, stage)
            else:
                assert_refused(damaged, stage, name, "not finite")


@pytest.mark.parametrize("stage", POSITIVE)
@FEW
@given(data=st.data())
def test_what_must_be_positive_is(datasets, stage, data):
    for name in sorted(POSITIVE[stage]):
        held = datasets[stage].variables[name]
        value = data.draw(
            st.integers(-(2**62), 0)
            if held.dtype.kind == "i"
            else st.floats(max_value=0.0, allow_infinity=False)
        )
        damaged = with_value(datasets[stage], name, place_in(data, held.shape), value)
        assert_refused(damaged, stage, name)


@pytest.mark.parametrize(
    ("stage", "name"),
    [
        ("ageing", "area_deviation"),
        ("ageing", "film_thickness"),
        ("shear", "stress_deviation"),
        ("shear", "film_thickness"),
        ("flow_curve", "shear_rate_wall_error"),
        ("flow_curve", "shear_stress_error"),
        ("profiles", "normalised_velocity_error"),
        ("fits", "consistency"),
        ("fits", "pooled_flow_index_error"),
        ("fits", "points"),
    ],
)
def test_what_is_a_size_is_not_negative(datasets, stage, name):
    held = datasets[stage].variables[name]
    damaged = with_values(datasets[stage], name, np.full(held.shape, -1, dtype=held.dtype))
    assert_refused(damaged, stage, name, "at least 0")


@pytest.mark.parametrize("stage", GROWING)
@FEW
@given(data=st.data())
def test_what_must_grow_does(datasets, stage, data):
    for name in sorted(GROWING[stage]):
        values = datasets[stage].variables[name].values
        first = data.draw(st.integers(0, len(values) - 2))
        second = data.draw(st.integers(first + 1, len(values) - 1))
        swapped = values.copy()
        swapped[[first, second]] = swapped[[second, first]]
        assert_refused(with_values(datasets[stage], name, swapped), stage, name, "before it")
        repeated = values.copy()
        repeated[first + 1] = repeated[first]
        assert_refused(with_values(datasets[stage], name, repeated), stage, name, "before it")


@pytest.mark.parametrize("stage", ["expansion", "ageing", "shear"])
@FEW
@given(data=st.data())
def test_nodes_that_do_not_add_up_are_refused(datasets, stage, data):
    counts = datasets[stage]["nodes_per_particle"].values
    place = place_in(data, counts.shape)
    change = data.draw(st.integers(-2, 2**62).filter(bool))
    damaged = with_value(datasets[stage], "nodes_per_particle", place, counts[place] + change)
    assert "nodes_per_particle" in refused(damaged, stage)


@pytest.mark.parametrize("walls", [None, 0, -1, 2.5, True, "many", 10**30, 101])
def test_wall_nodes_that_do_not_add_up_are_refused(datasets, walls):
    damaged = datasets["shear"].assign_attrs(wall_nodes=walls)
    assert "wall_nodes" in refused(damaged, "shear")


@FEW
@given(data=st.data(), factor=st.sampled_from([0.5, 0.999, 1.001, 3.0]))
def test_records_that_do_not_touch_are_refused(datasets, data, factor):
    values = datasets["shear"]["interval"].values
    place = place_in(data, values.shape)
    damaged = with_value(datasets["shear"], "interval", place, factor * values[place])
    assert refused(damaged, "shear").startswith(f"interval[{place[0]}] is ")


@pytest.mark.parametrize(
    ("stage", "dim", "size"),
    [
        ("packing", "axis", 1),
        ("expansion", "axis", 1),
        ("ageing", "wall", 1),
        ("ageing", "wall_node", 0),
        ("shear", "time", 0),
        ("shear", "profile", 0),
        ("shear", "wall_distance", 1),
        ("shear", "field_x", 0),
        ("flow_curve", "stress", 0),
        ("creep", "time", 0),
        ("profiles", "normalised_position", 1),
        ("fits", "parameter", 2),
    ],
)
def test_dimensions_of_the_wrong_size_are_refused(datasets, stage, dim, size):
    message = refused(datasets[stage].isel({dim: slice(size)}), stage)
    assert f"{size} values along {dim}, not " in message, message


@pytest.mark.parametrize(
    ("stage", "name", "words"),
    [
        ("packing", "axis", ["y", "x"]),
        ("shear", "wall", ["upper", "lower"]),
        ("fits", "parameter", ["yield_stress", "flow_index", "consistency"]),
        ("flow_curve", "status", "doné"),
        ("creep", "status", ""),
    ],
)
def test_other_words_are_refused(datasets, stage, name, words):
    held = datasets[stage].variables[name]
    damaged = with_values(datasets[stage], name, np.broadcast_to(np.array(words), held.shape))
    assert_refused(damaged, stage, name)


@pytest.mark.parametrize("stage", TABLES[:-1])  # The comparison is of all roughnesses together.
def test_a_swept_value_that_is_twice_there_or_none_is_refused(datasets, stage):
    dataset = datasets[stage]
    for value, part in ((dataset["roughness"].values[1], "twice"), (np.nan, "not a number")):
        assert_refused(with_value(dataset, "roughness", 0, value), stage, "roughness", part)


@pytest.mark.parametrize(
    "encoding", [{"scale_factor": 2.0}, {"add_offset": 1.0}, {"_FillValue": 0.5}]
)
def test_values_that_were_changed_on_the_way_in_are_refused(datasets, tmp_path, encoding):
    """A file may ask its reader to scale numbers, or to leave some of them out."""
    written = datasets["packing"].drop_encoding()
    written.to_netcdf(tmp_path / "scaled.nc", encoding={"radius": encoding}, engine="netcdf4")
    read = xr.load_dataset(tmp_path / "scaled.nc", engine="netcdf4")
    assert_refused(read, "packing", "radius", "stored")


def test_names_and_units_of_any_signs_are_shown_in_one_short_line(datasets):
    nasty = "a\nb\x1b[31m\u202e" * 1000
    held = datasets["packing"].variables["radius"]
    damaged = with_variable(datasets["packing"], "radius", (nasty,), held.values, held.attrs)
    refused(damaged, "packing")
    attrs = {"units": nasty}
    refused(with_variable(datasets["packing"], "radius", held.dims, held.values, attrs), "packing")
    refused(datasets["flow_curve"].rename(roughness=nasty).drop_vars(nasty), "flow_curve")


def test_a_stage_without_a_schema_is_a_mistake_of_the_caller(datasets):
    with pytest.raises(KeyError):
        check_dataset(datasets["packing"], "baking")


def test_a_variable_that_may_be_infinite_may_be_so_either_way():
    """An interval without a lower end, of a quantity without a bound."""
    may = Variable(("end",), "1", infinite=True)
    ends = np.array([-np.inf, np.inf])
    assert not list(_value_faults("interval", ends, may))
    positive = Variable(("end",), "1", infinite=True, above=0.0)
    assert "above 0" in next(_value_faults("interval", ends, positive))
    finite = Variable(("end",), "1")
    assert "finite" in next(_value_faults("interval", ends, finite))
