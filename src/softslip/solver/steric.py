"""Contact repulsion between nodes of different bodies (Eqs. 2 and 22)."""

import math

import numpy as np

from softslip.solver.compilation import compiled, compiled_exactly
from softslip.solver.geometry import FloatArray, IndexArray, IntArray


@compiled_exactly
def add_contacts(
    positions: FloatArray,
    weights: FloatArray,
    starts: IntArray,
    partners: IndexArray | IntArray,
    length: float,
    contact_range: float,
    strength: float,
    forces: FloatArray,
) -> float:
    """Add the contact forces and return the smallest distance between nodes of two bodies.

    The pair force is c w_i w_j (96/r) [(σ_LJ/r)^8 - (σ_LJ/r)^6], minus the derivative of Eq. 22,
    repulsive below σ_LJ, where it is cut off and vanishes.

    Parameters
    ----------
    positions, weights
        Shape (nodes, 2) and (nodes,) [length unit]; x periodic with ``length``.
    starts, partners
        Pairs of `solver.neighbours.find_pairs`, complete within ``contact_range``; partners
        best as unsigned numbers, which spare the loop a test for negative ones.
    contact_range
        σ_LJ [length unit].
    strength
        c of `contact_strength`.
    forces
        Added to, shape (nodes, 2).

    Returns
    -------
    float
        Smallest distance, or infinity when nothing is within the range.
    """
    cutoff = contact_range * contact_range
    closest, per_length = math.inf, 1.0 / length
    for i in range(starts.size - 1):
        if starts[i] == starts[i + 1]:
            continue
        own_x, own_y = 0.0, 0.0
        scale = 96.0 * strength * weights[i]
        for k in range(starts[i], starts[i + 1]):
            j = partners[k]
            dx = positions[j, 0] - positions[i, 0]
            dx -= length * np.floor(dx * per_length + 0.5)
            dy = positions[j, 1] - positions[i, 1]
            squared = dx * dx + dy * dy
            if squared >= cutoff:
                continue
            closest = min(closest, squared)
            inverse = 1.0 / squared
            ratio = cutoff * inverse
            force = scale * weights[j] * ratio * ratio * ratio * (ratio - 1.0) * inverse
            own_x -= force * dx
            own_y -= force * dy
            forces[j, 0] += force * dx
            forces[j, 1] += force * dy
        forces[i, 0] += own_x
        forces[i, 1] += own_y
    return math.sqrt(closest)


@compiled
def closing_rate(
    positions: FloatArray,
    velocities: FloatArray,
    starts: IntArray,
    partners: IndexArray | IntArray,
    length: float,
    contact_range: float,
) -> float:
    """Return the largest -(d/dt) ln r over pairs within the contact range, at least 0.

    Parameters
    ----------
    positions, velocities
        Shape (nodes, 2); x periodic with ``length``.
    starts, partners, contact_range
        As for `add_contacts`.
    """
    cutoff = contact_range * contact_range
    fastest = 0.0
    for i in range(starts.size - 1):
        for k in range(starts[i], starts[i + 1]):
            j = partners[k]
            dx = positions[j, 0] - positions[i, 0]
            dx -= length * np.floor(dx / length + 0.5)
            dy = positions[j, 1] - positions[i, 1]
            squared = dx * dx + dy * dy
            if squared < cutoff:
                approach = dx * (velocities[i, 0] - velocities[j, 0])
                approach += dy * (velocities[i, 1] - velocities[j, 1])
                fastest = max(fastest, approach / squared)
    return fastest
