"""What the parts of an evaluation move and calculate, counted from their loops.

Bytes are those that must move once between the part and memory: arrays read, plus arrays written,
each as often as the part goes through it. Operations are additions and multiplications; a
division, a root, a rounding or a logarithm counts as one.
"""

import math
from dataclasses import dataclass

from softslip.solver.mobility.window import DEGREE, WIDTH

REAL, COMPLEX, INDEX, SHORT_INDEX = 8, 16, 8, 4
"""Bytes of a number."""

VECTOR = 2 * REAL
"""Bytes of a vector in the plane."""


@dataclass(frozen=True)
class Counts:
    """What there is to do in one evaluation.

    Attributes
    ----------
    nodes, particle_nodes
        All nodes, and those of membranes.
    points
        Contact points.
    mesh
        Lines of the far mesh along x and y.
    pairs, rigid, listed
        Near pairs within the reach, how many of them are rigid, and those that the list holds.
    touching
        Pairs of contact points that their list holds.
    """

    nodes: int
    particle_nodes: int
    points: int
    mesh: tuple[int, int]
    pairs: int
    rigid: int
    listed: int
    touching: int


@dataclass(frozen=True)
class Load:
    """Bytes moved and operations done by a part."""

    bytes: float
    operations: float


def loads(counts: Counts) -> dict[str, Load]:
    """Return the load of each part that is a kernel of its own.

    Parameters
    ----------
    counts
        What there is to do.
    """
    nx, ny = counts.mesh
    padded = (nx + WIDTH) * (ny + WIDTH)
    return {
        "spread": _spread(counts.nodes, padded),
        "fft": _fourier(nx * ny),
        "gather": _gather(counts.nodes, padded),
        "near": _near(counts),
        "contact": _contact(counts),
        "membrane": _membrane(counts.particle_nodes),
        "quadrature": _quadrature(counts.nodes),
    }


def _weights() -> int:
    """Operations for the window's weights of a point in both directions."""
    line = 2 * 2 * DEGREE + 3  # Two polynomials by Horner's rule, and their sum and difference.
    place = 9  # The place in the period, and t and t².
    return 2 * (place + WIDTH // 2 * line)


def _spread(nodes: int, padded: int) -> Load:
    # The mesh is cleared, read and written.
    moved = nodes * 2 * VECTOR + padded * 3 * VECTOR
    each = _weights() + 2 * WIDTH + WIDTH * 2 * WIDTH * 2
    return Load(moved, nodes * each)


def _gather(nodes: int, padded: int) -> Load:
    moved = nodes * 2 * VECTOR + padded * VECTOR
    each = _weights() + WIDTH * 2 * WIDTH * 2 + 2 * WIDTH * 2
    return Load(moved, nodes * each)


def _fourier(points: int) -> Load:
    # Each transform goes through the mesh once a direction; the response once, with one real and
    # one complex factor a mode.
    passes = 2 * 2 * 2 * COMPLEX
    response = 2 * COMPLEX + REAL + COMPLEX
    # The usual count of a complex transform; the response is a real times a complex number plus a
    # product of two complex ones.
    transforms = 2 * 5 * math.log2(points)
    return Load(points * (passes + response), points * (transforms + 2 + 6 + 2))


def _near(counts: Counts) -> Load:
    # A rigid pair has its symmetric matrix, the others their places in the list.
    moved = counts.listed * SHORT_INDEX + counts.nodes * (4 * VECTOR + INDEX)
    moved += counts.rigid * (3 * REAL + INDEX)
    distance, functions, velocities, matrix = 10, 8, 24, 16
    free = counts.pairs - counts.rigid
    operations = counts.listed * distance + free * (functions + velocities)
    return Load(moved, operations + counts.rigid * matrix)


def _contact(counts: Counts) -> Load:
    # Points are written and read once, as their moves since the list was built are, and forces
    # are cleared, written and carried back. Of the listed pairs few are close enough for a force.
    moved = counts.points * (6 * VECTOR + REAL + INDEX) + counts.nodes * 3 * VECTOR
    moved += counts.touching * INDEX
    interpolation, move, distance = 2 * 11, 10, 10
    operations = counts.points * (interpolation + move) + counts.touching * distance
    return Load(moved, operations)


def _membrane(nodes: int) -> Load:
    # Tension reads positions and adds to forces; the flux reads both and changes velocities.
    moved = nodes * (VECTOR + 2 * VECTOR + VECTOR + 3 * VECTOR)
    differences, tension, forces = 2 * 8, 9, 2 * 9
    normals, flux, area, correction = 2 * 8, 9, 6, 5
    each = differences + tension + forces + normals + flux + area + correction
    return Load(moved, nodes * each)


def _quadrature(nodes: int) -> Load:
    moved = nodes * (4 * VECTOR + 2 * INDEX)
    tangent, place, functions, projection, velocity = 10, 5, 12, 6, 10
    return Load(moved, nodes * (tangent + place + functions + projection + velocity))
