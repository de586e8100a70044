"""Kernels that grow closed elastic chains between walls without ever letting two of them cross.

Each membrane is a chain of nodes with unit mass. It moves under its tension (Eqs. 4-5) and the
repulsion of other chains and the walls, with momentum and drag; its area follows a prescribed
course exactly. Contacts act between nodes and the nearest points of other polygons, not between
nodes and nodes, so that even coarse chains slide over one another smoothly.
"""

import math
from typing import NamedTuple

import numpy as np

from softslip.simulation.segments import Candidates
from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IntArray

CONTACT_EXPONENT = 4
"""Steepness of the contact pressure P_c [(r / h)^4 - 1] at a gap h below the range r."""

STEP_FACTOR = 0.6
"""Time step over sqrt(Δs / K_e); the fastest vibration of a chain of unit masses allows 1."""

MOMENTUM = 0.98
"""Share of its velocity that a node keeps in a step."""

LARGEST_MOVE = 0.2
"""Longest move of a node in a step over its gap from other bodies: below 1/2, so that two
membranes, each moving towards the other, cannot cross."""

CLOSEST_GAP = 0.05
"""Gap over the contact range below which growth stops."""


class Chains(NamedTuple):
    """Closed chains, which node follows which, and what they are made of.

    Attributes
    ----------
    offsets
        First node of each chain and, last, the number of nodes, shape (chains + 1,).
    body, following, preceding
        Chain and neighbours of each node, shape (nodes,).
    rest_length
        Rest length Δs of the springs of each chain [length unit].
    start_area, target_area
        Area of each chain before and after growth [length unit squared].
    elastic_constant
        K_e [stress unit].
    """

    offsets: IntArray
    body: IntArray
    following: IntArray
    preceding: IntArray
    rest_length: FloatArray
    start_area: FloatArray
    target_area: FloatArray
    elastic_constant: float


class Surroundings(NamedTuple):
    """Walls, and the law of contact with them and with other chains.

    Attributes
    ----------
    length, height
        Period L_x and distance H of the walls' flat parts [length unit].
    bump_radius, bump_separation
        b, 0 for smooth walls, and B [length unit].
    contact_range, contact_pressure
        r [length unit] and P_c [stress unit] of the contact pressure.
    """

    length: float
    height: float
    bump_radius: float
    bump_separation: float
    contact_range: float
    contact_pressure: float


@compiled
def grow(
    position: FloatArray,
    velocity: FloatArray,
    chains: Chains,
    around: Surroundings,
    candidates: Candidates,
    skin: float,
    steps: tuple[int, int, int],
) -> tuple[int, float]:
    """Move all nodes in place until the list of candidates is used up or the last step is done.

    Parameters
    ----------
    position, velocity
        Nodes, shape (nodes, 2) [length unit; length unit per time step of a unit mass].
    chains, around
        What moves, and where.
    candidates, skin
        Segments within the contact range plus ``skin`` [length unit] of each node.
    steps
        Steps done before, steps in which areas grow, last step to do.

    Returns
    -------
    step, smallest_gap
        Steps done now, and the smallest gap [length unit] seen in the last of them.
    """
    step, ramp, last = steps
    origin = position.copy()
    force = np.empty_like(position)
    gap = np.empty(len(position))
    time_step = STEP_FACTOR * math.sqrt(chains.rest_length.min() / chains.elastic_constant)
    # Each of two nodes may use up half of the skin; the last move is bounded beforehand.
    allowed = 0.5 * skin - LARGEST_MOVE * around.contact_range
    moved = 0.0
    while step < last and moved < allowed:
        step += 1
        grown = min(step / ramp, 1.0)
        force[:] = 0.0
        gap[:] = around.contact_range
        _add_tension(position, chains, force)
        _add_walls(position, chains, around, force, gap)
        _add_contacts(position, chains, around, candidates, force, gap)
        for p in range(len(chains.rest_length)):
            size = (1.0 - grown) * math.sqrt(chains.start_area[p])
            size += grown * math.sqrt(chains.target_area[p])
            _move(p, position, velocity, chains, force, gap, time_step, size * size)
        moved = 0.0
        for i in range(len(position)):
            dx, dy = position[i, 0] - origin[i, 0], position[i, 1] - origin[i, 1]
            moved = max(moved, dx * dx + dy * dy)
        moved = math.sqrt(moved)
        if gap.min() < CLOSEST_GAP * around.contact_range:
            break
    return step, gap.min()


@compiled
def _add_tension(position: FloatArray, chains: Chains, force: FloatArray) -> None:
    """Add the membrane forces T τ of Eq. 5, with T = K_e (l / Δs - 1)."""
    for i in range(len(position)):
        k = chains.following[i]
        dx, dy = position[k, 0] - position[i, 0], position[k, 1] - position[i, 1]
        T_over_l = chains.elastic_constant * (
            1.0 / chains.rest_length[chains.body[i]] - 1.0 / math.sqrt(dx * dx + dy * dy)
        )
        force[i, 0] += T_over_l * dx
        force[i, 1] += T_over_l * dy
        force[k, 0] -= T_over_l * dx
        force[k, 1] -= T_over_l * dy


@compiled
def _pressure(h: float, around: Surroundings) -> float:
    return around.contact_pressure * ((around.contact_range / h) ** CONTACT_EXPONENT - 1.0)


@compiled
def _share(i: int, position: FloatArray, chains: Chains) -> float:
    """Return the length of membrane that belongs to a node: half of its two segments."""
    a, b = chains.following[i], chains.preceding[i]
    ax, ay = position[a, 0] - position[i, 0], position[a, 1] - position[i, 1]
    bx, by = position[b, 0] - position[i, 0], position[b, 1] - position[i, 1]
    return 0.5 * (math.sqrt(ax * ax + ay * ay) + math.sqrt(bx * bx + by * by))


@compiled
def _add_walls(
    position: FloatArray, chains: Chains, around: Surroundings, force: FloatArray, gap: FloatArray
) -> None:
    """Add the contact pressure of both walls, whose nearest points are known in closed form."""
    b, B = around.bump_radius, around.bump_separation
    for i in range(len(position)):
        for side in (1.0, -1.0):
            y = position[i, 1] if side > 0 else around.height - position[i, 1]
            if y >= b + around.contact_range:
                continue
            h, nx, ny = y, 0.0, 1.0
            if b > 0:
                x = position[i, 0] - B * (math.floor(position[i, 0] / B) + 0.5)
                r = math.sqrt(x * x + y * y)
                if r - b < h:
                    h, nx, ny = r - b, x / r, y / r
            if h < around.contact_range:
                f = _share(i, position, chains) * _pressure(h, around)
                force[i, 0] += f * nx
                force[i, 1] += f * ny * side
                gap[i] = min(gap[i], h)


@compiled
def _add_contacts(
    position: FloatArray,
    chains: Chains,
    around: Surroundings,
    candidates: Candidates,
    force: FloatArray,
    gap: FloatArray,
) -> None:
    """Add the contact pressure between each node and the nearest point of each other chain.

    Both membranes of a contact have nodes, so each node bears half of its share's pressure. The
    reaction goes to the ends of the segment that was met, by the lever rule.
    """
    for i in range(len(position)):
        m, last = candidates.starts[i], candidates.starts[i + 1]
        while m < last:
            other = chains.body[candidates.segment[m]]
            square, met, fraction = around.contact_range**2, -1, 0.0
            nx, ny = 0.0, 0.0
            while m < last and chains.body[candidates.segment[m]] == other:
                j = candidates.segment[m]
                k = chains.following[j]
                ux, uy = position[k, 0] - position[j, 0], position[k, 1] - position[j, 1]
                rx = position[i, 0] - position[j, 0] - candidates.shift[m]
                ry = position[i, 1] - position[j, 1]
                t = min(max((rx * ux + ry * uy) / (ux * ux + uy * uy), 0.0), 1.0)
                rx -= t * ux
                ry -= t * uy
                if rx * rx + ry * ry < square:
                    square, met, fraction, nx, ny = rx * rx + ry * ry, j, t, rx, ry
                m += 1
            if met >= 0:
                h, k = math.sqrt(square), chains.following[met]
                f_over_h = 0.5 * _share(i, position, chains) * _pressure(h, around) / h
                force[i, 0] += f_over_h * nx
                force[i, 1] += f_over_h * ny
                force[met, 0] -= (1.0 - fraction) * f_over_h * nx
                force[met, 1] -= (1.0 - fraction) * f_over_h * ny
                force[k, 0] -= fraction * f_over_h * nx
                force[k, 1] -= fraction * f_over_h * ny
                gap[i], gap[met], gap[k] = min(gap[i], h), min(gap[met], h), min(gap[k], h)


@compiled
def _move(
    p: int,
    position: FloatArray,
    velocity: FloatArray,
    chains: Chains,
    force: FloatArray,
    gap: FloatArray,
    dt: float,
    area: float,
) -> None:
    """Move one chain: velocities keep its area, and a shift along its gradient sets it.

    With g_i = ∂A/∂X_i, the velocity loses its component along g and the nodes move by
    (area - A) / |g|² g besides; no node moves farther than its gap allows.
    """
    low, high = chains.offsets[p], chains.offsets[p + 1]
    A, gg, vg = 0.0, 0.0, 0.0
    for i in range(low, high):
        a, b = chains.following[i], chains.preceding[i]
        gx = 0.5 * (position[a, 1] - position[b, 1])
        gy = 0.5 * (position[b, 0] - position[a, 0])
        A += 0.5 * ((position[i, 0] - position[low, 0]) * gx)
        A += 0.5 * ((position[i, 1] - position[low, 1]) * gy)
        velocity[i, 0] = MOMENTUM * velocity[i, 0] + dt * force[i, 0]
        velocity[i, 1] = MOMENTUM * velocity[i, 1] + dt * force[i, 1]
        gg += gx * gx + gy * gy
        vg += velocity[i, 0] * gx + velocity[i, 1] * gy
        # From here on the array holds the gradient of the area: the nodes are about to move.
        force[i, 0], force[i, 1] = gx, gy
    for i in range(low, high):
        gx, gy = force[i, 0], force[i, 1]
        velocity[i, 0] -= vg / gg * gx
        velocity[i, 1] -= vg / gg * gy
        dx = dt * velocity[i, 0] + (area - A) / gg * gx
        dy = dt * velocity[i, 1] + (area - A) / gg * gy
        move, limit = math.sqrt(dx * dx + dy * dy), LARGEST_MOVE * gap[i]
        share = limit / move if move > limit else 1.0
        position[i, 0] += share * dx
        position[i, 1] += share * dy
        velocity[i, 0] *= share
        velocity[i, 1] *= share
