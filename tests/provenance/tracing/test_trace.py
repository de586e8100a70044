"""A number leads back to the runs that it was computed from, and to no others."""

import json
import os
from collections import Counter
from itertools import pairwise
from pathlib import Path

import lineage_synthetic
import netCDF4
import numpy as np
import pytest
import xarray as xr
from hypothesis import assume, given
from hypothesis import strategies as st
from lineage_synthetic import CODE, Results
from matplotlib.patches import FancyBboxPatch

from softslip.analysis.figures.lineage import DiagramBox, _apart, _crossings, _ordered, lineage
from softslip.analysis.fits import finite_size, fit_laws
from softslip.config.stages import STAGES
from softslip.errors import ConfigError, DatasetError
from softslip.files.storage import read_dataset, write_dataset
from softslip.provenance import archive
from softslip.provenance.archive import FOUND, MISSING, REPLACED, UNREADABLE
from softslip.provenance.tracing import walk as module
from softslip.provenance.tracing.ancestry import Node, Trace
from softslip.provenance.tracing.contributions import fitted_parts, miscounted
from softslip.provenance.tracing.diagrams import MOST_BOXES, diagram
from softslip.provenance.tracing.fitted_laws import law_of
from softslip.provenance.tracing.origins import joint_provenance, swept_values
from softslip.provenance.tracing.targets import (
    SAME_NUMBER,
    Target,
    _nearest,
    find_values,
    read_target,
)
from softslip.provenance.tracing.walk import results_folder, trace
from softslip.provenance.tracing.wording import with_error


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return lineage_synthetic.some(tmp_path_factory.mktemp("made") / "results" / "demo")


@pytest.fixture
def results(made: Results, tmp_path: Path) -> Results:
    return made.copy(tmp_path / "results" / "demo")


def traced(results: Results, stage: str, variable: str = "", **at: object) -> Trace:
    words = {name: str(value) for name, value in at.items()}
    return trace(Target(results.path(stage), variable, words))


def runs(found: Trace, stage: str) -> set[str]:
    return {node.run for node in found.nodes if node.stage == stage}


def expected(results: Results, stage: str, *combinations: tuple[float, float, int]) -> set[str]:
    return {results.ids[each][stage] for each in combinations}


# What people write


@pytest.mark.parametrize(
    ("text", "variable", "at"),
    [
        ("a/fits.nc", "", {}),
        ("a/figure.svg", "", {}),
        ("a/fits.nc:yield_stress", "yield_stress", {}),
        ("a/fits.nc:yield_stress[]", "yield_stress", {}),
        ("a/b.nc:v[x=1e-3, seed = 2]", "v", {"x": "1e-3", "seed": "2"}),
        ("a:b/c.nc:v[kind=two words]", "v", {"kind": "two words"}),
    ],
)
def test_targets_are_read(text: str, variable: str, at: dict[str, str]) -> None:
    found = read_target(text)
    assert (found.variable, found.at) == (variable, at)
    assert str(found.path) == text.partition(":v")[0].partition(":y")[0]


@pytest.mark.parametrize(
    "text",
    ["", "fits", "fits.nc:", "a.nc:v[x=1", "a.nc:v]x=1[", "a.nc:v[x]", "a.nc:v[x=]", "a.png:v",
     "a.nc:v[x=1,x=2]", "a.nc:[x=1]"],
)  # fmt: skip
def test_what_is_no_target_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(ConfigError, match=r"^target: .+; .+") as error:
        read_target(text)
    assert "\n" not in str(error.value)


def test_a_file_of_any_name_is_that_file(tmp_path: Path) -> None:
    path = tmp_path / "odd.nc:name[x=1].nc"
    path.touch()
    assert read_target(str(path)) == Target(path)


# Coordinates


@given(st.lists(st.floats(-1e3, 1e3).filter(lambda each: abs(each) > 1e-3), min_size=1, max_size=8))
def test_a_value_is_found_by_the_six_digits_that_are_shown(values: list[float]) -> None:
    values = sorted(set(values))
    # Closer than twice the tolerance, six digits may be as near to another.
    near = pairwise(values)
    assume(all(b - a > 4 * SAME_NUMBER * max(abs(a), abs(b)) for a, b in near))
    for place, value in enumerate(values):
        assert _nearest(values, f"{value:g}") == place
        assert _nearest(values, repr(value)) == place
        assert _nearest(values, repr(value * (1 + 3 * SAME_NUMBER))) is None


def test_the_nearest_of_close_values_is_meant() -> None:
    values = [0.3, 0.3 * (1 + SAME_NUMBER / 2)]
    assert _nearest(values, "0.3") == 0
    assert _nearest(values, repr(values[1])) == 1


def test_whole_numbers_words_and_zero_are_exact() -> None:
    assert _nearest([1000001, 1000002], "1000003") is None
    assert _nearest([1000001, 1000002], "1000002.0") == 1
    assert _nearest([0.0, 1.0], "1e-12") is None
    assert _nearest([0.0, 1.0], "-0") == 0
    assert _nearest(["soft", "0.5"], "0.5") == 1
    assert _nearest(["soft"], "0.5") is None
    assert _nearest([0.0], "nan") is None


@pytest.mark.parametrize(
    ("variable", "at", "said"),
    [
        ("yield_stres", {}, "yield_stress, "),
        ("slip_velocity", {"rougness": "0"}, "it has stress, roughness, seed, wall_separation"),
        ("slip_velocity", {"roughness": "0.6"}, "it has 0, 0.59"),
        ("slip_velocity", {"seed": "three"}, "it has 1, 2"),
        ("slip_velocity", {"wall_separation": "0.2"}, "it has 0.125"),
    ],
)
def test_wrong_names_and_values_say_which_there_are(
    made: Results, variable: str, at: dict[str, str], said: str
) -> None:
    with pytest.raises(ConfigError) as error:
        find_values(Target(made.path("flow_curve"), variable, at))
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_what_all_runs_share_may_be_named(made: Results) -> None:
    at = {"wall_separation": "0.125", "roughness": "0"}
    assert find_values(Target(made.path("fits"), "yield_stress", at)).coordinates == {
        "roughness": 0.0
    }


def test_dimensions_without_values_go_by_number(results: Results) -> None:
    path = results.folder / "study.nc"
    table = xr.Dataset({"speed": (("profile", "y"), np.arange(6.0).reshape(3, 2))})
    results.write(table, path, stage="study", run="demo")
    found = find_values(Target(path, "speed", {"profile": "2"}))
    assert list(found.cells()) == [
        ({"profile": 2, "y": 0}, 4.0, None), ({"profile": 2, "y": 1}, 5.0, None)
    ]  # fmt: skip
    with pytest.raises(ConfigError, match="it has 0, 1, 2"):
        find_values(Target(path, "speed", {"profile": "3"}))


def test_values_come_with_errors_and_units(made: Results) -> None:
    curve = read_dataset(made.path("flow_curve"), stage="flow_curve")
    at = {"stress": "0.3", "roughness": "0"}
    found = find_values(Target(made.path("flow_curve"), "slip_velocity", at))
    cells = [(where["seed"], value, error) for where, value, error in found.cells()]
    here = curve.sel(stress=0.3, roughness=0.0)
    assert cells == [
        (seed, float(here["slip_velocity"].sel(seed=seed)),
         float(here["slip_velocity_error"].sel(seed=seed)))
        for seed in (1, 2)
    ]  # fmt: skip
    assert found.units == "length unit / time unit"


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.0553456, 0.00123, "0.0553 ± 0.0012"),
        (0.05, 0.00123, "0.0500 ± 0.0012"),
        (12.3456, 0.5, "12.35 ± 0.50"),
        (0.001, 0.5, "0.0010 ± 0.50"),
        (0.123456789, None, "0.123457"),
        (0.5, float("inf"), "0.5 ± inf"),
        (None, None, "unknown"),
        (True, None, "true"),
        ("done", None, "done"),
        (3, None, "3"),
    ],
)
def test_values_are_shown_to_two_digits_of_their_error(
    value: object, error: float | None, text: str
) -> None:
    assert with_error(value, error) == text


# Which runs


def test_a_cell_of_a_table_leads_to_its_runs_only(made: Results) -> None:
    found = traced(made, "flow_curve", "slip_velocity", roughness=0.59, stress=0.2)
    both = (0.2, 0.59, 1), (0.2, 0.59, 2)
    for stage in STAGES:
        assert runs(found, stage) == expected(made, stage, *both)
    assert not found.problems
    assert found.nodes[0].stage == "flow_curve"


def test_one_of_two_seeds_leads_to_one_run_of_each_stage(made: Results) -> None:
    found = traced(made, "flow_curve", "slip_velocity", roughness=0.59, stress=0.2, seed=2)
    assert Counter(node.stage for node in found.nodes) == dict.fromkeys((*STAGES, "flow_curve"), 1)


def test_a_missing_run_is_named_by_its_place(made: Results) -> None:
    found = traced(made, "flow_curve", "slip_velocity", roughness=0.59, stress=0.5)
    assert runs(found, "shear") == expected(made, "shear", (0.5, 0.59, 1))
    (left,) = [part for part in found.parts if part.left_out]
    assert (left.run, left.left_out) == ("", "missing")
    assert left.coordinates == {"stress": 0.5, "roughness": 0.59, "seed": 2}


def test_a_run_leads_to_its_own_stages(made: Results) -> None:
    at = (0.3, 0.0, 2)
    found = trace(Target(made.place("shear", *at)))
    assert [node.run for node in found.nodes] == [made.ids[at][each] for each in reversed(STAGES)]


def test_a_fit_leaves_out_what_is_not_steady_with_its_other_seeds(made: Results) -> None:
    found = traced(made, "fits", "yield_stress", roughness=0.59)
    told = {
        (part.coordinates["stress"], part.coordinates["seed"]): part.left_out
        for part in found.parts
    }
    assert told == {
        (0.2, 1): "", (0.2, 2): "",
        (0.3, 1): "not steady", (0.3, 2): "not steady with its other seeds",
        (0.5, 1): "", (0.5, 2): "missing",
        (1.0, 1): "", (1.0, 2): "",
    }  # fmt: skip
    entered = {key for key, reason in told.items() if not reason}
    assert runs(found, "shear") == expected(made, "shear", *((s, 0.59, n) for s, n in entered))


def known_curve() -> xr.Dataset:
    """A flow curve by known laws with two stresses below yield, and runs that no fit can use."""
    stress, dims = np.array([0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8]), ("stress", "roughness", "seed")
    shape = (len(stress), 2, 2)
    noise = np.random.default_rng(np.random.SeedSequence(7)).uniform(0.98, 1.02, (2, *shape))
    above = np.maximum(stress - 0.05, 0)[:, None, None]
    rate = np.where(above > 0, (above / 0.6) ** 2, 1e-3) * noise[0]
    # Only the smooth wall slips by a film.
    film = np.array([0.004, -0.004])[:, None] * stress[:, None, None]
    slip = np.where(above > 0, 0.02 * above, film) * noise[1]
    variables = {
        "shear_rate_bulk": rate,
        "shear_rate_bulk_error": 0.02 * np.abs(rate),
        "slip_velocity": slip,
        "slip_velocity_error": 0.02 * np.abs(slip),
        "shear_stress": np.broadcast_to(stress[:, None, None], shape).copy(),
        "steady_bulk": np.ones(shape, dtype=bool),
        "steady_slip": np.ones(shape, dtype=bool),
        "status": np.full(shape, "done"),
        "run_id": np.array([f"{each:016x}" for each in range(rate.size)], object).reshape(shape),
    }
    variables["steady_bulk"][5, 1, 0] = variables["steady_slip"][2, 1, 1] = False
    # Below yield the bulk creeps.
    variables["steady_bulk"][:2] = False
    for name in ("heterogeneity", "yielding_time", "slip_time"):
        variables[name] = variables[f"{name}_error"] = np.full(shape, np.nan)
    # Of two seeds one has no rate: the mean is that of the other.
    variables["shear_rate_bulk"][3, 0, 1] = variables["shear_rate_bulk_error"][3, 0, 1] = np.nan
    variables["status"][3, 1, 0], variables["run_id"][3, 1, 0] = "missing", ""
    for name in ("shear_rate_bulk", "slip_velocity"):
        variables[name][3, 1, 0] = variables[f"{name}_error"][3, 1, 0] = np.nan
    coords = {"stress": stress, "roughness": [0.0, 0.59], "seed": [1, 2]}
    return xr.Dataset({name: (dims, each) for name, each in variables.items()}, coords)


def test_exactly_the_runs_that_entered_change_a_fit() -> None:
    curve = known_curve()
    fits = fit_laws(curve)
    wanted = [
        *((name, {"roughness": place})
          for name in ("yield_stress", "slip_coefficient", "newtonian_slip_coefficient")
          for place in (0, 1)),
        ("pooled_yield_stress", {}),
        ("joint_yield_stress", {}),
    ]  # fmt: skip
    parts = [fitted_parts(fits, curve, name, at) for name, at in wanted]
    used = [{part.run for part in each if not part.left_out} for each in parts]
    reasons = {part.left_out for each in parts for part in each}
    assert reasons == {
        "", "missing", "not known", "not steady",
        "not steady with its other seeds", "not above the yield stress",
        "not below the yield stress", "not at the smoothest wall",
    }  # fmt: skip
    # One run stands for all that are treated alike everywhere.
    treated = {
        tuple(sorted((number, part.of, part.left_out) for number, each in enumerate(parts)
                     for part in each if part.run == run)): (place, run)
        for place, run in np.ndenumerate(curve["run_id"].values) if run
    }  # fmt: skip
    assert len(treated) > len(reasons)
    for place, run in treated.values():
        changed = curve.copy(deep=True)
        for name in ("shear_rate_bulk", "slip_velocity"):
            changed[name].values[place] *= 1.05
        after = fit_laws(changed)
        for (name, at), each, runs_used in zip(wanted, parts, used, strict=True):
            before, now = fits[name].isel(at).item(), after[name].isel(at).item()
            assert np.isfinite(before), name
            # Below yield only the side of the points goes by the yield stress, which is not felt
            # as long as none changes sides.
            own = {part.run for part in each if part.of == "slip_velocity" and not part.left_out}
            expected = own if name.startswith("newtonian") else runs_used
            assert (before != now) == (run in expected), (name, at, run)


def test_the_slip_law_goes_by_the_pooled_yield_stress_too(made: Results) -> None:
    found = traced(made, "fits", "slip_coefficient", roughness=0.0)
    used = {series: {p.run for p in found.parts if p.of == series and not p.left_out}
            for series in ("slip_velocity", "shear_rate_bulk")}  # fmt: skip
    smooth = [(stress, 0.0, seed) for stress in made.stresses for seed in made.seeds]
    assert used["slip_velocity"] == expected(made, "shear", *smooth)
    pooled = traced(made, "fits", "pooled_yield_stress")
    assert used["shear_rate_bulk"] == runs(pooled, "shear")
    assert runs(found, "shear") == runs(pooled, "shear") | used["slip_velocity"]


def test_the_law_over_wall_separations_goes_by_the_apparent_rates_at_one_stress() -> None:
    height, shape = np.array([0.1, 0.2, 0.3, 0.4]), (2, 4)
    rate = np.array([[0.1], [0.3]]) + 0.02 / height
    dims = ("stress", "wall_separation")
    variables = {name: (dims, value * np.ones(shape)) for name, value in (
        ("shear_rate_wall", rate), ("shear_rate_wall_error", 0.01 * rate),
        ("shear_rate_bulk", 0.1), ("shear_rate_bulk_error", 1e-3),
        ("slip_velocity", 0.01), ("slip_velocity_error", 1e-4),
    )}  # fmt: skip
    steady = np.ones(shape, dtype=bool)
    steady[1, 2] = False
    flags = {name: (dims, steady) for name in ("steady_wall", "steady_bulk", "steady_slip")}
    names = np.array([[f"{row}{column}" for column in range(4)] for row in range(2)], dtype=object)
    words = {"run_id": (dims, names), "status": (dims, np.full(shape, "done"))}
    coords = {"stress": [0.1, 0.3], "wall_separation": height}
    curve = xr.Dataset(variables | flags | words, coords)
    fits, name = finite_size(curve), "mooney_shear_rate_bulk"
    parts = fitted_parts(fits, curve, name, {"stress": 1})
    assert {part.of for part in parts} == {"shear_rate_wall"}
    assert {part.run: part.left_out for part in parts} == {
        "10": "", "11": "", "12": "not steady", "13": "",
    }  # fmt: skip
    assert fits["mooney_slip_velocity_points"].values.tolist() == [4, 3]
    assert not miscounted(fits, curve, name, {"stress": 1})
    assert miscounted(fits, curve.assign(steady_wall=curve["stress"] > 0.2), name, {})
    alone = curve.isel(wall_separation=0)
    fits = finite_size(alone)
    (part,) = fitted_parts(fits, alone, name, {"stress": 1})
    assert part.left_out == "one wall separation only: sweep channel.height"
    assert not miscounted(fits, alone, name, {})


def test_every_outcome_of_the_fits_is_known_to_come_from_one(made: Results) -> None:
    with xr.open_dataset(made.path("fits")) as fits:
        for name in fits.data_vars:
            law = law_of(str(name))
            assert law is not None, name
            assert {law.points, law.message} <= set(fits.data_vars)


def test_points_that_other_code_has_fitted_are_a_problem(results: Results) -> None:
    results.fit(results.curve, points=[4, 4])
    assert not traced(results, "fits", "yield_stress", roughness=0).problems
    ((node, sentence),) = traced(results, "fits", "yield_stress", roughness=0.59).problems
    assert "points is 4 where the flow curve has 3 usable points" in sentence
    assert node == traced(results, "fits").nodes[0].id


def test_a_variable_is_found_in_what_was_made_from_its_dataset(made: Results) -> None:
    direct = traced(made, "fits", "yield_stress", roughness=0)
    named = traced(made, "flow_curve", "yield_stress", roughness=0)
    assert named.nodes == direct.nodes
    assert named.values.product.path == made.path("fits")
    assert named.values.asked == made.path("flow_curve")


def test_it_is_not_found_in_what_was_made_from_another(results: Results) -> None:
    curve = results.curve.assign(drift=results.curve["drift"] + 1)
    write_dataset(curve, results.path("flow_curve"), stage="flow_curve", run="demo", title="new")
    with netCDF4.Dataset(results.path("flow_curve"), "a") as file:
        assert "parents" not in file.ncattrs()
    with pytest.raises(ConfigError, match="neither in"):
        traced(results, "flow_curve", "yield_stress", roughness=0)


# What is there


def test_a_figure_leads_to_everything_behind_it(made: Results) -> None:
    found = trace(Target(made.folder / "figures" / "fig5.png"))
    done = [at for at in made.ids if at not in made.missing]
    for stage in STAGES:
        assert runs(found, stage) == expected(made, stage, *done)
    assert [node.stage for node in found.nodes[:3]] == ["figure", "flow_curve", "fits"]
    # Both datasets of the figure and the curve of the fits; each run of the curve and its ageing;
    # from the four ageings back to the packings.
    assert len(found.edges) == 3 + 2 * len(done) + 2 * 4
    assert [group.stage for group in found.groups] == [
        "figure", "fits", "flow_curve", *reversed(STAGES)
    ]  # fmt: skip
    assert [group.behind for group in found.groups] == [None, 0, 1, 2, 3, 4, 5]
    assert not found.problems


def test_each_file_is_read_once(made: Results, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[Path] = []
    original = module.read_product
    for place in (module, archive):
        monkeypatch.setattr(place, "read_product", lambda path: read.append(path) or original(path))
    found = trace(Target(made.folder / "figures" / "fig5.png"))
    assert len(read) == len(set(read)) == len(found.nodes)


def test_the_same_results_give_the_same_trace(made: Results) -> None:
    target = Target(made.folder / "figures" / "fig5.png")
    first, second = trace(target), trace(target)
    assert (first.nodes, first.edges) == (second.nodes, second.edges)


def damaged(results: Results, state: str) -> tuple[Trace, str]:
    """Return the trace of a figure after one ageing was lost, and that ageing's run."""
    at = (0.2, 0.0, 1)
    path = results.place("ageing", *at)
    if state == MISSING:
        path.unlink()
    elif state == UNREADABLE:
        path.write_bytes(b"nothing")
    else:
        with xr.load_dataset(path) as before:
            other = before.assign(radius=before["radius"] + 1)
        write_dataset(other, path, stage="ageing", run=path.stem, title="other")
    return trace(Target(results.folder / "figures" / "fig5.png")), path.stem


@pytest.mark.parametrize("state", [MISSING, REPLACED, UNREADABLE])
def test_what_is_gone_is_shown_and_a_problem(results: Results, state: str) -> None:
    found, run = damaged(results, state)
    (node,) = [node for node in found.nodes if node.state != FOUND]
    assert (node.stage, node.run, node.state, node.product) == ("ageing", run, state, None)
    ((where, sentence),) = found.problems
    assert where == node.id
    assert f"was made from ageing {run}, but {node.path}" in sentence
    # Of what has taken its place nothing is said: it is not what was used.
    assert not [parent for child, parent in found.edges if child == node.id]
    shears = expected(results, "shear", *((s, 0.0, 1) for s in results.stresses))
    names = {each.id: each.run for each in found.nodes}
    assert {names[child] for child, parent in found.edges if parent == node.id} == shears


def test_a_dataset_under_another_name_is_found_by_its_content(results: Results) -> None:
    results.path("flow_curve").rename(results.folder / "curve of may.nc")
    run = results.place("shear", 0.2, 0.0)
    (results.folder / "old").mkdir()
    run.rename(results.folder / "old" / run.name)
    found = traced(results, "fits", "yield_stress", roughness=0)
    assert not found.problems
    paths = {node.path.relative_to(results.folder) for node in found.nodes}
    assert {Path("curve of may.nc"), Path("old") / run.name} <= paths


def test_the_same_content_made_again_is_remarked(results: Results) -> None:
    path = results.place("packing", 0.2, 0.0)
    before = xr.load_dataset(path)
    labels = {"stage": "packing", "run": path.stem}
    results.write(before, path, **labels, seed=1, core_seconds=5.0)
    found = traced(results, "flow_curve", "slip_velocity", roughness=0, stress=0.2, seed=1)
    assert not found.problems
    assert [node.stage for node in found.nodes if node.remade] == ["packing"]


def test_runs_that_a_table_does_not_list_as_parents_are_a_problem(results: Results) -> None:
    curve = results.curve.copy(deep=True)
    curve["run_id"][0, 0, 0] = "f" * 16
    parents = [results.place("shear", *at) for at in results.ids if at not in results.missing]
    path = results.path("flow_curve")
    results.write(curve, path, *parents, stage="flow_curve", run="demo")
    found = traced(results, "flow_curve", "slip_velocity", stress=0.2, roughness=0, seed=1)
    assert [sentence for _, sentence in found.problems] == [
        f"shear {'f' * 16}: is in the table, but not among what it was made from; "
        "rerun its gathering"
    ]


def test_a_table_without_runs_is_refused(results: Results) -> None:
    curve = results.curve.drop_vars("run_id")
    results.write(curve, results.path("flow_curve"), stage="flow_curve", run="demo")
    results.fit(curve)
    found = traced(results, "fits", "yield_stress", roughness=0)
    assert found.parts is None
    assert any("run_id" in sentence for _, sentence in found.problems)


def test_an_altered_target_is_a_problem(results: Results) -> None:
    figure = results.folder / "figures" / "fig5.png"
    figure.write_bytes(figure.read_bytes() + b"\0")
    ((_, sentence),) = trace(Target(figure)).problems
    assert "altered" in sentence
    with netCDF4.Dataset(results.path("fits"), "a") as file:
        file["yield_stress"][:] = 1.0
    assert "does not fit" in traced(results, "fits").problems[0][1]
    with pytest.raises(DatasetError, match="does not fit"):
        traced(results, "fits", "yield_stress", roughness=0)


def test_what_claims_to_be_made_from_itself_is_refused(results: Results) -> None:
    packing, shear = results.place("packing", 0.2, 0.0), results.place("shear", 0.2, 0.0)
    with netCDF4.Dataset(shear) as file:
        keys = ("stage", "run", "content_sha256")
        parent = {key: file.getncattr(key) for key in keys}
    with netCDF4.Dataset(packing, "a") as file:
        file.parents = json.dumps([parent])
    with pytest.raises(DatasetError, match="made from themselves"):
        _ = trace(Target(results.place("ageing", 0.2, 0.0))).depths


def test_the_folder_of_results_is_found_from_any_file_in_it(
    made: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for path in (made.path("fits"), made.place("shear", 0.2, 0.0), made.folder / "figures" / "x"):
        assert results_folder(path) == made.folder
    assert results_folder(tmp_path / "x.nc") == tmp_path
    monkeypatch.chdir(made.folder / "shear")
    assert results_folder(Path("x.nc")) == made.folder
    monkeypatch.chdir(made.folder.parent)
    assert results_folder(Path("demo/fits.nc")) == Path("demo")


# All together


def test_origins_are_put_together(made: Results) -> None:
    found = traced(made, "flow_curve", "slip_velocity", roughness=0.59, stress=0.2)
    runs_only = [product for product in found.products if product.stage in STAGES]
    origin = joint_provenance(runs_only)
    assert (origin.count, origin.seeds, origin.restarts) == (8, (1, 2), 8)
    assert origin.core_seconds == pytest.approx(8000.0)
    assert origin.fingerprints == (CODE,)
    assert origin.hosts == (os.uname().nodename,)
    assert origin.started == min(product.provenance["started"] for product in runs_only)


def test_runs_are_told_apart_with_and_without_a_scenario(made: Results) -> None:
    found = traced(made, "flow_curve", "slip_velocity", roughness=0.59)
    at = (0.2, 0.59, 2)
    node = {each.run: each for each in found.nodes}
    shear = found.swept[node[made.ids[at]["shear"]].id]
    assert dict(shear) == {"stress": 0.2, "roughness": 0.59, "seed": 2}
    ageing = found.swept[node[made.ids[at]["ageing"]].id]
    assert dict(ageing) == {"roughness": 0.59, "seed": 2}
    bare = [each for each in found.products if each.stage == "shear"]
    assert {"stress": 0.2, "seed": 2} in swept_values(bare)


# Drawn


def scattered(shears: int) -> Trace:
    """A trace of many runs of ten packings, none of which is there."""

    def node(stage: str, number: int) -> Node:
        identity = f"{stage}{number}"
        return Node(identity, stage, identity, Path(identity), MISSING, None, False)

    root = Node("root", "flow_curve", "demo", Path("flow_curve.nc"), FOUND, None, False)
    nodes = [node("shear", each) for each in range(shears)]
    packings = [node("packing", each) for each in range(10)]
    edges = [("root", each.id) for each in nodes]
    edges += [(each.id, f"packing{number % 10}") for number, each in enumerate(nodes)]
    return Trace(
        Target(Path("flow_curve.nc")), Path(), None, None, (root, *nodes, *packings),
        tuple(edges), (),
    )  # fmt: skip


def test_as_many_runs_as_can_be_read_are_drawn_and_more_are_bundled() -> None:
    most = diagram(scattered(MOST_BOXES - 11))
    assert len(most.boxes) == MOST_BOXES
    assert not any(box.several for box in most.boxes)
    more = diagram(scattered(MOST_BOXES - 10))
    assert len(more.boxes) == 12
    (bundle,) = [box for box in more.boxes if box.several]
    assert bundle.title == "50 runs"
    assert len(more.arrows) == 11
    assert more.headings[1].startswith("50 × shear")


def test_boxes_keep_apart_and_hold_their_texts(made: Results) -> None:
    found = diagram(trace(Target(made.folder / "figures" / "fig5.png")))
    figure = lineage(found.boxes, found.arrows, found.headings, found.notes)
    figure.canvas.draw()
    boxes = [p.get_window_extent() for p in figure.axes[0].patches if isinstance(p, FancyBboxPatch)]
    assert len(boxes) == len(found.boxes)
    for number, one in enumerate(boxes):
        assert not any(one.overlaps(other) for other in boxes[:number])
    texts = {text.get_text(): text.get_window_extent() for text in figure.axes[0].texts}
    for box in found.boxes:
        extent = texts[box.title]
        holders = [one for one in boxes if one.x0 < extent.x0 and extent.x1 < one.x1
                   and one.y0 <= extent.y0 and extent.y1 <= one.y1]  # fmt: skip
        assert len(holders) == 1, box.title
    page = figure.bbox
    assert all(page.x0 <= e.x0 and e.x1 <= page.x1 and page.y0 <= e.y0 and e.y1 <= page.y1
               for e in texts.values() if e.width)  # fmt: skip


def test_arrows_of_a_tree_do_not_cross() -> None:
    boxes = [DiagramBox(0, f"{each}", order=(each,)) for each in range(4)]
    boxes += [DiagramBox(1, f"{each}", order=(each % 3, each)) for each in range(12)]
    boxes.append(DiagramBox(2, "all"))
    arrows = [(each % 4, 4 + each) for each in range(12)] + [(4 + each, 16) for each in range(12)]
    columns, ways = _ordered(boxes, arrows)
    assert _crossings(columns, [(way[0], way[1]) for way in ways]) == 0


@given(st.lists(st.floats(-10, 10), min_size=1, max_size=12))
def test_positions_are_apart_and_near_what_is_wanted(wanted: list[float]) -> None:
    found = _apart(np.array(wanted), 0.5)
    assert (np.diff(found) >= 0.5 - 1e-9).all()
    # Least squares moves the centre of none.
    assert found.mean() == pytest.approx(np.mean(wanted), abs=1e-9)
    spread = np.sort(wanted)
    if (np.diff(spread) >= 0.5).all():
        np.testing.assert_allclose(_apart(spread, 0.5), spread, atol=1e-12)
