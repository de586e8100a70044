"""Figures that move: one picture after the other of the same figure."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

LENGTH = 10.0
"""How long a movie is where no picture is held too shortly or too long for it [s]."""

SLOWEST, FASTEST = 2, 12
"""Fewest and most pictures a second."""


@dataclass(frozen=True)
class Movie:
    """A figure and how it becomes each of several pictures.

    Attributes
    ----------
    figure
        Its size in pixels is even both ways.
    count
        Number of pictures.
    moving
        What differs from one picture to the next, in the order in which it is drawn: above all
        that stands still.
    turn_to
        Makes the figure the picture of a number from 0 on; takes them in any order.
    """

    figure: Figure
    count: int
    moving: tuple[Artist, ...]
    turn_to: Callable[[int], None]

    @property
    def rate(self) -> int:
        """Pictures a second: each is held long enough to be looked at."""
        return int(np.clip(round(self.count / LENGTH), SLOWEST, FASTEST))

    def pictures(self) -> Iterator[NDArray[np.uint8]]:
        """Yield the pictures, each of shape (rows, columns, 3)."""
        # Its methods have no types.
        canvas: Any = FigureCanvasAgg(self.figure)
        for artist in self.moving:
            # Left out when the whole figure is drawn.
            artist.set_animated(True)
        canvas.draw()
        still = canvas.copy_from_bbox(self.figure.bbox)
        for number in range(self.count):
            self.turn_to(number)
            canvas.restore_region(still)
            for artist in self.moving:
                self.figure.draw_artist(artist)
            yield np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3])


def even_pixels(inches: float, resolution: int) -> float:
    """Return the nearest length that is an even number of pixels [inch]."""
    return 2 * round(0.5 * inches * resolution) / resolution
