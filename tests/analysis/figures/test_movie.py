"""Figures that move."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from softslip.analysis.figures.movie import FASTEST, SLOWEST, Movie, even_pixels


def rising(count):
    """A bar that rises."""
    figure = Figure(figsize=(1.0, 0.5), dpi=80)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, 1), ylim=(0, count))
    axes.set_axis_off()
    (line,) = axes.plot([0, 1], [0, 0], color="black", linewidth=10)
    return Movie(figure, count, (line,), lambda number: line.set_ydata([number + 0.5] * 2))


def test_each_picture_is_what_the_figure_was_turned_to():
    movie = rising(4)
    pictures = list(movie.pictures())
    assert [each.shape for each in pictures] == [(40, 80, 3)] * 4
    middles = [np.mean(np.flatnonzero(each[:, 40, 0] < 100)) for each in pictures]
    # Rows are counted from above.
    assert middles == pytest.approx([35, 25, 15, 5], abs=1.5)


def test_pictures_do_not_depend_on_those_before():
    movie = rising(3)
    first, again = list(movie.pictures()), list(movie.pictures())
    assert all(np.array_equal(*pair) for pair in zip(first, again, strict=True))


@pytest.mark.parametrize(
    ("count", "rate"), [(5, SLOWEST), (20, SLOWEST), (60, 6), (120, 12), (500, FASTEST)]
)
def test_pictures_are_held_long_enough(count, rate):
    assert rising(count).rate == rate


@pytest.mark.parametrize("inches", [1.0, 3.4, 4.17, 2.0063])
def test_sizes_are_even(inches):
    pixels = even_pixels(inches, 160) * 160
    assert round(pixels) % 2 == 0
    assert pixels == pytest.approx(round(pixels), abs=1e-9)
    assert abs(pixels - inches * 160) <= 1
