"""Tables of a rheometer: what is fitted to them is what is fitted to the dataset."""

import io
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from rheology_fit.data import load_flow_curve_csv
from rheology_fit.models import fit_model
from scipy.optimize import curve_fit
from synthetic import sweep
from typer.testing import CliRunner

from softslip.analysis.fits import FITTED, flow_law, herschel_bulkley
from softslip.analysis.observables import mean_over_seeds
from softslip.analysis.observables.tables import flow_curve
from softslip.cli import app
from softslip.config.parameters import Parameters
from softslip.errors import ConfigError, DatasetError
from softslip.files.storage import write_dataset
from softslip.provenance.attribution import Job
from softslip.provenance.export.lab_units import LabUnits
from softslip.provenance.export.rheometer_table import (
    METADATA,
    rheometer_table,
)
from softslip.provenance.export.stress_errors import smooth_slope
from softslip.studies.coverage.made_up_curves import CURVES

LABORATORY = {"viscosity": 1e-3, "elastic-constant": 1e-2, "radius": 1.5}
OPTIONS = [word for name, value in LABORATORY.items() for word in (f"--{name}", str(value))]
BASE = {"base": Parameters().model_dump(mode="json"), "axes": {}}


def labelled(curve: xr.Dataset) -> xr.Dataset:
    return curve.assign_attrs(parameters=json.dumps(BASE), run="made up", content_sha256="c" * 64)


@pytest.fixture(scope="module")
def curve() -> xr.Dataset:
    """A flow curve that is made up from a known law, with seeds that scatter."""
    return labelled(CURVES["paper"].drawn(np.random.default_rng(2)))


@pytest.fixture(scope="module")
def units() -> LabUnits:
    return LabUnits.of(BASE, LABORATORY)


def read(table) -> pd.DataFrame:
    file = io.StringIO()
    table.write(file)
    return pd.read_csv(io.StringIO(file.getvalue()))


def in_lab_units(fit: xr.Dataset, units: LabUnits, prefix: str) -> np.ndarray:
    """Return yield stress, consistency and flow index of a fit in pascals and seconds."""
    stress, consistency, index = (
        float(fit[f"{prefix}{name}"]) for name in ("yield_stress", "consistency", "flow_index")
    )
    return np.array([stress * units.stress, consistency * units.stress * units.time**index, index])


def standard_errors_apart(curve: xr.Dataset, units: LabUnits) -> float:
    """Return how far SciPy's fit to a table is from ours to the dataset, at its worst parameter."""
    fit = herschel_bulkley(curve)
    assert fit["pooled_fit_message"].item() == FITTED
    table = read(rheometer_table(curve, LABORATORY))
    found, covariance = curve_fit(
        flow_law,
        table["shear_rate"],
        table["shear_stress"],
        p0=[0.5 * table["shear_stress"].min(), 1.0, 0.5],
        sigma=table["shear_stress_std"],
        absolute_sigma=True,
    )
    apart = found - in_lab_units(fit, units, "pooled_")
    return float(np.max(np.abs(apart) / np.sqrt(np.diag(covariance))))


@pytest.mark.parametrize("kind", ["paper", "one seed", "imposed rate"])
def test_a_fit_to_the_table_is_the_fit_to_the_dataset(kind, units):
    """Ours is to rates with Student's errors, SciPy's to stresses with normal ones."""
    drawn = (CURVES[kind].drawn(np.random.default_rng(seed)) for seed in range(1, 8))
    apart = [standard_errors_apart(labelled(curve), units) for curve in drawn]
    assert max(apart) < 1.0, apart
    assert np.median(apart) < 0.2, apart


def test_a_program_of_the_laboratory_finds_the_law_in_the_table(units, tmp_path):
    """rheology-fit reads the file as it is, and gives all of its points the same weight."""
    true = CURVES["paper"]
    file = tmp_path / "flow_curve.csv"
    for seed in range(1, 6):
        curve = labelled(true.drawn(np.random.default_rng(seed)))
        with file.open("w") as opened:
            rheometer_table(curve, LABORATORY).write(opened)
        data = load_flow_curve_csv(file)
        assert (data.shear_stress_std > 0).all()
        found = fit_model(data, "HerschelBulkley")
        ours = in_lab_units(herschel_bulkley(curve), units, "pooled_")
        apart = np.array(list(found.params.values())) - ours
        assert np.abs(apart / list(found.param_errors.values())) == pytest.approx(0, abs=2)
        assert found.params["n"] == pytest.approx(true.flow_index, rel=0.15)
        assert found.params["tau0"] == pytest.approx(true.yield_stress * units.stress, rel=0.15)


def test_numbers_are_those_of_the_dataset_in_other_units(curve, units):
    table = read(rheometer_table(curve, LABORATORY, rate="wall", where="roughness == 0.6"))
    mean = mean_over_seeds(curve).sel(roughness=0.6)
    mean = mean.isel(stress=np.flatnonzero(mean["steady_wall"].values))
    assert set(table["roughness"]) == {0.6}
    for column, name, factor in (
        ("shear_rate", "shear_rate_wall", 1 / units.time),
        ("shear_stress", "stress", units.stress),
        ("slip_velocity", "slip_velocity", units.length / units.time),
        ("slip_velocity_std", "slip_velocity_error", units.length / units.time),
    ):
        np.testing.assert_allclose(table[column], mean[name].values * factor, rtol=1e-12)


def test_errors_of_rates_are_those_of_our_own_fits(curve, units):
    """Known well, they stay as they are; of few seeds, they lean on each other."""
    known = labelled(CURVES["one seed"].drawn(np.random.default_rng(1)).isel(seed=0))
    errors = known["shear_rate_bulk_error"].values[known["steady_bulk"].values]
    told = read(rheometer_table(known, LABORATORY))["shear_rate_std"] * units.time
    np.testing.assert_allclose(np.sort(told), np.sort(errors), rtol=0.02)
    table, mean = read(rheometer_table(curve, LABORATORY)), mean_over_seeds(curve)
    raw = mean["shear_rate_bulk_error"] / mean["shear_rate_bulk"]
    told = table["shear_rate_std"] / table["shear_rate"]
    spread = [float(np.std(np.log(each))) for each in (raw.values[mean["steady_bulk"]], told)]
    assert spread[1] < 0.5 * spread[0], spread


def test_errors_of_rates_become_those_of_stresses_by_the_slope_of_the_law(curve, units):
    fit = herschel_bulkley(curve)
    _, consistency, index = in_lab_units(fit, units, "pooled_")
    table = rheometer_table(curve, LABORATORY)
    points = read(table)
    slope = index * consistency * points["shear_rate"] ** (index - 1)
    expected = slope * points["shear_rate_std"]
    np.testing.assert_allclose(points["shear_stress_std"], expected, rtol=1e-9)
    assert "Herschel-Bulkley" in table.remarks[-1]


def test_without_a_law_the_slope_is_that_of_a_smooth_curve(curve):
    # The points of three stresses determine no law.
    few = curve.sel(stress=[0.15, 0.2, 0.3], roughness=0.0)
    table = rheometer_table(few, LABORATORY)
    assert "a smooth curve" in table.remarks[-1]
    law, smooth = (read(rheometer_table(each, LABORATORY)) for each in (curve, few))
    of_law = law[(law["roughness"] == 0.0) & law["shear_stress"].isin(smooth["shear_stress"])]
    ratio = smooth["shear_stress_std"].to_numpy() / of_law["shear_stress_std"].to_numpy()
    assert (np.abs(ratio - 1) < 0.4).all(), ratio


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_a_smooth_curve_has_the_slope_of_the_law_in_spite_of_noise(noise):
    random = np.random.default_rng(5)
    true = np.geomspace(1e-3, 1.0, 10)
    stress = flow_law(true, 0.05, 0.4, 0.5)
    rate = true * np.exp(noise * random.standard_normal(true.size))
    slope = smooth_slope(stress, rate, 0.1 * rate)
    ratio = slope / (0.5 * 0.4 * true**-0.5)
    assert ratio.min() > 0.6, ratio
    assert ratio.max() < 1.6, ratio


@pytest.mark.parametrize(
    ("stress", "rate"), [([0.1], [1.0]), ([0.1, 0.2], [2.0, 1.0]), ([0.1, 0.2], [1.0, 1.0])]
)
def test_points_that_do_not_rise_have_no_slope(stress, rate):
    assert np.isnan(smooth_slope(*map(np.array, (stress, rate, rate)))).all()


def test_points_that_are_not_steady_or_do_not_flow_are_left_out_and_counted(curve):
    single = curve.isel(seed=0)
    spoilt = single.copy(deep=True)
    spoilt["steady_bulk"].loc[{"stress": 0.1, "roughness": 0.0}] = False
    spoilt["shear_rate_bulk"].loc[{"stress": 0.2, "roughness": 0.0}] = -1e-6
    steady = int(single["steady_bulk"].sum())
    table = rheometer_table(spoilt, LABORATORY)
    assert len(read(rheometer_table(single, LABORATORY))) == steady
    assert len(read(table)) == steady - 2
    assert table.remarks[:2] == (
        f"{single['status'].size - steady + 1} points left out: not steady",
        "1 point left out: no shear rate above 0 with an error",
    )
    assert (read(table)["shear_rate"] > 0).all()


def test_rheofit_finds_its_columns(curve):
    table = read(rheometer_table(curve, LABORATORY, layout="rheofit"))
    plain = read(rheometer_table(curve, LABORATORY))
    np.testing.assert_array_equal(table["Shear rate / 1/s"], plain["shear_rate"])
    np.testing.assert_array_equal(table["Stress / Pa"], plain["shear_stress"])


@pytest.mark.parametrize(
    ("choice", "said"),
    [
        ({"rate": "slip"}, "rate: 'slip' does not exist; use bulk or wall"),
        ({"layout": "excel"}, "layout: 'excel' does not exist; use plain or rheofit"),
        ({"where": "rougness == 0"}, "rougness"),
    ],
)
def test_unknown_choices_are_refused(curve, choice, said):
    with pytest.raises(ConfigError) as refused:
        rheometer_table(curve, LABORATORY, **choice)
    assert said in str(refused.value)


def test_a_condition_that_no_point_meets_is_refused(curve):
    with pytest.raises(DatasetError, match="no point"):
        rheometer_table(curve, LABORATORY, where="roughness == 3")


@pytest.fixture(scope="module")
def stored(tmp_path_factory) -> Path:
    """A file with the flow curve of two runs."""
    path = tmp_path_factory.mktemp("stored") / "flow_curve.nc"
    made = labelled(flow_curve(sweep((0.3, 0.4, 0.5)))).drop_attrs(deep=False)
    made = made.assign_attrs(parameters=json.dumps(BASE), **Job().labels(fingerprint="f" * 16))
    write_dataset(made, path, stage="flow_curve", run="made up", title="flow curve")
    return path


def test_the_command_writes_the_table_and_what_it_is(stored, tmp_path):
    output = tmp_path / "lab.csv"
    words = ["export", str(stored), "--rheometer", *OPTIONS, "--output", str(output)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    lines = output.read_text("utf-8").splitlines()
    assert lines[0].split(",")[:3] == ["shear_rate", "shear_stress", "shear_stress_std"]
    told = json.loads(Path(f"{output}{METADATA}").read_text("utf-8"))
    columns = told["tableSchema"]["columns"]
    assert [column["titles"] for column in columns] == lines[0].split(",")
    assert [column["schema:unitText"] for column in columns][:3] == ["1/s", "Pa", "Pa"]
    assert "content_sha256" in told["dc:source"][0]


def test_the_same_table_is_the_same_bytes(stored):
    words = ["export", str(stored), "--rheometer", *OPTIONS]
    first, second = (CliRunner().invoke(app, words).stdout for _ in range(2))
    assert first == second
    assert len(first.splitlines()) > 1


def test_the_numbers_of_the_laboratory_must_be_given(stored):
    refused = CliRunner().invoke(app, ["export", str(stored), "--rheometer", *OPTIONS[:4]])
    assert refused.exit_code == 2
    assert "radius: null is not given; give it in µm, such as 1" in refused.output


@pytest.mark.parametrize("option", ["--viscosity", "--where"])
def test_options_of_the_table_are_refused_without_it(stored, option):
    refused = CliRunner().invoke(app, ["export", str(stored), option, "1"])
    assert refused.exit_code == 2
    assert "belongs to --rheometer" in refused.output
