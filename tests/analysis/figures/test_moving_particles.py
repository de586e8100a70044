"""The movie of a sample."""

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from synthetic import LENGTH, shear_run

from softslip.analysis import figures
from softslip.analysis.figures.film_encoding import MOST_BYTES
from softslip.analysis.figures.moving_particles import moving_sample
from softslip.analysis.figures.shown import shown
from softslip.analysis.observables.contours import contours
from softslip.analysis.observables.non_affine_motion import non_affine_motion
from softslip.errors import DatasetError
from softslip.files import video
from softslip.files.products import MOVIE_SNAPSHOTS
from softslip.files.stamps import check_figure, read_labels

TIMES = (0.0, 5.0, 10.0, 17.5, 25.0, 30.0)
LABELS = {"title": "movie", "stage": "figure", "run": "0" * 16, "parents": []}


@pytest.fixture(scope="module")
def sample():
    return shear_run(0.5, 0.59, 3, snapshots=TIMES, duration=30.0)


@pytest.fixture(scope="module")
def movie(sample):
    return figures.draw("movie", sample)


@pytest.fixture(scope="module")
def saved(movie, tmp_path_factory):
    path = tmp_path_factory.mktemp("movie") / "movie.mp4"
    figures.save_figure(movie, path, LABELS, {"commit": "abc"})
    return path


def test_it_has_a_picture_for_each_snapshot_and_none_between(movie, saved):
    frames = list(video.frames(saved.read_bytes()))
    assert len(frames) == movie.count == len(TIMES)
    rows, columns = next(movie.pictures()).shape[:2]
    assert rows % 2 == columns % 2 == 0
    assert {pixels.shape for _, pixels in frames} == {(rows * 3 // 2, columns)}
    moments = [float(moment) for moment, _ in frames]
    assert moments == pytest.approx(np.arange(len(TIMES)) / movie.rate)
    assert saved.stat().st_size < MOST_BYTES


def test_the_same_run_gives_the_same_bytes(sample, saved, tmp_path):
    again = tmp_path / "movie.mp4"
    figures.save_figure(moving_sample(sample), again, LABELS, {"commit": "abc"})
    assert again.read_bytes() == saved.read_bytes()


def test_what_it_was_made_from_is_inside(saved):
    assert check_figure(saved) == read_labels(saved)
    assert {key: read_labels(saved)[key] for key in LABELS} == LABELS
    assert read_labels(saved)["provenance"] == {"commit": "abc"}


def test_each_picture_shows_its_snapshot(sample, movie):
    particles, walls = (each for each in movie.moving if isinstance(each, PolyCollection))
    clock, line = movie.moving[-1], movie.moving[-2]
    for number, time in enumerate(TIMES):
        movie.turn_to(number)
        assert rf"$t$ = {time:.4g} time units" in clock.get_text()
        assert r"$\sigma$ = 0.5, $\beta$ = 0.59" in clock.get_text()
        assert line.get_visible() == (time > 0)
        assert time == 0 or list(line.get_xdata()) == [time, time]
        nodes = np.concatenate([path.vertices[:-1] for path in particles.get_paths()])
        membranes, _ = contours(sample, number)
        # Those across the end of the period are seen twice, each time whole.
        assert len(particles.get_paths()) > len(membranes)
        every = {tuple(np.round((x % LENGTH, y), 9)) for x, y in np.concatenate(membranes)}
        assert {tuple(np.round((x % LENGTH, y), 9)) for x, y in nodes} == every
        assert len(walls.get_paths()) == 2
        _, speeds = non_affine_motion(sample, number)
        assert set(np.asarray(particles.get_array())) == set(speeds)


def test_colours_mean_the_same_in_all_pictures(movie):
    (particles, _) = (each for each in movie.moving if isinstance(each, PolyCollection))
    limits = set()
    for number in range(movie.count):
        movie.turn_to(number)
        limits.add((particles.norm.vmin, particles.norm.vmax))
    assert len(limits) == 1


def test_its_numbers_are_kept(sample, movie):
    series = shown(movie.figure)
    particles = [one for one in series if one.name == "particle"]
    assert [float(one.at["snapshot_time"].values) for one in particles] == list(TIMES)
    _, speeds = non_affine_motion(sample, 3)
    assert np.array_equal(particles[3].points["non_affine_speed"].values, speeds)
    assert particles[3].points["non_affine_speed"].unit == "1 / time unit"
    rates = {one.name for one in series} - {"particle"}
    assert rates == {"shear rate wall", "shear rate bulk"}


def test_too_few_snapshots_are_refused():
    few = shear_run(0.5, 0.59, 3, snapshots=TIMES[: MOVIE_SNAPSHOTS - 1], duration=30.0)
    with pytest.raises(DatasetError, match=r"has 4 snapshots, and a movie takes 5 or more; ask"):
        moving_sample(few)
    with pytest.raises(DatasetError, match="has 0 snapshots"):
        moving_sample(shear_run(0.5, duration=30.0))


def test_a_run_without_a_bulk_and_without_particles_is_shown(sample):
    bare = sample.drop_vars(["shear_rate_bulk", "slip_velocity"])
    nodes = bare["node_position"].sizes["node"] - 2 * int(bare.attrs["wall_nodes"])
    empty = bare.isel(node=slice(nodes, None), particle=slice(0, 0))
    for run, rates in ((bare, 1), (empty, 1)):
        movie = moving_sample(run)
        assert len(next(movie.pictures())) > 0
        assert len(movie.figure.axes[1].get_legend().get_texts()) == rates
