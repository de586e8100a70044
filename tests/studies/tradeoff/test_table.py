import numpy as np
import pytest
import tradeoff_synthetic as synthetic
import xarray as xr

from softslip.errors import DatasetError
from softslip.studies.tradeoff import extrapolation
from softslip.studies.tradeoff.accuracy_markdown import accuracy_tables
from softslip.studies.tradeoff.comparison import effective_regularisation
from softslip.studies.tradeoff.table import gather, pareto


@pytest.fixture(scope="module")
def table():
    return gather(synthetic.members(), synthetic.long_runs())


def test_a_parabola_is_extrapolated_exactly():
    spreads = np.array([0.4, 0.1, 0.2, 0.86, 1.5])
    found = extrapolation.extrapolated(
        spreads, 3 - 2 * spreads + 0.5 * np.minimum(spreads, 1.0) ** 2
    )
    # Of the points only the last, which is too large to be fitted, is off the parabola.
    assert float(found.value) == pytest.approx(3.0, rel=1e-12)
    assert float(found.slope) == pytest.approx(-2.0, rel=1e-12)
    assert 0 < float(found.uncertainty) < 0.1
    assert float(found.residual) > 0


def test_a_line_leaves_no_doubt_and_no_residual():
    spreads = np.array([0.1, 0.2, 0.4])
    found = extrapolation.extrapolated(spreads, np.outer(1 - spreads, [1.0, 2.0]))
    assert found.value == pytest.approx([1.0, 2.0], rel=1e-12)
    assert np.abs(found.uncertainty).max() < 1e-12
    assert np.abs(found.residual).max() < 1e-12


def test_two_points_make_a_line_and_one_makes_none():
    two = extrapolation.extrapolated(np.array([0.2, 0.86]), np.array([0.8, 0.14]))
    assert float(two.value) == pytest.approx(1.0)
    assert float(two.uncertainty) == pytest.approx(0.2)
    one = extrapolation.extrapolated(np.array([0.2]), np.array([0.8]))
    assert float(one.value) == 0.8
    assert np.isnan(one.uncertainty)


def test_a_weighted_line_has_the_errors_of_least_squares():
    spreads, errors = np.array([0.1, 0.3, 0.5, 0.8]), np.array([0.1, 0.2, 0.1, 0.3])
    random = np.random.default_rng(np.random.SeedSequence(3))
    draws = [
        extrapolation.fitted(spreads, 2 - spreads + errors * random.standard_normal(4), errors)
        for _ in range(4000)
    ]
    values = np.array([each.value for each in draws])
    # Of 4000 draws the mean is known to 1.6 % of the error and the error itself to 1.1 %.
    assert values.mean() == pytest.approx(2.0, abs=5 * 0.016 * draws[0].error)
    assert values.std() == pytest.approx(draws[0].error, rel=0.06)
    assert np.mean([each.chi_square for each in draws]) == pytest.approx(1.0, abs=0.1)


def test_a_line_needs_two_points_with_errors():
    found = extrapolation.fitted(
        np.array([0.1, 0.2]), np.array([1.0, np.nan]), np.array([0.1, 0.1])
    )
    assert np.isnan(found.value)


def test_the_limit_is_that_of_the_law(table):
    # The first record that counts is the second: the law grows by a tenth a record.
    assert table["limit"].values == pytest.approx(1.1 * synthetic.level_rates(), rel=1e-9)
    slope = -synthetic.SLOPE * 1.1 * synthetic.level_rates()
    assert table["limit_slope"].values == pytest.approx(slope, rel=1e-9)


def test_rates_are_judged_against_the_largest_of_the_walls(table):
    scale = table["scale"]
    growth = np.sqrt(np.mean((1 + 0.1 * np.arange(1, 4)) ** 2)) * synthetic.share(0.1)
    rates = synthetic.level_rates() * growth
    assert float(scale.sel(quantity="slip_velocity", stress=0.5)) == pytest.approx(rates[0, 1, 0])
    for name in ("shear_rate_wall", "shear_rate_bulk"):
        assert float(scale.sel(quantity=name, stress=0.05)) == pytest.approx(rates[1, 0, 0])


def test_little_slip_is_judged_against_the_speed_of_the_walls():
    rates = synthetic.level_rates()
    rates[0] *= 1e-6
    found = gather([synthetic.member("finest-e0.1", "finest", 0.1, rates=rates)], [])["scale"]
    wall = found.sel(quantity="shear_rate_wall")
    assert found.sel(quantity="slip_velocity").values == pytest.approx(
        0.1 * 0.5 * 0.17 * wall.values, rel=1e-12
    )


def test_numerical_error_leaves_regularisation_out_and_the_whole_has_it(table):
    name = "emesh-n4-t0.01"
    same = table["same_error"].sel(member=name, quantity="shear_rate_wall")
    growing = np.sqrt(np.mean((1 + 0.1 * np.arange(1, 4)) ** 2))
    rates = synthetic.level_rates()[1]
    shares = rates / rates.max(axis=1, keepdims=True)
    rms = float(np.sqrt(np.mean(shares**2)))
    ratio = synthetic.share(synthetic.MESH) / synthetic.share(0.1)
    assert float(same) == pytest.approx(0.002 * ratio * rms, rel=1e-9)
    whole = table["error"].sel(member=name, quantity="shear_rate_wall")
    missed = 1.002 * synthetic.share(synthetic.MESH) - 1
    assert float(whole) == pytest.approx(-missed / synthetic.share(0.1) * rms, rel=1e-6)
    assert growing > 1


def test_errors_of_opposite_sign_are_no_comfort(table):
    """Nodes that make rates too large by what regularisation makes them too small."""
    gain = 1 / synthetic.share(0.2) - 1
    lucky = synthetic.member("lucky", "factorial", 0.2, error=gain)
    found = gather([*synthetic.members(), lucky], []).sel(member="lucky")
    assert float(found["error"].max()) < 1e-9
    wall = table["error"].sel(member="finest-e0.2", quantity="shear_rate_wall")
    assert float(found["total_error"]) == pytest.approx(
        2 * float(table["total_error"].sel(member="finest-e0.2")), rel=1e-6
    )
    assert float(found["total_error"]) > float(wall)


def test_the_finest_member_has_no_difference_from_itself(table):
    assert table.attrs["finest"] == "finest-e0.1"
    assert (table["finest_error"].sel(member="finest-e0.1") == 0).all()
    assert float(table["velocity_error"].sel(member="finest-e0.1")) == 0


def test_markers_count_relative_to_their_velocities(table):
    assert float(table["velocity_error"].sel(member="e0.2-n6-t0.01")) > 0
    assert float(table["position_error"].max()) == 0


def test_the_floor_and_the_doubt_are_those_of_the_twin_and_the_closer_member(table):
    assert 0 < float(table["floor"].max()) < 2e-6
    assert 0 < float(table["closer_error"].max()) < 2e-3


def test_costs_are_relative_to_the_reference_of_the_same_job(table):
    assert float(table["cost_ratio"].sel(member="finest-e0.1")) == pytest.approx(9.0)
    assert float(table["cost"].sel(member="finest-e0.1")) == pytest.approx(0.9)


def test_a_slower_machine_leaves_the_cost_ratio_as_it_is():
    slow = synthetic.members()
    for each in slow[:3]:
        for name in ("cost", "reference_cost", "evaluation_time", "reference_evaluation_time"):
            each[name] = 3 * each[name]
    usual, found = gather(synthetic.members(), []), gather(slow, [])
    assert found["cost_ratio"].values == pytest.approx(usual["cost_ratio"].values)
    assert found["cost"].values == pytest.approx(usual["cost"].values)


def test_short_members_are_judged_on_the_records_they_have(table):
    mesh = table.sel(member="mesh-4096")
    assert np.isfinite(mesh["error"]).all()
    assert float(mesh["regularisation"]) == pytest.approx(2 * synthetic.MESH)
    assert np.isnan(mesh["numerical_error"])


def test_a_member_that_stopped_has_no_error_and_takes_part_in_nothing():
    members = synthetic.members()
    members.append(
        synthetic.member("bad", "factorial", cost=0.01, stopped="film_thickness: too thin; refine")
    )
    found = gather(members, []).sel(member="bad")
    assert np.isnan(found["total_error"])
    assert int(found["pareto"]) == 0
    assert str(found["status"].values) == "film_thickness: too thin; refine"


def test_without_a_finest_member_there_is_nothing_to_compare_with():
    others = [each for each in synthetic.members() if each.attrs["kind"] != "finest"]
    with pytest.raises(DatasetError, match="finest"):
        gather(others, [])


def test_the_front_has_who_is_beaten_by_nobody():
    error = np.array([3.0, 2.0, 2.0, 1.0, np.nan, 0.1])
    cost = np.array([1.0, 2.0, 3.0, 4.0, 0.1, 0.1])
    judged = np.array([True, True, True, True, True, False])
    assert pareto(error, cost, judged).tolist() == [True, True, False, True, False, False]


def test_equals_do_not_beat_each_other():
    both = np.array([1.0, 1.0])
    assert pareto(both, both, np.array([True, True])).all()


@pytest.mark.parametrize(
    ("tree", "spread"),
    [
        (synthetic.parameters(0.2, 5.0, 1e-2), 0.2),
        (synthetic.parameters(None, 5.0, 1e-2), synthetic.MESH),
        (synthetic.parameters(None, 1.4, 1e-2, resolution=2048), 4 * synthetic.MESH),
        (synthetic.parameters(0.2, 1.4, 1e-2, resolution=4096), 0.4),
        ({}, np.nan),
    ],
)
def test_regularisation_lengths_are_in_units_of_the_papers_mesh(tree, spread):
    assert effective_regularisation(tree) == pytest.approx(spread, nan_ok=True)


def test_steady_averages_are_extrapolated_to_the_law(table):
    here = table["steady_limit"].sel(steady_roughness=0.59)
    law = synthetic.level_rates()[:, :, 1]
    assert here.transpose("quantity", "steady_stress").values == pytest.approx(law, rel=1e-9)
    assert (table["steady_limit_error"] > 0).all()


def test_packings_that_differ_enlarge_the_error(table):
    smooth, rough = (
        abs(table["steady_error"] / table["steady_mean"]).sel(steady_roughness=each)
        for each in (0.0, 0.59)
    )
    # Half of the difference of a tenth, against 2 % of a single run over the root of two.
    assert smooth.values == pytest.approx(0.05 / 1.05, rel=1e-6)
    assert rough.values == pytest.approx(0.02 / np.sqrt(2), rel=1e-6)
    assert (table["seed_scatter"].sel(steady_roughness=0.59) == 0).all()


def test_shorter_runs_of_white_noise_err_as_the_root_of_their_length(table):
    error = abs(table["run_error"].sel(steady_roughness=0.0) / table["scale"].max())
    rising = error.mean(("quantity", "steady_stress")).sortby("run_length", ascending=False)
    growth = rising.values[1:] / rising.values[:-1]
    # Two packings at three regularisation lengths, two to 16 blocks each: some 20 % of scatter.
    assert growth[1:] == pytest.approx(np.sqrt(2), rel=0.35)


def test_wide_channels_have_averages_of_their_own(table):
    assert table.sizes["wide_regularisation"] == 1
    assert np.isfinite(table["wide_mean"]).all()


def test_every_variable_of_the_table_says_what_it_is(table):
    texts = {"kind", "level", "effect", "settings", "status", "member", "quantity"}
    for name, variable in table.variables.items():
        if name not in texts | {"stress", "roughness"}:
            assert {"units", "long_name"} <= set(variable.attrs), name


def test_the_table_survives_a_file(table, tmp_path):
    table.to_netcdf(tmp_path / "tradeoff.nc")
    again = xr.load_dataset(tmp_path / "tradeoff.nc")
    assert accuracy_tables(again) == accuracy_tables(table)


def test_the_markdown_has_the_numbers_of_the_table(table):
    text = accuracy_tables(table)
    level = table.sel(member="level-standard")
    error = 100 * float(level["error"].sel(quantity="slip_velocity"))
    assert f"| `standard` | 0.86 | 5 | 0.01 | {error:.2g} %" in text
    assert "mesh-4096" in text
    assert "nan" not in text
    for line in text.splitlines():
        if line.startswith("|"):
            assert line.endswith("|")


def test_without_long_runs_and_variants_the_markdown_leaves_them_out():
    kinds = ("finest", "factorial", "level")
    members = [each for each in synthetic.members() if each.attrs["kind"] in kinds]
    text = accuracy_tables(gather(members, []))
    assert "Steady" not in text
    assert "One thing" not in text
