"""One tiny scene and a few members on it; times are not judged."""

import json

import numpy as np
import pytest
import scenes

from softslip.errors import ConfigError
from softslip.studies.interval_means import QUANTITIES
from softslip.studies.tradeoff import long_runs, member_dataset, member_run, tradeoff_scenes
from softslip.studies.tradeoff.members import Member, members_of, parameters_of, reference_of
from softslip.studies.tradeoff.precision import in_single_precision, single_solver
from softslip.studies.tradeoff.tradeoff_design import TradeoffDesign

DESIGN = TradeoffDesign.of(
    {
        "particles": 24,
        "stresses": [0.5],
        "roughnesses": [0.0],
        "ageing": 0.2,
        "shearing": 0.2,
        "settling": 0.02,
        "interval": 0.05,
        "skipped": 1,
        "records": 2,
        "short_records": 1,
        "regularisations": [0.2, None],
        "node_spacings": [5.0, 6.0],
        "tolerances": [2e-2],
        "finest_tolerance": 5e-3,
        "closer_spacing": None,
        "levels": [],
        "variants": {
            "short": {"settings": {"time_stepping": {"tolerance": 5e-3}}, "short": True},
            "single": {"precision": "single"},
            "too-wide": {"settings": {"hydrodynamics": {"node_spacing": 8.0}}},
        },
        "steady": {
            "regularisations": [None],
            "stresses": [0.5],
            "roughnesses": [0.0],
            "seeds": [1],
            "wide_regularisations": [None, 0.2],
            "ageing": 0.05,
            "duration": 0.2,
        },
    }
)


@pytest.fixture(scope="module", autouse=True)
def _untimed():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(member_dataset, "ROUNDS_FOR", 0.0)
        patch.setattr(member_dataset, "FEWEST_ROUNDS", 1)
        yield


@pytest.fixture(scope="module")
def prepared():
    return tradeoff_scenes.prepare(DESIGN)


@pytest.fixture(scope="module")
def measured(prepared):
    wanted = ("finest-e0.2", "twin", "short", "single", "too-wide")
    members = members_of(DESIGN)
    return {name: member_dataset.measure_member(prepared, members[name], DESIGN) for name in wanted}


def test_a_scene_has_the_particles_of_the_plan_on_the_closest_nodes(prepared):
    only = tradeoff_scenes.scene_of(prepared, 0.5, 0.0)
    given = parameters_of(members_of(DESIGN)["finest-emesh"], DESIGN, 0.5, 0.0)
    assert only.sizes["particle"] == 24
    assert only.sizes["node"] == int(only["nodes_per_particle"].sum())
    assert tradeoff_scenes.on_member(only, given).layout.particle_nodes == only.sizes["node"]
    assert only["wall_displacement"].values[1] > only["wall_displacement"].values[0]
    with pytest.raises(KeyError, match="no scene"):
        tradeoff_scenes.scene_of(prepared, 0.4, 0.0)


def test_the_same_scene_and_member_give_the_same_records(prepared, measured):
    again = member_dataset.measure_member(prepared, members_of(DESIGN)["short"], DESIGN)
    for name in QUANTITIES:
        assert again[name].values.tobytes() == measured["short"][name].values.tobytes()


def test_a_member_has_every_record_and_what_it_took(measured):
    found = measured["finest-e0.2"]
    assert (found["status"] == member_dataset.DONE).all()
    for name in QUANTITIES:
        assert found[name].shape == (1, 1, 3)
        assert np.isfinite(found[name]).all()
    for name in (*member_run.COUNTS, *member_dataset.REFERENCE.values()):
        assert np.isfinite(found[name]).all(), name
    assert float(found["evaluations"].min()) > 2 * float(found["steps"].min())
    assert found["velocity"].shape == (24 * member_run.MARKERS, 2)
    given = json.loads(found.attrs["parameters"])
    assert given["hydrodynamics"]["regularisation"] == 0.2


def test_every_variable_says_what_it_is(measured):
    for name, variable in measured["finest-e0.2"].variables.items():
        assert {"units", "long_name"} <= set(variable.attrs), name


def test_a_short_member_has_no_records_beyond_its_window(measured):
    values = measured["short"]["shear_rate_wall"].values[0, 0]
    assert np.isfinite(values[:2]).all()
    assert np.isnan(values[2:]).all()
    assert np.isfinite(measured["short"]["marker"]).all()


def test_a_member_that_cannot_run_says_why_and_keeps_the_schema(measured):
    found, good = measured["too-wide"], measured["finest-e0.2"]
    assert "hydrodynamics.node_spacing" in str(found["status"].values[0, 0])
    assert np.isnan(found["shear_rate_wall"]).all()
    assert np.isfinite(found["reference_cost"]).all()
    assert set(found.variables) == set(good.variables)
    assert dict(found.sizes) == dict(good.sizes)


def test_a_twin_starts_displaced_and_stays_close(measured):
    truth, twin = measured["finest-e0.2"], measured["twin"]
    apart = np.abs(twin["shear_rate_wall"] / truth["shear_rate_wall"] - 1).values
    assert 0 < apart.max() < 1e-3
    moved = twin["marker"].values - truth["marker"].values
    # The displacement is a millionth of the contact range; films soon undo most of it.
    assert 0 < np.abs(moved).max() < 1e-4 * 9 / 8192


def test_a_stopped_run_does_not_stop_the_member(prepared, monkeypatch):
    def stop(*args, **kwargs):
        raise member_dataset.SoftslipError("stopped on purpose")

    kept = member_dataset.run_of

    def stop_first(given, design, *, short):
        return kept(given, design, short=short) if short else stop()

    monkeypatch.setattr(member_dataset, "run_of", stop_first)
    found = member_dataset.measure_member(prepared, members_of(DESIGN)["finest-emesh"], DESIGN)
    assert str(found["status"].values[0, 0]) == "stopped on purpose"
    assert np.isnan(found["marker"]).all()


def test_single_precision_changes_velocities_by_its_rounding_alone(prepared):
    only = tradeoff_scenes.scene_of(prepared, 0.5, 0.0)
    given = tradeoff_scenes.on_member(only, parameters_of(reference_of(DESIGN), DESIGN, 0.5, 0.0))
    single = in_single_precision(given)
    exact, coarse = (each.suspension.evaluate(given.state) for each in (given, single))
    exact_speed, coarse_speed = (
        given.state.like(each.rate).node_position for each in (exact, coarse)
    )
    error = np.abs(coarse_speed - exact_speed).max() / np.abs(exact_speed).max()
    # 24 bits round by 6e-8; velocities are small differences of what large forces cause.
    assert 1e-9 < error < 1e-5


def test_the_mesh_scheme_has_no_single_precision():
    given = scenes.empty()
    assert given.hydrodynamics.mobility == "grid"
    with pytest.raises(ConfigError, match=r"^precision: 'single' is not for the mesh"):
        single_solver(given, scenes.layout_of_rings([], given))


def test_a_single_precision_member_differs_from_its_level(prepared, measured):
    level = member_dataset.measure_member(prepared, Member("level", "level"), DESIGN)
    apart = measured["single"]["slip_velocity"] / level["slip_velocity"] - 1
    assert 0 < float(np.abs(apart).max()) < 1e-2


def test_markers_are_the_same_points_whatever_the_nodes(prepared):
    only = tradeoff_scenes.scene_of(prepared, 0.5, 0.0)
    fine, wide = (
        tradeoff_scenes.on_member(
            only, parameters_of(Member("m", "level", level), DESIGN, 0.5, 0.0)
        )
        for level in ("converged", "standard")
    )
    places = [member_run.on_markers(each.state.node_position, each.layout) for each in (fine, wide)]
    # The nodes of the scene are 5 apart: nothing that either has is lost on the way.
    assert np.abs(places[0] - places[1]).max() < 1e-3 / 8192


def test_long_runs_are_those_of_the_plan():
    cases = long_runs.sheared_packings(DESIGN)
    assert [(each.roughness, each.seed, each.periods) for each in cases.values()] == [
        (0.0, 1, 1),
        (0.0, 1, 2),
    ]


def test_a_long_run_has_averages_and_one_that_stops_says_why(monkeypatch):
    real = long_runs.hydrodynamics.shear

    def brittle(aged, parameters):
        if parameters.hydrodynamics.regularisation is not None:
            raise member_dataset.SoftslipError("stopped on purpose")
        return real(aged, parameters)

    monkeypatch.setattr(long_runs.hydrodynamics, "shear", brittle)
    found = long_runs.measure_steady(long_runs.sheared_packings(DESIGN)["beta0-seed1-wide"], DESIGN)
    assert found["status"].values[:, 0].tolist() == [member_dataset.DONE, "stopped on purpose"]
    records, means = found["shear_rate_wall"], found["shear_rate_wall_mean"].values[:, 0]
    assert float(records.min()) <= means[0] <= float(records.max())
    assert np.isnan(means[1])
    assert found["shear_rate_wall_error"].values[0, 0] >= 0
    assert found.attrs["periods"] == 2
    assert np.isnan(found["regularisation"].values[0])
    assert found["regularisation"].values[1] == 0.2
