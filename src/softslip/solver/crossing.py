"""Whether membranes cross each other, themselves or a wall: exact for the polygons of the nodes."""

import math

import numpy as np

from softslip.errors import NumericalError
from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IntArray, Layout
from softslip.solver.neighbours import find_pairs

REACH = 0.75
"""Nodes closer than this many longest links are looked at: of two links that cross, two ends are
at most 1/√2 of the longer one apart."""

CROSSING_STEPS = 25
"""Steps between two searches for membranes that cross themselves."""


def check_crossing(
    positions: FloatArray, layout: Layout, length: float, film_thickness: float, step: int
) -> None:
    """Raise when membranes cross each other, themselves or a wall.

    Bodies cannot cross while the film between their nodes is thicker than `REACH` of a
    link, so that only thinner ones are looked at in every step; what only membranes can do to
    themselves is looked for every `CROSSING_STEPS` steps.

    Parameters
    ----------
    positions
        Of all nodes, walls included, shape (nodes, 2) [length unit].
    layout
        Which rows are which membrane or wall.
    length
        L_x [length unit].
    film_thickness
        Smallest distance between contact points of two bodies [length unit].
    step
        Number of the step.

    Raises
    ------
    NumericalError
        Naming a node whose link crosses another one.
    """
    if step % CROSSING_STEPS and film_thickness >= REACH * longest_link(positions, layout):
        return
    node = first_crossing(positions, layout, length)
    if node >= 0:
        raise NumericalError(
            "node_position",
            node,
            step,
            "begins a link that crosses another membrane, a wall, or its own membrane; use a "
            "smaller hydrodynamics.node_spacing, a smaller time_stepping.step ('euler'), or a "
            "larger steric.energy",
        )


def longest_link(positions: FloatArray, layout: Layout) -> float:
    """Return the largest distance of two neighbours along a membrane or a wall [length unit]."""
    return max(float(_longest_link(positions, layout.offsets)), layout.wall_spacing)


def first_crossing(positions: FloatArray, layout: Layout, length: float) -> int:
    """Return the first node whose link to the next one crosses another link, or -1.

    Parameters
    ----------
    positions
        Of all nodes, walls where they are now, shape (nodes, 2) [length unit].
    layout
        Which rows are which membrane or wall.
    length
        Period L_x [length unit].
    """
    link = longest_link(positions, layout)
    # Every particle node a body of its own, so that pairs within a membrane are found too.
    bodies = np.arange(layout.nodes)
    starts, partners = find_pairs(positions, bodies, layout.particle_nodes, length, REACH * link)
    if not partners.size:
        return -1
    return int(_first_crossing(positions, layout.chains, layout.body, length, starts, partners))


@compiled
def _longest_link(positions: FloatArray, offsets: IntArray) -> float:
    longest = 0.0
    for p in range(offsets.size - 1):
        before = offsets[p + 1] - 1
        for s in range(offsets[p], offsets[p + 1]):
            dx = positions[s, 0] - positions[before, 0]
            dy = positions[s, 1] - positions[before, 1]
            longest = max(longest, dx * dx + dy * dy)
            before = s
    return math.sqrt(longest)


@compiled
def _first_crossing(
    positions: FloatArray,
    chains: IntArray,
    body: IntArray,
    length: float,
    starts: IntArray,
    partners: IntArray,
) -> int:
    """Test the links at both sides of both nodes of every pair."""
    for i in range(starts.size - 1):
        for k in range(starts[i], starts[i + 1]):
            j = partners[k]
            for a in (i, _before(i, chains[body[i]], chains[body[i] + 1])):
                for b in (j, _before(j, chains[body[j]], chains[body[j] + 1])):
                    if _cross(positions, a, b, chains, body, length):
                        return a
    return -1


@compiled
def _before(node: int, first: int, end: int) -> int:
    return end - 1 if node == first else node - 1


@compiled
def _cross(
    positions: FloatArray, a: int, b: int, chains: IntArray, body: IntArray, length: float
) -> bool:
    """Return whether the links that begin at two nodes cross, nearest images; neighbours do not."""
    after_a = a + 1 if a + 1 < chains[body[a] + 1] else chains[body[a]]
    after_b = b + 1 if b + 1 < chains[body[b] + 1] else chains[body[b]]
    if a == b or after_a == b or after_b == a:
        return False
    x, y = positions[a, 0], positions[a, 1]
    ux, uy = _nearest(positions[after_a, 0] - x, length), positions[after_a, 1] - y
    px, py = _nearest(positions[b, 0] - x, length), positions[b, 1] - y
    vx = _nearest(positions[after_b, 0] - positions[b, 0], length)
    vy = positions[after_b, 1] - positions[b, 1]
    turn = ux * vy - uy * vx
    s, t = px * vy - py * vx, px * uy - py * ux
    if turn < 0.0:
        turn, s, t = -turn, -s, -t
    return bool(turn > 0.0 and 0.0 <= s <= turn and 0.0 <= t <= turn)


@compiled
def _nearest(dx: float, length: float) -> float:
    return dx - length * math.floor(dx / length + 0.5)
