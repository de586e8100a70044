"""Results that are asked for, on made-up files with true labels, and on records of a real run."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scenes
import xarray as xr

import softslip
from softslip.analysis.observables.tables import flow_curve
from softslip.config.fields import all_fields
from softslip.config.parameters import Parameters
from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES, stage_ids, stage_parameters
from softslip.errors import ConfigError, DatasetError
from softslip.files.storage import RECORD_DIGEST, read_dataset, write_dataset
from softslip.provenance.attribution import Job
from softslip.provenance.catalogue.opening import open_results, scenario_results
from softslip.provenance.catalogue.runs import BY_BEGINNING
from softslip.provenance.fingerprints import ENTRIES, modules_of

ROUGHNESSES, STRESSES = (0.0, 0.59), (0.1, 0.3, 0.5)

SCENARIO = """
description: Six runs of two packings.
base:
  channel: {length: 0.0625, height: 0.109375, outer_gap: 0.015625}
  hydrodynamics: {resolution: 2048}
axes:
  wall.roughness: [0.0, 0.59]
  rheometer.stress: [0.1, 0.3, 0.5]
"""


def given(roughness, stress):
    return scenes.parameters(wall={"roughness": roughness}, rheometer={"stress": stress})


def write_run(folder, parameters, stage="shear", records=None, restarts=0):
    """Write what a stage of a run leaves, and return its name."""
    run = stage_ids(parameters)[stage]
    labels = Job().labels([], fingerprint="f" * 16, seed=1, restarts=restarts, core_seconds=2.5)
    dataset = (xr.Dataset({"x": ("y", [1.0])}) if records is None else records).assign_attrs(
        parameters=stage_parameters(parameters, stage), parent="ab" * 8, **labels
    )
    write_dataset(dataset, folder / stage / f"{run}.nc", stage=stage, run=run, title="x")
    return run


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results") / "desk"
    for roughness in ROUGHNESSES:
        for number, stress in enumerate(STRESSES):
            write_run(folder, given(roughness, stress), restarts=number)
        for stage in STAGES[:-1]:
            write_run(folder, given(roughness, 0.5), stage)
    return folder


@pytest.fixture
def results(desk):
    return open_results(desk)


@pytest.fixture
def copied(desk, tmp_path):
    return Path(shutil.copytree(desk, tmp_path / "copy"))


def stresses(results):
    return results.table(["roughness", "stress"]).values.tolist()


def test_the_folder_alone_tells_what_was_swept(results):
    assert results.swept == {"roughness": "wall.roughness", "stress": "rheometer.stress"}
    assert len(results) == 6
    assert stresses(results) == [[b, s] for b in ROUGHNESSES for s in STRESSES]
    assert results.unreadable == ()


def test_the_table_lists_run_swept_values_and_state(results):
    table = results.runs
    assert list(table.columns[:4]) == ["run", "state", "roughness", "stress"]
    assert {"wall_separation", "seed", "core_seconds", "restarts", "host"} <= set(table.columns)
    assert "imposed_shear_rate" not in table.columns, "a column without any value"
    assert set(table["state"]) == {"done"}
    assert table["roughness"].dtype == np.float64
    assert table["run"].tolist() == [run.run for run in results]
    pd.testing.assert_frame_equal(table, results.table())


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("roughness == 0.59", [[0.59, stress] for stress in STRESSES]),
        ("roughness==0 and stress>0.1", [[0.0, 0.3], [0.0, 0.5]]),
        ("wall.roughness == 0 and rheometer.stress <= 0.1", [[0.0, 0.1]]),
        ("stress in (0.1, 0.5) and not roughness", None),
        ("restarts > 1", [[0.0, 0.5], [0.59, 0.5]]),
        ("core_seconds == 2.5 and stress == 0.3", [[0.0, 0.3], [0.59, 0.3]]),
        ("host == 'nowhere'", []),
        ("fingerprint == 'ffff' and 0.1 < stress < 0.5 and roughness == 0", [[0.0, 0.3]]),
        (
            "channel.height == 0.109375 and wall_separation == height and stress < 0.2",
            [[0.0, 0.1], [0.59, 0.1]],
        ),
        ("started > '2020' and ended < '2100' and stress == 0.1 and roughness == 0", [[0.0, 0.1]]),
        (
            "imposed_shear_rate == None and shear_rate == None and stress == 0.1",
            [[0.0, 0.1], [0.59, 0.1]],
        ),
        ("stress == 0.30000000000000004", []),
    ],
)
def test_queries_choose_runs(results, text, wanted):
    if wanted is None:
        with pytest.raises(ConfigError, match="stands alone and is not a flag"):
            results.query(text)
    else:
        assert stresses(results.query(text)) == wanted


def test_narrowing_twice_is_narrowing_by_both(results):
    twice = results.query("roughness == 0").query("stress > 0.1")
    assert stresses(twice) == stresses(results.query("roughness == 0 and stress > 0.1"))
    assert len(results) == 6, "the results that were narrowed are as they were"
    assert repr(twice).endswith("desk: 2 runs, (roughness == 0) and (stress > 0.1)>")


def test_other_stages_are_meant_where_they_are_named(results):
    packings = results.query("stage == 'packing' and roughness == 0.59")
    assert [run.stage for run in packings] == ["packing"]
    assert len(results.query("stage in ('packing', 'ageing')")) == 4
    assert len(results.query("stage != 'shear'")) == 6
    assert len(results.query("roughness == 0").query("stage == 'ageing'")) == 1
    # A packing knows of no stress, so that nothing about it is true.
    assert len(results.query("stage == 'packing' and stress != 0.1")) == 0


def test_runs_and_digests_are_found_by_their_beginning(results):
    run = results.runs["run"][3]
    for text in (f"run == {run!r}", f"run == {run[:7]!r}", f"run in ('zz', {run[:8]!r})"):
        assert [each.run for each in results.query(text)] == [run]
    assert len(results.query(f"run != {run[:7]!r}")) == 5
    assert results.find(run[:7]).run == run
    with pytest.raises(ConfigError, match="is the beginning of 0 of the 6 runs"):
        results.find("")
    assert set(results.names) >= BY_BEGINNING


def test_every_parameter_has_its_name(results):
    fields = all_fields(Parameters)
    assert set(fields) <= set(results.names)
    leaves = [path.rpartition(".")[2] for path in fields]
    for path, leaf in zip(fields, leaves, strict=True):
        if leaves.count(leaf) == 1:
            assert leaf in results.names, path


def test_what_is_ambiguous_is_refused_with_the_choice(results):
    leaves = [path.rpartition(".")[2] for path in all_fields(Parameters)]
    shared = next(leaf for leaf in leaves if leaves.count(leaf) > 1 and leaf not in results.names)
    paths = [path for path in all_fields(Parameters) if path.endswith(f".{shared}")]
    with pytest.raises(ConfigError, match=f"last part of several .*write one of {paths[0]}"):
        results.query(f"{shared} == 1")


@pytest.mark.parametrize("column", ["rn", "", "run == 1 or stress", "open('x')", "__class__"])
def test_a_column_is_a_name(results, column):
    with pytest.raises(ConfigError) as refused:
        results.table(["run", column])
    assert "\n" not in str(refused.value)


def test_the_axes_of_a_table_are_dimensions_though_they_have_one_value(copied):
    for path in (copied / "shear").glob("*.nc"):
        if json.loads(read_dataset_attributes(path)["parameters"])["wall"]["roughness"]:
            path.unlink()
    assert open_results(copied).swept == {"stress": "rheometer.stress"}
    axes = {"base": {}, "axes": {"wall.roughness": [0.0, 0.59], "fidelity": ["paper"]}}
    table = xr.Dataset({"x": ("y", [1.0])}, attrs={"parameters": json.dumps(axes)})
    write_dataset(table, copied / "flow_curve.nc", stage="flow_curve", run="desk", title="x")
    assert list(open_results(copied).swept) == ["roughness", "stress"]


def read_dataset_attributes(path):
    with xr.open_dataset(path) as dataset:
        return dataset.attrs


def test_files_that_cannot_be_told_are_left_out_and_named(copied):
    first, second, third = sorted((copied / "shear").glob("*.nc"))[:3]
    first.write_bytes(b"broken")
    bare = xr.load_dataset(second)
    del bare.attrs["content_sha256"]
    bare.to_netcdf(second)
    odd = xr.load_dataset(third).assign_attrs(parameters="[1, 2]")
    odd.to_netcdf(third)
    (copied / "shear" / ".hidden.nc").write_text("x")
    results = open_results(copied)
    assert len(results) == 3
    told = "\n".join(results.unreadable)
    assert len(results.unreadable) == 3
    assert f"{first.name}: cannot be read" in told
    assert f"{second.name}: has no content_sha256" in told
    assert f"{third.name}: parameters is no JSON object" in told


def test_a_second_file_of_a_run_counts_only_if_it_is_another(copied):
    one = next((copied / "shear").glob("*.nc"))
    shutil.copy(one, copied / "shear" / "copy.nc")
    assert len(open_results(copied)) == 6
    assert open_results(copied).unreadable == ()
    run = xr.load_dataset(one)
    other = run.assign(x=run["x"] + 1.0)
    write_dataset(other, copied / "twin.nc", stage="shear", run=run.attrs["run"], title="x")
    results = open_results(copied)
    assert len(results) == 6
    assert "differs from" in results.unreadable[0]


@pytest.mark.parametrize("name", ["nowhere", "empty"])
def test_a_folder_without_runs_is_refused(tmp_path, name):
    (tmp_path / "empty").mkdir()
    with pytest.raises(DatasetError, match=r"(is no folder|holds no run); give .*results/demo"):
        open_results(tmp_path / name)


def test_records_are_checked_when_they_are_read(copied):
    results = open_results(copied)
    run = next(iter(results))
    with pytest.raises(DatasetError, match="time"):
        results.records(run)  # These files have labels, but no records.
    run.path.unlink()
    with pytest.raises(DatasetError, match="does not exist"):
        results.records(run.run)


@pytest.fixture(scope="module")
def real(tmp_path_factory, sheared):
    """A folder with true records, the same under three stresses."""
    folder = tmp_path_factory.mktemp("real")
    for stress in STRESSES:
        write_run(folder, given(0.0, stress), records=sheared)
    return folder


def test_datasets_are_those_of_the_observables(real):
    results = open_results(real)
    chosen = results.query("stress > 0.1")
    dataset = chosen.dataset()
    assert dataset["stress"].values.tolist() == [0.3, 0.5]
    wanted = flow_curve(
        [
            ({"stress": run.parameters["rheometer.stress"]}, results.records(run))
            for run in results
            if run.parameters["rheometer.stress"] > 0.1
        ]
    )
    xr.testing.assert_identical(dataset, wanted)
    assert dataset["run_id"].values.tolist() == [run.run for run in chosen]
    for table, dim in (("creep", "time"), ("profiles", "normalised_position")):
        assert {"stress", dim} <= set(results.dataset(table).dims)


def test_the_labels_of_parents_come_with_a_dataset(real):
    chosen = open_results(real).query("stress > 0.1")
    _, parents = chosen.gathered()
    records = [read_dataset(run.path, stage="shear").attrs[RECORD_DIGEST] for run in chosen]
    assert [each.attrs[RECORD_DIGEST] for each in parents] == records
    told = json.loads(chosen.as_json())
    assert told["axes"] == {"rheometer.stress": [0.3, 0.5]}
    assert told["base"]["wall"]["roughness"] == 0.0
    assert "stress" not in told["base"]["rheometer"]
    assert told["query"] == ["stress > 0.1"]


def test_datasets_that_cannot_be_made_are_refused(real, results):
    with pytest.raises(DatasetError, match="none of the runs was chosen"):
        open_results(real).query("stress > 9").dataset()
    with pytest.raises(ConfigError, match="use one of flow_curve, creep, profiles"):
        open_results(real).dataset("fits")
    with pytest.raises(ConfigError, match="choose runs of stage shear"):
        results.query("stage == 'packing'").dataset()


def test_a_scenario_has_runs_that_are_not_done(tmp_path):
    path = tmp_path / "six.yaml"
    path.write_text(SCENARIO)
    scenario = load_scenario(str(path))
    folder = tmp_path / "results"
    runs = scenario.runs()
    done = write_run(folder, runs[1].parameters)
    damaged = folder / "shear" / f"{runs[2].ids['shear']}.nc"
    damaged.write_bytes(b"broken")
    states = {(stage, run.ids[stage]): "missing" for run in runs for stage in STAGES}
    states |= {("shear", done): "done", ("shear", damaged.stem): "done"}
    states["shear", runs[3].ids["shear"]] = "stopped"
    results = scenario_results(scenario, folder, states)
    table = results.table(["run", "state", "roughness", "stress", "restarts"])
    assert table["state"].tolist() == ["missing", "done", "stopped", "missing", "missing"]
    assert table["run"][1] == done
    assert table["restarts"].isna().tolist() == [True, False, True, True, True]
    assert len(results.query("state != 'done' and roughness == 0.59")) == 3
    assert len(results.query("restarts >= 0")) == 1
    assert "cannot be read" in results.unreadable[0]


def test_a_file_under_the_name_of_another_run_is_no_result_of_a_scenario(tmp_path):
    path = tmp_path / "six.yaml"
    path.write_text(SCENARIO)
    scenario = load_scenario(str(path))
    first, second = scenario.runs()[:2]
    write_run(tmp_path, first.parameters)
    source, place = (tmp_path / "shear" / f"{run.ids['shear']}.nc" for run in (first, second))
    source.rename(place)
    states = {(stage, run.ids[stage]): "missing" for run in scenario.runs() for stage in STAGES}
    states["shear", second.ids["shear"]] = "done"
    results = scenario_results(scenario, tmp_path, states)
    assert f"is of run '{first.ids['shear']}', not" in results.unreadable[0]
    assert len(results) == 5


CHEAP = """
import sys
before = set(sys.modules)
import softslip
print(*sorted(set(sys.modules) - before))
assert softslip.open_results.__name__ == "open_results"
from softslip import open_results
try:
    softslip.nothing
except AttributeError as error:
    assert "nothing" in str(error)
"""


def test_the_package_imports_nothing_until_it_is_asked():
    settings = {**os.environ, "PYTHONPATH": str(Path(softslip.__file__).parents[1])}
    said = subprocess.run(
        [sys.executable, "-c", CHEAP], capture_output=True, text=True, env=settings, check=False
    )
    assert said.returncode == 0, said.stderr
    assert said.stdout.split() == ["softslip"]


@pytest.mark.parametrize("stage", ENTRIES)
def test_no_fingerprint_depends_on_how_results_are_asked_for(stage):
    modules = modules_of(stage)
    assert any(name.startswith("softslip.") for name in modules)
    assert not [name for name in modules if name.startswith("softslip.provenance.catalogue")]


def test_open_results_is_the_packages(desk):
    assert len(softslip.open_results(str(desk)).query("stress > 0.1")) == 4
