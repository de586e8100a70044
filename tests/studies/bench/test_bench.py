"""The benchmarks in miniature: what they compare and count is right. Times are not judged."""

import json
import math
import re
import subprocess
import sys
from dataclasses import replace

import matplotlib
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from projects import copy_project
from scipy.spatial import cKDTree
from typer.testing import CliRunner

from softslip.analysis import figures
from softslip.cli import app
from softslip.errors import ConfigError, SoftslipError
from softslip.files.storage import read_dataset, write_dataset
from softslip.simulation import assembly
from softslip.simulation.assembly import contact_law
from softslip.simulation.expansion import membrane_node_counts
from softslip.simulation.sample import particle_radii
from softslip.solver.contacts import Contacts
from softslip.solver.membrane import membrane_areas
from softslip.solver.mobility.window import WIDTH
from softslip.studies import bench, scenes, timing
from softslip.studies.bench import (
    memory,
    mobility,
    roofline,
    run,
    scaling,
    trajectory,
    trimmed,
    trimming,
    trimming_contacts,
)

SMALL, LEVEL = 24, "paper"

GAP = 0.03
"""Solvent outside the walls that makes the paper's box cheap enough for a test."""


@pytest.fixture(scope="module")
def flowing():
    return scenes.flowing(SMALL, LEVEL)[0]


@pytest.fixture(scope="module")
def on_paper_nodes(flowing):
    return run.on_paper_nodes(flowing, GAP)


@pytest.fixture(scope="module")
def results(flowing):
    """Each benchmark but that of memory, at the smallest size and without repeats."""
    return {
        "mobility": bench.bench_mobility(SMALL, LEVEL, budget=0.0),
        "run": bench.bench_run(SMALL, LEVEL, gap=GAP, budget=0.0, level_time=0.5),
        "scaling": bench.bench_scaling((16, SMALL), LEVEL, budget=0.0),
        "trimming": bench.bench_trimming(SMALL, LEVEL, duration=1.0, budget=0.0),
    }


def call(*words):
    return CliRunner().invoke(app, ["bench", *map(str, words)], catch_exceptions=False)


def every_number(result):
    for value in result.values():
        if isinstance(value, dict):
            yield from every_number(value)
        elif isinstance(value, list):
            yield from value
        elif not isinstance(value, str):
            yield value


@pytest.fixture(scope="module")
def travelled():
    """The benchmark of trajectories over two short records, after as good as no time at rest."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trajectory, "SETTLED", 0.0)
        patch.setattr(trajectory, "INTERVAL", 0.05)
        return bench.bench_trajectory(SMALL, 0.5, 0.1, LEVEL, ageing=0.1)


@pytest.mark.parametrize("particles", [*range(16, 130), 200, 400, 799, 800, 801])
def test_a_box_holds_just_the_particles_asked_for(particles):
    given = scenes.parameters_of(particles)
    assert len(particle_radii(given)) == particles
    length, gap = given.channel.length, given.channel.outer_gap
    cells = (given.channel.height + gap) / scenes.CELL
    assert cells == pytest.approx(round(cells), abs=1e-9)
    assert gap >= scenes.GAP
    assert length * 32 == round(length * 32)
    assert length >= 3 / 32


def test_the_largest_box_is_that_of_the_paper():
    given = run.paper_scheme(800)
    channel, hydrodynamics = given.channel, given.hydrodynamics
    assert channel.length == 0.5
    # The paper rounds its mean radius to two digits, so that H is not met to the last one.
    assert channel.height == pytest.approx(0.44, rel=1e-3)
    assert channel.height + channel.outer_gap == 1.0
    assert (channel.outside, given.membrane.order, given.steric.refinement) == ("periodic", 2, 1)
    assert (hydrodynamics.mobility, hydrodynamics.quadrature) == ("grid", "plain")
    assert (hydrodynamics.resolution, hydrodynamics.node_spacing) == (8192, 1.42)
    assert (given.time_stepping.integrator, given.time_stepping.step) == ("euler", 0.002)


@given(st.integers(6, 40), st.integers(6, 90), st.sampled_from([0.0, 0.5]), st.integers(0, 2**31))
def test_interpolation_is_exact_for_what_the_nodes_resolve(before, after, offset, seed):
    modes = np.arange((before + 1) // 2)
    waves = np.random.default_rng(np.random.SeedSequence(seed)).standard_normal((2, len(modes)))

    def values(count):
        angle = 2 * np.pi * (np.arange(count)[:, None] + offset) * modes / count
        return np.cos(angle) @ waves[0] + np.sin(angle) @ waves[1]

    matrix = scenes.interpolation(before, after, offset)
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0, atol=1e-12)
    # A row has `before` entries of size one at most.
    np.testing.assert_allclose(
        matrix @ values(before), values(after), atol=1e-13 * before * np.abs(waves).sum()
    )


@given(st.integers(6, 40), st.sampled_from([0.0, 0.5]))
def test_interpolation_meets_the_nodes_themselves(count, offset):
    found = scenes.interpolation(count, 2 * count, offset)
    if offset == 0.0:
        np.testing.assert_allclose(found[::2], np.eye(count), atol=1e-13)
    np.testing.assert_allclose(
        scenes.interpolation(count, count, offset), np.eye(count), atol=1e-13
    )


def test_the_same_membranes_lie_on_other_nodes(flowing, on_paper_nodes):
    paper = on_paper_nodes
    counts = membrane_node_counts(paper.parameters)
    np.testing.assert_array_equal(np.diff(paper.layout.offsets), counts)
    np.testing.assert_allclose(paper.layout.reference_area, flowing.layout.reference_area)
    np.testing.assert_array_equal(paper.state.wall_displacement, flowing.state.wall_displacement)
    # Node 0 stays node 0.
    np.testing.assert_allclose(
        paper.state.node_position[paper.layout.offsets[:-1]],
        flowing.state.node_position[flowing.layout.offsets[:-1]],
        atol=1e-14,
    )
    # The polygon of N nodes lacks (2π/N)²/6 of a circle: 0.02 % at the paper's spacing.
    areas = membrane_areas(paper.state.node_position, paper.layout.offsets, 2)
    np.testing.assert_allclose(areas, paper.layout.reference_area, rtol=1e-3)


def test_both_schemes_start_from_the_same_flow(flowing, on_paper_nodes):
    """Rates of one instant, through other nodes, mesh and box: 2 % is the tethers' tolerance."""
    rates = [
        np.ptp(scene.suspension.evaluate(scene.state).wall_velocity)
        for scene in (flowing, on_paper_nodes)
    ]
    assert rates[0] == pytest.approx(rates[1], rel=0.02)


def test_smooth_forces_are_one_density_on_any_nodes(flowing, on_paper_nodes):
    coarse, fine = flowing.layout, on_paper_nodes.layout
    waves = mobility.random_coefficients(coarse)
    few, many = (mobility.smooth_forces(waves, layout) for layout in (coarse, fine))
    density = scenes.on_nodes(many / fine.weights[:, None], fine, coarse)
    np.testing.assert_allclose(few / coarse.weights[:, None], density, atol=1e-10)
    for layout, forces in ((coarse, few), (fine, many)):
        total = np.add.reduceat(forces, layout.chains[:-1])
        np.testing.assert_allclose(total, 0.0, atol=1e-12 * np.abs(forces).sum())


def test_offsets_say_where_the_nodes_of_walls_are(flowing):
    layout = flowing.layout
    *membranes, lower, upper = scenes.chain_offsets(layout)
    assert membranes == [0.0] * layout.particles
    for wall, offset in enumerate((lower, upper)):
        places = (np.arange(layout.wall_nodes) + offset) * layout.wall_spacing
        np.testing.assert_allclose(layout.wall_reference[wall, :, 0], places, atol=1e-15)


def test_differences_are_relative_to_the_reference():
    reference = np.array([[3.0, 4.0], [0.0, 5.0]])
    found = mobility.difference(reference + np.array([[0.0, 0.0], [0.5, 0.0]]), reference)
    assert found == pytest.approx({"rms_error": 0.1 / math.sqrt(2), "max_error": 0.1})


def test_mobilities_agree_on_the_same_nodes_and_on_their_own(results):
    """5e-4 is the anisotropy of the mesh (design 2.1); where node forces jump it is larger."""
    found = results["mobility"]
    assert found["rms_error"] < 1e-3
    assert found["max_error"] < 5e-3
    assert found["real"]["rms_error"] < 1e-2
    own = found["own"]
    assert own["rms_error"] < 2e-3
    assert own["max_error"] < 1e-2
    assert own["nodes"] < 0.4 * own["grid_nodes"]
    assert own["grid_nodes"] == found["nodes"]
    keys = {"ratio", "grid_seconds", "ewald_seconds", "rms_error", "max_error", "nodes", "pairs"}
    assert keys <= found.keys()
    assert keys <= own.keys()


def test_mobilities_that_differ_are_seen_to(flowing, on_paper_nodes):
    """The comparison must notice a regularisation length that is 20 % off."""
    parameters = mobility.by_ewald(on_paper_nodes)
    other = parameters.hydrodynamics.model_copy(update={"regularisation": 1.03})
    wrong = parameters.model_copy(update={"hydrodynamics": other})
    layout = on_paper_nodes.layout
    positions = on_paper_nodes.suspension.positions(on_paper_nodes.state)
    forces = mobility.smooth_forces(mobility.random_coefficients(layout), layout)
    right, off = (
        scenes.plain_sum(each, layout).velocities(positions, forces) for each in (parameters, wrong)
    )
    assert mobility.difference(off, right)["rms_error"] > 1e-3


def test_a_run_costs_what_its_steps_cost(results):
    found = results["run"]
    assert found["ratio"] == pytest.approx(
        found["paper"]["core_seconds"] / found["level"]["core_seconds"]
    )
    assert found["stretch"] == pytest.approx(run.FEWEST_STEPS * 0.002)
    assert found["paper"]["steps"] == pytest.approx(500)
    assert found["paper"]["duration"] == found["stretch"]
    assert found["level"]["duration"] == pytest.approx(0.5)
    # Both begin with tethers that leave 2 % of the walls' deformation.
    assert abs(found["rate_difference"]) < 0.02


def test_parts_add_up_to_the_velocities_of_an_evaluation(flowing):
    anatomy = scaling.Anatomy(flowing)
    works = anatomy.works()
    works["spread"]()
    works["fft"]()
    far = works["gather"]()
    works["near"]()
    found = far + anatomy.velocities + works["quadrature"]()
    evaluation = flowing.suspension.evaluate(flowing.state)
    solver = assembly.solver_of(flowing.parameters, flowing.layout)
    whole = assembly.mobility_of(flowing.parameters, flowing.layout, solver)
    wanted = whole.velocities(evaluation.positions, evaluation.forces)
    # The same sums in another order.
    np.testing.assert_allclose(found, wanted, atol=1e-12 * np.abs(wanted).max())


def test_pairs_are_counted_as_they_are(flowing):
    anatomy = scaling.Anatomy(flowing)
    anatomy.works()["near"]()
    counts, layout = anatomy.counts(), flowing.layout
    length = flowing.parameters.channel.length
    nodes = flowing.suspension.positions(flowing.state) % (length, np.inf)
    tree = cKDTree(nodes, boxsize=(length, 0.0))
    close = tree.query_pairs(anatomy.ewald.reach, output_type="ndarray")
    walls = (close >= layout.particle_nodes).all(axis=1)
    assert counts.pairs == len(close)
    assert counts.rigid == walls.sum()
    assert counts.listed >= counts.pairs - counts.rigid
    assert counts.points == flowing.parameters.steric.refinement * layout.nodes


def test_parts_take_the_time_of_an_evaluation_between_them(results):
    found = results["scaling"]
    assert set(found["nanoseconds"]) == set(scaling.PARTS)
    for number, whole in enumerate(found["seconds"]):
        parts = sum(times[number] for times in found["nanoseconds"].values())
        assert parts * found["nodes"][number] == pytest.approx(scaling.NANO * whole)
    judged = set(scaling.PARTS) - {"control"}
    for table in ("bytes", "operations", "fraction"):
        assert set(found[table]) == judged
        assert min(every_number(found[table])) > 0


def test_the_exponent_is_that_of_a_power_law():
    sizes = np.array([50, 100, 400])
    assert scaling.fitted_exponent(sizes, 3e-5 * sizes**1.1) == pytest.approx(1.1)
    assert "exponent" not in bench.bench_scaling((SMALL,), LEVEL, budget=0.0)


COUNTS = roofline.Counts(
    nodes=1000,
    particle_nodes=900,
    points=3000,
    mesh=(32, 64),
    pairs=50_000,
    rigid=400,
    listed=60_000,
    touching=2000,
)


def test_loads_hold_the_least_that_must_be_done():
    found = roofline.loads(COUNTS)
    window = 2 * 2 * 1000 * WIDTH**2
    mesh = 16 * (32 + WIDTH) * (64 + WIDTH)
    for part in ("spread", "gather"):
        assert window < found[part].operations < 2.2 * window
        assert found[part].bytes > mesh
    assert found["fft"].operations == 2048 * (2 * 5 * 11 + 10)
    # Two vectors of two components, each times a scalar and a projection, for each pair.
    assert found["near"].operations > 24 * 50_000
    assert found["near"].bytes > 4 * 60_000


@pytest.mark.parametrize(
    ("more", "parts"),
    [
        ({"nodes": 2000}, {"spread", "gather", "near", "contact", "quadrature"}),
        ({"particle_nodes": 999}, {"membrane"}),
        ({"points": 6000}, {"contact"}),
        ({"mesh": (64, 64)}, {"spread", "fft", "gather"}),
        ({"pairs": 55_000}, {"near"}),
        ({"listed": 70_000}, {"near"}),
        ({"touching": 3000}, {"contact"}),
    ],
)
def test_loads_grow_with_what_there_is_to_do(more, parts):
    before, after = roofline.loads(COUNTS), roofline.loads(replace(COUNTS, **more))
    assert {part for part in before if before[part] != after[part]} == parts
    for part in parts:
        assert after[part].bytes >= before[part].bytes
        assert after[part].operations >= before[part].operations


def test_the_roofline_is_the_slower_of_moving_and_calculating():
    machine = timing.Machine(bandwidth=10.0, rate=100.0)
    assert machine.attainable(20.0, 100.0) == 2.0
    assert machine.attainable(20.0, 500.0) == 5.0


def test_the_arithmetic_that_is_timed_is_done():
    arguments, values = np.linspace(0.5, 0.9, 5), np.empty(5)
    timing._evaluate(arguments, 3, values)
    wanted = [sum(x**k for k in range(timing.DEGREE)) + 3 * x**timing.DEGREE for x in arguments]
    np.testing.assert_allclose(values, wanted, rtol=1e-13)


def test_works_take_turns_in_their_order():
    seen = []
    least = timing.alternately({"a": lambda: seen.append("a"), "b": lambda: seen.append("b")}, 0.0)
    assert seen == ["a", "b"] * (1 + timing.FEWEST_ROUNDS)
    assert set(least) == {"a", "b"}
    assert all(0 <= seconds < math.inf for seconds in least.values())


@pytest.fixture(scope="module")
def peaks(tmp_path_factory):
    """The benchmark of memory with all its parts in this process, which spares their imports."""

    def here(stage, *words):
        memory._do(stage, *words[:-1], tmp_path_factory.getbasetemp() / "membranes.nc")
        return {memory.IMPORTED: 1.0, stage: memory.peak_memory()}

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(memory, "_in_a_child", here)
        return bench.bench_memory(SMALL, LEVEL, gap=GAP)


@pytest.mark.slow
def test_memory_is_that_of_each_part_alone():
    """The mesh of the paper's scheme has 768 x 5120 points, and its field and modes as many."""
    ballast = np.ones(60_000_000)  # What this process holds must not count in others.
    found = bench.bench_memory(SMALL, LEVEL)
    peak = found["peak"]
    assert set(peak) == {memory.IMPORTED, *memory.STAGES}
    for stage in memory.STAGES:
        assert peak[stage] > peak[memory.IMPORTED]
    # Half of it covers what kernels the two do not share.
    assert peak["paper"] - peak["level"] > 0.5 * 2 * 768 * 5120 * 8 / 2**20
    assert found["ratio"] == peak["paper"] / peak["level"]
    assert peak[memory.IMPORTED] < ballast.nbytes / 2**20 < memory.peak_memory()


def test_peak_memory_remembers_what_was_given_back():
    before = memory.peak_memory()
    ballast = np.ones(int((before + 50) * 2**20 / 8))
    size = ballast.nbytes / 2**20
    del ballast
    assert size < memory.peak_memory() < size + before + 100


def test_a_part_prints_its_peak(tmp_path, capsys):
    memory.main(["scene", str(SMALL), LEVEL, repr(GAP), str(tmp_path)])
    found = json.loads(capsys.readouterr().out)
    assert list(found) == [memory.IMPORTED, "scene"]
    assert 0 < found[memory.IMPORTED] <= found["scene"]
    assert (tmp_path / "membranes.nc").exists()


def test_a_part_that_fails_in_its_process_says_why(tmp_path, monkeypatch):
    broken = tmp_path / "python"
    broken.write_text("#!/bin/sh\necho a long story >&2\necho out of luck >&2\nexit 3\n")
    broken.chmod(0o755)
    monkeypatch.setattr(memory.sys, "executable", str(broken))
    with pytest.raises(SoftslipError, match=r"memory of level: .*\(out of luck\)"):
        memory._in_a_child("level", SMALL, LEVEL, GAP, tmp_path)


def test_trimmings_change_nothing_beyond_the_error_of_the_estimate(results):
    found = results["trimming"]
    changes = [f"{rate}_change" for rate in trimmed.RATES]
    for name in set(trimming.BASES) - {"outer gap", "1D profile", "rigid pairs"}:
        assert [found[key][name] for key in changes] == [0.0] * 3, name
    # One order of summation against another.
    assert max(found[key]["rigid pairs"] for key in changes) < 1e-6
    # The periodic images of a smaller gap are nearer, by what the still solvent lets through.
    assert found["shear_rate_wall_change"]["outer gap"] < 1e-3
    assert found["shear_rate_bulk_change"]["outer gap"] < 1e-3
    assert found["shear_rate_bulk_change"]["1D profile"] < 1e-3
    assert found["dilute"]["pairs"] == 0
    for key in ("shear_rate_wall_error", "slip_velocity_error"):
        assert all(0 < error < 0.1 for error in found[key].values()), key


def test_what_is_saved_is_a_share_of_the_run_that_does_it_all(results):
    found = results["trimming"]
    assert list(found["saved"]) == list(trimming.BASES)
    for name, share in found["saved"].items():
        dilute = name.startswith("contact")
        whole = found["dilute"]["core_seconds"] if dilute else found["core_seconds"]
        saved = found["untrimmed_seconds"][name] - found["trimmed_seconds"][name]
        assert share == pytest.approx(saved / (whole + saved)), name
    assert found["evaluations"] > found["steps"] > 0
    # A sample of every state, the first and the last included.
    assert found["samples"] == pytest.approx(found["steps"] + 1)
    assert 0 < found["searches"] <= found["evaluations"]


@pytest.mark.parametrize("keep", [True, False])
def test_contacts_without_trimmings_are_the_same_contacts(flowing, keep):
    """Particles are pressed against each other here, so that there are forces to compare."""
    searching = trimming_contacts.Searching(flowing.parameters, flowing.layout, keep=keep)
    positions = flowing.suspension.positions(flowing.state)
    solver = scenes.plain_sum(flowing.parameters, flowing.layout)
    product = Contacts(
        contact_law(flowing.parameters),
        flowing.parameters.channel.length,
        flowing.layout,
        (solver.near_pairs, solver.reach),
    )
    films, forces = [], []
    for contacts in (product, searching):
        forces.append(np.zeros_like(positions))
        films.append(contacts.add_forces(positions, forces[-1]))
    assert films[0] == films[1] < flowing.parameters.steric.length
    scale = np.abs(forces[0]).max()
    assert scale > 0
    # Only the order of sums may differ.
    np.testing.assert_allclose(forces[1], forces[0], atol=1e-12 * scale)


def test_a_change_is_relative_to_the_untrimmed_run():
    before = dict.fromkeys(trimmed.RATES, 2.0)
    after = before | {"slip_velocity": 2.5}
    found = trimmed.relative_change(before, after)
    assert found == {"shear_rate_wall": 0.0, "shear_rate_bulk": 0.0, "slip_velocity": 0.2}
    nothing = dict.fromkeys(trimmed.RATES, 0.0)
    assert set(trimmed.relative_change(nothing, nothing).values()) == {0.0}


def test_the_mesh_and_the_level_stay_together_from_one_state(travelled):
    assert travelled["time"] == [0.05, 0.1]
    assert set(travelled["series"]) == set(trajectory.QUANTITIES)
    for runs in travelled["series"].values():
        assert {name: len(values) for name, values in runs.items()} == dict.fromkeys(
            trajectory.RUNS, 2
        )
    rates = travelled["series"]["shear_rate_wall"]
    # The coarsest level is 5 % off the mesh at most; the same start, not the same run, is shown.
    np.testing.assert_allclose(rates["grid"], rates["fidelity"], rtol=0.05)
    assert rates["grid"] != rates["fidelity"] != rates["second_seed"]
    for kind, other in (("grid", "grid"), ("seed", "second_seed")):
        apart = np.array(rates[other]) - rates["fidelity"]
        wanted = np.linalg.norm(apart) / np.linalg.norm(rates["fidelity"])
        assert travelled[f"{kind}_difference"]["shear_rate_wall"] == pytest.approx(wanted)
    ratio = travelled["grid_difference"]["slip_velocity"]
    ratio /= travelled["seed_difference"]["slip_velocity"]
    assert travelled["difference_ratio"]["slip_velocity"] == pytest.approx(ratio)


def test_trajectories_have_a_box_with_a_bulk():
    given = trajectory.parameters_of(44, "paper", 0.5, seed=2)
    channel = given.channel
    assert len(particle_radii(given)) == 44
    assert channel.height / channel.length == pytest.approx(trajectory.ASPECT, rel=0.05)
    assert (given.seed, given.rheometer.stress) == (2, 0.5)
    mesh = trajectory.parameters_of(44, None, 0.5)
    assert (mesh.channel.outside, mesh.channel.outer_gap) == ("still", channel.outer_gap)
    assert (mesh.hydrodynamics.mobility, mesh.hydrodynamics.node_spacing) == ("grid", 1.42)
    assert (mesh.time_stepping.integrator, mesh.time_stepping.step) == ("euler", 0.002)


def test_means_are_integrals_between_edges(flowing, monkeypatch):
    """Samples of t² at uneven times, against the exact integral of the polygon through them."""
    parameters = scenes.parameters_of(SMALL, LEVEL, recording={"bulk_margin": 3.0})
    series = trajectory.Series(parameters, flowing.layout)
    times = [0.0, 0.1, 0.25, 0.3, 0.5]
    values = dict.fromkeys(trajectory.QUANTITIES, 0.0)
    monkeypatch.setattr(
        series._observer, "measure", lambda state, _: values | {"slip_velocity": state.time**2}
    )
    for step, time in enumerate(times):
        state = replace(flowing.state, time=time, step=step)
        series.visit(state, None)
    series.sample(state, None)
    assert series.samples == len(times)
    means = series.means(np.array([0.0, 0.25, 0.5]))["slip_velocity"]
    first = (0.1 * 0.01 + 0.15 * (0.01 + 0.0625)) / 2 / 0.25
    second = (0.05 * (0.0625 + 0.09) + 0.2 * (0.09 + 0.25)) / 2 / 0.25
    np.testing.assert_allclose(means, [first, second], rtol=1e-12)


def test_the_figure_of_trajectories_shows_each_run_and_how_far_they_part(travelled, tmp_path):
    dataset = bench.as_dataset(travelled)
    write_dataset(dataset, tmp_path / "t.nc", stage="bench", run="trajectory", title="t")
    figure = figures.trajectory(read_dataset(tmp_path / "t.nc", stage="bench"))
    rate, slip, rate_apart, slip_apart = figure.axes
    for axes, key in ((rate, "shear_rate_bulk"), (slip, "slip_velocity")):
        shown = [line.get_ydata() for line in axes.lines if len(line.get_xdata()) == 2][:3]
        runs = travelled["series"][key]
        wanted = [runs[name] for name in ("second_seed", "fidelity", "grid")]
        np.testing.assert_array_equal(shown, wanted)
    for axes, key in ((rate_apart, "shear_rate_bulk"), (slip_apart, "slip_velocity")):
        runs = travelled["series"][key]
        apart = np.abs(np.array(runs["grid"]) - runs["fidelity"])
        np.testing.assert_allclose(axes.lines[-1].get_ydata(), apart)
        assert f"mesh {100 * travelled['grid_difference'][key]:.2g} %" in axes.get_title()
    words = ["draw", "trajectory", tmp_path / "t.nc", "--output", tmp_path / "t.png"]
    said = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert said.exit_code == 0, said.output
    assert (tmp_path / "t.png").stat().st_size > 10_000


def test_the_command_line_tables_trimmings_with_their_errors(results, monkeypatch):
    asked = {}

    def fake(particles, fidelity, **options):
        asked.update(particles=particles, fidelity=fidelity)
        return results["trimming"]

    monkeypatch.setattr(bench, "bench_trimming", fake)
    said = call("trimming", "--particles", SMALL, "--fidelity", LEVEL)
    assert said.exit_code == 0, said.output
    assert asked == {"particles": SMALL, "fidelity": LEVEL}
    for name, share in results["trimming"]["saved"].items():
        (line,) = [line for line in said.stdout.splitlines() if line.startswith(f"│ {name} ")]
        assert f"{share:.1%}" in line
        assert f"± {results['trimming']['slip_velocity_error'][name]:.1e}" in line


def test_the_command_line_passes_on_what_a_trajectory_is_asked_for(travelled, monkeypatch):
    asked = {}

    def fake(*given, **options):
        with options["watch"]("grid") as report:
            report(1, 1, 0.5)
        asked.update(given=given, ageing=options["ageing"])
        return travelled

    monkeypatch.setattr(bench, "bench_trajectory", fake)
    options = ("--particles", SMALL, "--stress", 0.25, "--time", 3, "--fidelity", LEVEL)
    said = call("trajectory", *options, "--ageing", 1, "--json")
    assert said.exit_code == 0, said.output
    assert json.loads(said.stdout) == travelled
    assert asked == {"given": (SMALL, 0.25, 3.0, LEVEL), "ageing": 1.0}
    assert "grid: step 1 of 1" in said.stderr
    assert "seed_difference slip_velocity" in call("trajectory", *options).stdout


def test_every_figure_is_a_finite_number(results, peaks, travelled):
    for result in (*results.values(), peaks, travelled):
        numbers = list(every_number(result))
        assert len(numbers) > 5
        assert all(math.isfinite(number) for number in numbers)
        assert json.loads(json.dumps(result)) == result


def test_results_are_kept_with_their_units(results, peaks, travelled, tmp_path):
    for name, result in (*results.items(), ("memory", peaks), ("trajectory", travelled)):
        dataset = bench.as_dataset(result)
        write_dataset(dataset, tmp_path / "b.nc", stage="bench", run=name, title=name)
        back = read_dataset(tmp_path / "b.nc", stage="bench", run=name)
        for variable in dataset.variables:
            np.testing.assert_array_equal(back[variable].values, dataset[variable].values)
        bare = [key for key, value in back.data_vars.items() if not value.attrs.get("units")]
        assert not bare
    tables = bench.as_dataset(results["scaling"])
    assert tables["nanoseconds"].dims == ("part", "particles")
    assert list(tables["part"].values) == list(scaling.PARTS)
    assert np.isnan(tables["fraction"].sel(part="control")).all()
    assert tables["fraction"].isnull().sum() == tables.sizes["particles"]
    assert (
        float(tables["nanoseconds"].sel(part="fft", particles=SMALL))
        == (results["scaling"]["nanoseconds"]["fft"][1])
    )
    assert (
        float(bench.as_dataset(results["mobility"])["own_ratio"])
        == (results["mobility"]["own"]["ratio"])
    )


def test_a_figure_without_a_unit_is_refused():
    with pytest.raises(KeyError, match="warmth"):
        bench.as_dataset({"bench": "run", "warmth": 3.0})


def heights(axes):
    return [
        bar.get_height() for bar in axes.patches if isinstance(bar, matplotlib.patches.Rectangle)
    ]


def test_the_figure_shows_parts_and_ratios(results, peaks):
    scaled = bench.as_dataset(results["scaling"])
    larger = results["run"] | {"particles": 7 * SMALL, "ratio": 321.0}
    compared = (results["mobility"], results["run"], peaks, larger)
    figure = figures.benchmark(scaled, *map(bench.as_dataset, compared))
    left, right = figure.axes
    assert sum(heights(left)) == pytest.approx(
        float(np.maximum(scaled["nanoseconds"], 0).sum()), rel=1e-9
    )
    shown = [results["mobility"]["ratio"], results["mobility"]["own"]["ratio"]]
    shown += [results["run"]["ratio"], peaks["ratio"]]
    # The bars of the smaller size, and then those of the larger one.
    assert heights(right) == pytest.approx([*shown, larger["ratio"]])
    assert [text.get_text() for text in right.get_legend().get_texts()] == ["24", "168"]
    assert f"run ({LEVEL}): N = 24, 168" in figure.get_supxlabel()
    assert f"{results['scaling']['exponent']:.2f}" in left.get_title()
    figure.canvas.draw()


def test_the_figure_does_without_what_was_not_measured(results):
    alone = {**results["scaling"]}
    del alone["exponent"]
    figure = figures.benchmark(bench.as_dataset(alone))
    assert not heights(figure.axes[1])
    assert "N^" not in figure.axes[0].get_title()


def test_the_command_line_prints_one_object_and_its_progress_apart(results, tmp_path):
    path = tmp_path / "mobility.nc"
    options = ("--particles", SMALL, "--fidelity", LEVEL, "--budget", 0, "--output", path)
    said = call("mobility", *options, "--json")
    assert said.exit_code == 0, said.output
    found, expected = json.loads(said.stdout), results["mobility"]
    # All but the times comes out the same again.
    assert found["rms_error"] == expected["rms_error"]
    assert found["own"]["pairs"] == expected["own"]["pairs"]
    assert [line[:7] for line in said.stderr.splitlines()] == ["bench: "] * 3
    assert float(read_dataset(path, stage="bench", run="mobility")["ratio"]) == found["ratio"]


def test_the_command_line_prints_a_table_for_people(results):
    options = ("--particles", 16, "--particles", SMALL, "--fidelity", LEVEL, "--budget", 0)
    said = call("scaling", *options)
    assert said.exit_code == 0, said.output
    rows = {
        tuple(cell.strip() for cell in line.split("│")[1:3]): line.split("│")[3:5]
        for line in said.stdout.splitlines()
        if "│" in line
    }
    nodes = rows["nodes", "1"]
    assert [int(float(cell)) for cell in nodes] == pytest.approx(
        results["scaling"]["nodes"], rel=1e-3
    )
    for part in scaling.PARTS:
        assert (f"nanoseconds {part}", "ns") in rows
        assert ((f"fraction {part}", "1") in rows) == (part != "control")


def test_drawing_from_files_wants_the_scaling_first(results, tmp_path):
    for name in ("scaling", "run"):
        dataset = bench.as_dataset(results[name])
        write_dataset(dataset, tmp_path / f"{name}.nc", stage="bench", run=name, title=name)
    words = ["draw", "benchmark", tmp_path / "scaling.nc", tmp_path / "run.nc"]
    words += ["--output", tmp_path / "b.png"]
    said = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert said.exit_code == 0, said.output
    assert (tmp_path / "b.png").stat().st_size > 10_000
    words[2:4] = words[3:1:-1]
    said = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert said.exit_code == 1
    assert "run 'run', not 'scaling'" in said.output


def test_a_level_that_there_is_not_ends_in_one_line():
    for name in ("mobility", "memory"):
        said = call(name, "--fidelity", "perfect", "--particles", SMALL)
        assert said.exit_code == 2
        (line,) = [line for line in said.stderr.splitlines() if "bench: " not in line]
        assert "fidelity" in line
        assert "perfect" in line
    with pytest.raises(ConfigError, match="perfect"):
        scenes.parameters_of(SMALL, "perfect")


@pytest.mark.workflow
def test_the_workflow_measures_only_when_asked(tmp_path):
    copy_project(tmp_path)

    def jobs(*words):
        command = [sys.executable, "-m", "snakemake", *words]
        options = ["--cores", "1", "--dry-run", "--quiet", "rules"]
        said = subprocess.run(
            [*command, *options], cwd=tmp_path, capture_output=True, text=True, check=True
        )
        return dict(re.findall(r"^(\w+) +(\d+)$", said.stdout, re.M))

    figures = {"benchmark_figure": "1", "trajectory_figure": "1"}
    assert jobs("bench") == {"measure": "8", **figures, "bench": "1", "total": "11"}
    assert "measure" not in jobs()
