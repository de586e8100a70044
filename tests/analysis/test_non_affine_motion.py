"""Non-affine speeds of particles, against flows and motions that are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import HEIGHT, LENGTH, RADIUS, generator, shear_run

from softslip.analysis.observables.contours import contours, shapes
from softslip.analysis.observables.non_affine_motion import (
    NEIGHBOURS,
    non_affine_motion,
    non_affine_speeds,
    particle_velocities,
)
from softslip.errors import DatasetError


@pytest.fixture(scope="module")
def sample():
    return shear_run(0.5, 0.59, 3, snapshots=(5.0, 17.5), duration=30.0)


def moved(run, flow):
    """The run with another velocity field, a function of place."""
    x, y = np.meshgrid(run["field_x"].values, run["field_y"].values)
    field = np.broadcast_to(np.stack(flow(x, y), axis=-1), run["velocity"].shape)
    return run.assign(velocity=(run["velocity"].dims, field.copy()))


def test_a_particle_moves_as_the_fluid_in_it_does_on_average(sample):
    run = moved(sample, lambda x, y: (0.3 + 2.0 * y, 0.1 - 0.5 * y))
    centroids, velocities = particle_velocities(run, 1)
    y = centroids[:, 1]
    # A particle has some tens of points, whose mean place is near its centroid.
    assert velocities[:, 0] == pytest.approx(0.3 + 2.0 * y, abs=2.0 * 0.1 * RADIUS)
    assert velocities[:, 1] == pytest.approx(0.1 - 0.5 * y, abs=0.5 * 0.1 * RADIUS)


def test_periods_do_not_matter(sample):
    """Of the particles; their flow has the period of the channel."""
    waves = moved(sample, lambda x, y: (np.sin(2 * np.pi * x / LENGTH) + y, 0 * y))
    shifted = waves.copy(deep=True)
    wall = 2 * int(shifted.attrs["wall_nodes"])
    shifted["node_position"][:, :-wall, 0] += 3 * LENGTH
    (_, speeds), (_, others) = (non_affine_motion(each, 0) for each in (waves, shifted))
    assert others == pytest.approx(speeds, rel=1e-9)


def test_an_affine_flow_has_no_non_affine_part(sample):
    run = moved(sample, lambda x, y: (0.3 + 2.0 * y, 0 * y))
    _, speeds = non_affine_motion(run, 0)
    scale = 2.0 * NEIGHBOURS
    assert np.nanmax(speeds) < 0.05 * scale, f"{np.nanmax(speeds):.3g} of {scale:.3g}"


random_gradients = st.lists(st.floats(-2, 2), min_size=6, max_size=6)


@settings(max_examples=30, deadline=None)
@given(gradient=random_gradients, seed=st.integers(0, 99))
def test_no_uniform_gradient_or_shift_changes_it(gradient, seed):
    random = generator(seed)
    places = np.column_stack((random.uniform(0, 0.2, 40), random.uniform(0, 1, 40)))
    velocities = random.normal(size=places.shape)
    affine = places @ np.reshape(gradient[:4], (2, 2)) + gradient[4:]
    # All within a part of a long period, so that images do not come in.
    before = non_affine_speeds(places, velocities, 10.0, 0.15)
    after = non_affine_speeds(places, velocities + affine, 10.0, 0.15)
    assert after == pytest.approx(before, abs=1e-9, nan_ok=True)
    assert np.isfinite(before).sum() >= 30


def test_it_is_the_limit_of_the_displacement_of_falk_and_langer():
    """The square root of D²_min over the time, of ever shorter ones."""
    random = generator(5)
    places = random.uniform(0, 1, (60, 2))
    velocities = random.normal(size=places.shape)
    found = non_affine_speeds(places, velocities, 10.0, 0.3)
    for number in range(60):
        offsets = places - places[number]
        far = np.hypot(*offsets.T)
        near = (far <= 0.3) & (far > 0)
        step = 1e-3
        after = offsets[near] + step * (velocities - velocities[number])[near]
        # Eqs. 2.11 to 2.14 of the paper, with a mean in place of the sum.
        strain = (after.T @ offsets[near]) @ np.linalg.inv(offsets[near].T @ offsets[near])
        least = np.mean(np.sum((after - offsets[near] @ strain.T) ** 2, axis=1))
        assert found[number] == pytest.approx(np.sqrt(least) / step, rel=1e-9)


def test_too_few_neighbours_say_nothing():
    places = np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1], [0.9, 0.9]])
    speeds = non_affine_speeds(places, np.ones((4, 2)), 10.0, 0.2)
    assert np.isnan(speeds).all()


def test_a_field_too_coarse_for_the_particles_is_refused(sample):
    coarse = sample.isel(field_x=slice(0, None, 10), field_y=slice(0, None, 10))
    with pytest.raises(DatasetError, match=r"no point inside particle \d+; set recording"):
        particle_velocities(coarse, 0)


def test_centroids_are_those_of_the_outlines(sample):
    centroids, speeds = non_affine_motion(sample, 1)
    assert np.array_equal(centroids, shapes(contours(sample, 1)[0])[0])
    assert speeds.shape == (len(centroids),)
    assert (centroids[:, 1] < HEIGHT).all()
