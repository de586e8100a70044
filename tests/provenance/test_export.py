"""Tables for those who plot elsewhere: what is read from them is what the figure or dataset has."""

import csv
import io
import json
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from synthetic import shear_run, sweep
from typer.testing import CliRunner

from softslip.analysis import figures
from softslip.analysis.figures import membranes
from softslip.analysis.figures.shown import Quantity, Series, shown
from softslip.analysis.fits import fit_laws
from softslip.analysis.observables.tables import creep, flow_curve
from softslip.cli import app
from softslip.errors import DatasetError, StorageError
from softslip.files.layout import FIGURE
from softslip.files.storage import read_dataset, write_dataset
from softslip.provenance.attribution import Job, parents_of
from softslip.provenance.export import (
    Table,
    cells,
    dataset_table,
    figure_table,
    save_csv,
    target_table,
    write_csv,
)
from softslip.provenance.export import csv_file as module
from softslip.provenance.export.numbers import SINGLE


def put(dataset, path, stage, parents=()):
    """Write a dataset of a scenario with its labels, and return it as it is read."""
    labels = Job().labels(parents, fingerprint="f" * 16)
    told = dataset.assign_attrs(parameters="{}", **labels)
    write_dataset(told, path, stage=stage, run="desk", title=stage)
    return read_dataset(path, stage=stage)


def draw(name, path, *datasets):
    """Draw a figure as the command does, and return it."""
    figure = figures.draw(name, *datasets)
    labels = {
        "title": name,
        "stage": FIGURE,
        "run": datasets[0].attrs["run"],
        "parameters": {},
        "parents": parents_of(datasets),
    }
    provenance = Job().provenance(datasets, fingerprint="f" * 16)
    figures.save_figure(figure, path, labels, provenance)
    return figure


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """Results of a scenario, with figures, where the workflow puts them."""
    folder = tmp_path_factory.mktemp("export") / "results" / "desk"
    runs = sweep(
        (0.08, 0.15, 0.2, 0.5), (0.0, 0.59), missing={(0.2, 0.59, 1)}, duration=60.0, profiles=4
    )
    curve = put(flow_curve(runs), folder / "flow_curve.nc", "flow_curve")
    fits = put(fit_laws(curve), folder / "fits.nc", "fits", [curve])
    creeps = put(creep(runs), folder / "creep.nc", "creep")
    draw("fig5", folder / "figures" / "fig5.png", curve, fits)
    draw("fig8", folder / "figures" / "fig8.svg", creeps, curve, fits)
    return folder


@pytest.fixture
def moved(desk, tmp_path):
    """The same below another folder."""
    import shutil

    return Path(shutil.copytree(desk, tmp_path / "sent"))


def text_of(table):
    buffer = io.StringIO()
    write_csv(table, buffer)
    return buffer.getvalue()


def frame_of(text):
    return pd.read_csv(io.StringIO(text), comment="#")


def test_a_figures_numbers_come_back_exactly(desk):
    path = desk / "figures" / "fig5.png"
    table, notes = figure_table(path)
    assert notes == ()
    frame = frame_of(text_of(table))
    curve = read_dataset(desk / "flow_curve.nc", stage="flow_curve")
    fits = read_dataset(desk / "fits.nc", stage="fits")
    kept = shown(figures.draw("fig5", curve, fits))
    assert len(frame) == sum(len(next(iter(one.points.values())).values) for one in kept)
    for panel in ("shear_rate_wall", "shear_rate_bulk"):
        rows = frame[(frame["panel"] == panel) & frame["stress"].notna()]
        assert len(rows) == 7, "eight runs, of which one is missing"
        for row in rows.itertuples():
            cell = curve.sel(stress=row.stress, roughness=row.roughness).isel(seed=0)
            for name in (panel, f"{panel}_error", "shear_stress"):
                np.testing.assert_equal(getattr(row, name), float(cell[name]), err_msg=name)


def test_every_series_of_a_figure_has_its_rows(desk):
    frame = frame_of(text_of(figure_table(desk / "figures" / "fig8.svg")[0]))
    stages = ("creep", "flow_curve", "fits")
    drawn = figures.draw(
        "fig8", *(read_dataset(desk / f"{each}.nc", stage=each) for each in stages)
    )
    for axes, panel in zip(drawn.axes[:3], "abc", strict=True):
        rows = frame[frame["panel"] == panel]
        column = "shear_rate_bulk" if panel == "c" else "shear_rate_wall"
        lines = [np.column_stack((line.get_xdata(), line.get_ydata())) for line in axes.lines]
        np.testing.assert_array_equal(rows[["time", column]].values, np.concatenate(lines))


def test_the_head_names_sources_units_and_the_line_of_the_names(desk):
    text = text_of(figure_table(desk / "figures" / "fig5.png")[0])
    lines = text.splitlines()
    head = [line for line in lines if line.startswith("# ")]
    assert head[0] == "# fig5 of desk"
    curve = read_dataset(desk / "flow_curve.nc", stage="flow_curve")
    assert any(curve.attrs["content_sha256"] in line for line in head)
    number = int(next(line for line in head if "in line" in line).split("line ")[1].split(",")[0])
    names = lines[number - 1].split(",")
    assert number == len(head) + 1
    told = [line.split(" [")[0].removeprefix("# ") for line in head if " [" in line]
    assert told == names
    assert "# shear_stress [stress unit]: " in text
    assert "shear_rate_bulk [1 / time unit]" in text
    assert all(name.isidentifier() and name.isascii() for name in names)


def test_numpy_and_csv_read_it_too(desk):
    text = text_of(dataset_table(desk / "flow_curve.nc", "shear_rate_wall"))
    skipped = sum(line.startswith("#") for line in text.splitlines())
    found = np.genfromtxt(io.StringIO(text), delimiter=",", names=True, skip_header=skipped)
    curve = read_dataset(desk / "flow_curve.nc", stage="flow_curve")
    for name in ("shear_rate_wall", "shear_rate_wall_error"):
        np.testing.assert_array_equal(found[name], curve[name].values.ravel())
    rows = list(csv.DictReader(text.splitlines()[skipped:]))
    assert [float(row["stress"]) for row in rows] == found["stress"].tolist()


@pytest.mark.parametrize("name", ["flow_curve", "fits", "creep"])
def test_a_datasets_numbers_come_back_exactly(desk, name):
    dataset = read_dataset(desk / f"{name}.nc", stage=name)
    frame = frame_of(text_of(dataset_table(desk / f"{name}.nc")))
    groups = {variable.dims for variable in dataset.data_vars.values()}
    assert ("series" in frame) == (len(groups) > 1)
    for variable, array in dataset.data_vars.items():
        rows = (
            frame[frame["series"] == (" ".join(array.dims) or SINGLE)]
            if "series" in frame
            else frame
        )
        assert len(rows) == array.size, variable
        found = rows[variable]
        if array.dtype.kind in "OUS":
            assert found.fillna("").tolist() == [str(value) for value in array.values.ravel()]
        else:
            np.testing.assert_array_equal(found.astype(float), array.values.ravel().astype(float))
        for number, dim in enumerate(array.dims):
            places = np.indices(array.shape)[number].ravel()
            assert rows[dim].tolist() == dataset[dim].values[places].tolist()


def test_dimensions_without_coordinates_are_numbered_and_others_go_along(tmp_path):
    dataset = xr.Dataset(
        {
            "number": (("setting", "axis"), np.arange(6.0).reshape(3, 2) / 3, {"units": "m"}),
            "flag": ("setting", [True, False, True]),
            "count": ((), 4),
            "narrow": ("setting", np.array([0.1, 0.2, np.nan], dtype=np.float32)),
        },
        coords={"kind": ("setting", ["a", 'b "c", d', "e"]), "axis": ["x", "y"], "level": 7},
    )
    write_dataset(dataset, tmp_path / "d.nc", stage="study", run="one", title="x")
    frame = frame_of(text_of(dataset_table(tmp_path / "d.nc")))
    rows = frame[frame["series"] == "setting axis"]
    assert rows["setting"].tolist() == [0, 0, 1, 1, 2, 2]
    assert rows["kind"].tolist() == ["a", "a", 'b "c", d', 'b "c", d', "e", "e"]
    assert rows["number"].tolist() == (np.arange(6.0) / 3).tolist()
    flags = frame[frame["series"] == "setting"]
    assert flags["flag"].tolist() == [1, 0, 1]
    # A short float is written as the long one that it is.
    np.testing.assert_array_equal(flags["narrow"], dataset["narrow"].values.astype(float))
    assert frame[frame["series"] == "single values"]["count"].tolist() == [4]
    assert set(frame["level"]) == {7}


def test_cells_read_back_as_the_same():
    random = np.random.default_rng(np.random.SeedSequence(3))
    numbers = random.standard_normal(1000) * 10.0 ** random.integers(-300, 300, 1000)
    assert [float(cell) for cell in cells(numbers)] == numbers.tolist()
    assert cells(np.array([np.nan, np.inf, -np.inf, -0.0, 5e-324])) == [
        "",
        "inf",
        "-inf",
        "-0.0",
        "5e-324",
    ]
    assert cells(np.array([True, False])) == ["1", "0"]
    assert cells(np.array([2**62 + 1])) == [str(2**62 + 1)]
    assert cells(np.array([None, "x", 1, 0.1], dtype=object)) == ["", "x", "1", "0.1"]


def test_one_name_with_two_units_is_two_columns():
    series = tuple(
        Series("a", name, {"x": Quantity([1.0], unit), "y": Quantity([2.0])}, {})
        for name, unit in (("one", "m"), ("two", "s"), ("three", "m"))
    )
    table = Table("title\nin two lines", (), series)
    text = text_of(table)
    assert "# x [m]\n# y [1]\n# x_other [s]\n" in text
    frame = frame_of(text)
    assert frame["x"].tolist()[::2] == [1.0, 1.0]
    assert frame["x_other"].tolist()[1] == 1.0
    assert frame["x"].isna().tolist() == [False, True, False]
    assert text.startswith("# title in two lines\n")


def test_the_same_source_gives_the_same_bytes(desk, moved, tmp_path):
    for name in ("figures/fig5.png", "flow_curve.nc"):
        for number, folder in enumerate((desk, moved)):
            table, _ = target_table(str(folder / name))
            save_csv(table, tmp_path / f"{number}.csv")
        first, second = ((tmp_path / f"{n}.csv").read_bytes() for n in (0, 1))
        assert first == second
        assert b"\r" not in first


def test_a_table_appears_whole_or_not_at_all(desk, tmp_path, monkeypatch):
    path = tmp_path / "out.csv"
    path.write_text("old")

    def broken(table, file):
        file.write("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module, "write_csv", broken)
    with pytest.raises(StorageError, match="No space left"):
        save_csv(dataset_table(desk / "flow_curve.nc"), path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_datasets_of_a_figure_that_was_moved_are_found_where_they_are_said_to_be(
    desk, tmp_path
):
    alone = tmp_path / "fig8.svg"
    alone.write_bytes((desk / "figures" / "fig8.svg").read_bytes())
    with pytest.raises(
        DatasetError, match=r"drawn from creep desk with content_sha256 .*--results"
    ):
        figure_table(alone)
    assert text_of(figure_table(alone, desk)[0]) == text_of(
        figure_table(desk / "figures" / "fig8.svg")[0]
    )
    # Beside it under any name is as good.
    for number, name in enumerate(("creep", "flow_curve", "fits")):
        (tmp_path / f"other{number}.nc").write_bytes((desk / f"{name}.nc").read_bytes())
    assert figure_table(alone)[0].title == "fig8 of desk"


def test_a_dataset_that_was_replaced_is_not_the_figures(moved):
    curve = read_dataset(moved / "flow_curve.nc", stage="flow_curve")
    changed = curve.assign(shear_stress=curve["shear_stress"] * 2)
    put(changed, moved / "flow_curve.nc", "flow_curve")
    with pytest.raises(DatasetError, match=r"flow_curve\.nc is another version: redraw the figure"):
        figure_table(moved / "figures" / "fig5.png")


def test_an_altered_figure_or_dataset_is_refused(moved):
    path = moved / "figures" / "fig8.svg"
    path.write_bytes(path.read_bytes().replace(b"stroke-width", b"stroke_width", 1))
    with pytest.raises(DatasetError, match="has been altered"):
        figure_table(path)
    with xr.open_dataset(moved / "creep.nc") as dataset:
        spoiled = dataset.load()
    spoiled["slip_velocity"] = spoiled["slip_velocity"] * 2
    spoiled.to_netcdf(moved / "creep.nc")
    with pytest.raises(DatasetError, match="does not fit what the file holds"):
        dataset_table(moved / "creep.nc")


def test_a_figure_that_looks_different_now_is_told(desk, monkeypatch):
    monkeypatch.setattr(figures.transient, "THICK", 3.0)
    table, notes = figure_table(desk / "figures" / "fig8.svg")
    assert table.series
    assert len(notes) == 1
    assert "looks different when it is redrawn" in notes[0]


def test_a_figure_without_numbers_is_refused(tmp_path):
    figure = plt.figure()
    labels = {"title": "lineage", "stage": FIGURE, "run": "desk", "parents": []}
    figures.save_figure(figure, tmp_path / "graph.png", labels, {})
    with pytest.raises(DatasetError, match="'lineage', which shows no numbers; figures that do"):
        figure_table(tmp_path / "graph.png")


@pytest.mark.parametrize(
    ("target", "said"),
    [
        ("flow_curve.nc:shear_rate", "has no variable 'shear_rate'; did you mean shear_rate_"),
        ("flow_curve.nc:zzz", "it has "),
        ("flow_curve.nc:", "has no variable ''"),
        ("nothing.nc", "does not exist"),
        ("nothing.png", "cannot be read"),
        ("notes.txt", "is no result"),
        ("figures", "is no result"),
        ("nothing.nc:x", "does not exist"),
    ],
)
def test_what_cannot_be_exported_is_refused(desk, target, said):
    (desk / "notes.txt").write_text("none")
    with pytest.raises(DatasetError) as refused:
        target_table(str(desk / target))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_file_with_a_colon_in_its_name_is_a_file(desk, tmp_path):
    path = tmp_path / "a.nc:b.nc"
    path.write_bytes((desk / "creep.nc").read_bytes())
    table, _ = target_table(str(path))
    assert table.title == "creep desk"
    table, _ = target_table(f"{path}:slip_velocity")
    assert table.title == "slip_velocity of creep desk"


def call(*words):
    return CliRunner().invoke(app, ["export", *map(str, words)], catch_exceptions=False)


def test_the_command_prints_or_writes(desk, tmp_path):
    printed = call(desk / "flow_curve.nc:status")
    assert printed.exit_code == 0
    written = call(desk / "flow_curve.nc:status", "--output", tmp_path / "deep" / "out.csv")
    assert written.exit_code == 0
    assert "wrote 8 rows" in written.output
    assert (tmp_path / "deep" / "out.csv").read_text() == printed.stdout
    assert frame_of(printed.stdout)["status"].tolist().count("done") == 7


@pytest.mark.parametrize("output", ["out.nc", "out", "a\nb.csv", ".", "notes.txt/out.csv"])
def test_the_command_refuses_other_files(desk, tmp_path, monkeypatch, output):
    monkeypatch.chdir(tmp_path)
    Path("notes.txt").write_text("mine")
    before = sorted(tmp_path.iterdir())
    refused = call(desk / "flow_curve.nc", "--output", output)
    assert refused.exit_code == 2
    assert refused.output.startswith("ConfigError: output: ")
    assert refused.output.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before


def test_a_snapshot_of_a_run_is_exported_like_the_rest(tmp_path):
    run = shear_run(0.5, 0.59, 3, snapshots=(5.0,), duration=30.0).assign_attrs(content_sha256="0")
    table = Table("snapshot", (), shown(membranes.snapshot(run)))
    frame = frame_of(text_of(table))
    assert set(frame["series"]) == {"particle", "lower wall", "upper wall", "arrow"}
    assert frame["x"].notna().all()
    assert json.loads(run.attrs["parameters"])["rheometer"]["stress"] == frame["stress"][0]
