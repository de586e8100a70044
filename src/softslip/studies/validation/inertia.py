"""The ellipse of inertia of what a membrane encloses, spectrally accurate."""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def moments(points: Array) -> tuple[float, Array, Array]:
    """Return area, centre and central second moments of what a membrane encloses.

    Green's theorem turns them into sums over the membrane, spectrally accurate on equally spaced
    nodes of a smooth one.

    Parameters
    ----------
    points
        Any number of nodes, anticlockwise, shape (nodes, 2).

    Returns
    -------
    area, centre, second_moments
        Of shapes (), (2,) and (2, 2), in powers of the points' unit.
    """
    count = len(points)
    modes = 1j * np.arange(count // 2 + 1)
    if count % 2 == 0:
        modes[-1] = 0.0
    tangent = np.fft.irfft(modes[:, None] * np.fft.rfft(points, axis=0), count, axis=0)
    (x, y), (dx, dy) = points.T, tangent.T
    weight = 2 * np.pi / count
    area = 0.5 * weight * float(np.sum(x * dy - y * dx))
    centre = weight / area * np.array([np.sum(x * x * dy), -np.sum(y * y * dx)]) / 2
    x, y = x - centre[0], y - centre[1]
    xx, yy = np.sum(x**3 * dy) / 3, -np.sum(y**3 * dx) / 3
    xy = np.sum(x * x * y * dy) / 2
    return area, centre, weight * np.array([[xx, xy], [xy, yy]])


def deformation(second_moments: Array) -> tuple[float, float]:
    """Return the Taylor deformation and the inclination of the ellipse of the same moments.

    Parameters
    ----------
    second_moments
        Central ones of the enclosed area, shape (2, 2).

    Returns
    -------
    taylor_deformation
        (L - B)/(L + B) of its long and short axes.
    inclination
        Angle of the long axis to the flow [degrees].
    """
    (small, large), axes = np.linalg.eigh(second_moments)
    long, short = math.sqrt(large), math.sqrt(small)
    x, y = axes[:, 1]
    return (long - short) / (long + short), math.degrees(math.atan2(y * np.sign(x), abs(x)))
