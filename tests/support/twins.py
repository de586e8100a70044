"""Plain NumPy twins of the compiled kernels: slow, short, and written from the equations."""

import math

import numpy as np

from softslip.solver.films import REFERENCE_NODE_SPACING


def minimum_image(dx, length):
    return dx - length * np.round(dx / length)


def links(positions, offsets, spacing, elastic_constant):
    """Rows (from, to) of every membrane link and the pull of "to" on "from" (Eq. 5)."""
    start, end, pull = [], [], []
    for first, stop, rest in zip(offsets[:-1], offsets[1:], spacing, strict=True):
        rows = np.arange(first, stop)
        after = np.roll(rows, -1)
        arm = positions[after] - positions[rows]
        distance = np.hypot(*arm.T)
        tension = elastic_constant * (distance / rest - 1)
        start.append(rows)
        end.append(after)
        pull.append((tension / distance)[:, None] * arm)
    return np.concatenate(start), np.concatenate(end), np.concatenate(pull)


STAGGERED = {2: (1.0,), 6: (75 / 64, -25 / 384, 3 / 640)}
"""Weights of the differences across 1, 3, 5 spacings in Δs d/ds half-way between two nodes."""

CENTRAL = {2: (1 / 2,), 6: (3 / 4, -3 / 20, 1 / 60)}
"""Weights of the differences across 2, 4, 6 spacings in Δs d/ds at a node."""


def staggered_difference(ring, order):
    """Δs dX/ds of a closed ring half-way from each node to the next."""
    pairs = enumerate(STAGGERED[order])
    return sum(c * (np.roll(ring, -k - 1, axis=0) - np.roll(ring, k, axis=0)) for k, c in pairs)


def central_difference(ring, order):
    """Δs dX/ds of a closed ring at each node."""
    pairs = enumerate(CENTRAL[order], start=1)
    return sum(c * (np.roll(ring, -k, axis=0) - np.roll(ring, k, axis=0)) for k, c in pairs)


def membrane_energy(positions, offsets, spacing, elastic_constant, order=2):
    """Σ K_e (|ΔX| - Δs)²/(2 Δs), whose gradient is minus the membrane force."""
    total = 0.0
    for first, stop, rest in zip(offsets[:-1], offsets[1:], spacing, strict=True):
        distance = np.hypot(*staggered_difference(positions[first:stop], order).T)
        total += elastic_constant * np.sum((distance - rest) ** 2) / (2 * rest)
    return total


def membrane_forces(positions, offsets, spacing, elastic_constant, order):
    """Tension of each half-way point carried to its nodes by the transposed difference."""
    forces = np.zeros_like(positions)
    for first, stop, rest in zip(offsets[:-1], offsets[1:], spacing, strict=True):
        arm = staggered_difference(positions[first:stop], order)
        distance = np.hypot(*arm.T)
        pull = (elastic_constant * (distance / rest - 1) / distance)[:, None] * arm
        for k, c in enumerate(STAGGERED[order]):
            forces[first:stop] += c * (np.roll(pull, -k, axis=0) - np.roll(pull, k + 1, axis=0))
    return forces


def membrane_area(ring, order):
    """½ Σ X × D₁X Δs about the mean of the nodes."""
    x, y = (ring - ring.mean(axis=0)).T
    dx, dy = central_difference(ring, order).T
    return 0.5 * float(np.sum(x * dy - y * dx))


def refined_chain(chain, jump, factor):
    """Points at s + q/factor of one closed chain: the quintic through the nodes s-2 ... s+3."""
    nodes = np.arange(-2, 4)
    count = len(chain)
    points = np.empty((count, factor, 2))
    for s in range(count):
        near = chain[(s + nodes) % count].copy()
        near[:, 0] += jump * ((s + nodes) // count)
        quintic = np.linalg.solve(np.vander(nodes.astype(float)), near - chain[s])
        for q in range(factor):
            points[s, q] = chain[s] + [np.polyval(quintic[:, axis], q / factor) for axis in (0, 1)]
    return points.reshape(-1, 2)


def close_pairs(positions, body, walls_from, length, reach):
    """Every pair i < j of different bodies, not both walls, nearer than the reach."""
    first, second = [], []
    for i in range(len(positions) - 1):
        arm = positions[i + 1 :] - positions[i]
        arm[:, 0] = minimum_image(arm[:, 0], length)
        near = np.sum(arm**2, axis=1) < reach**2
        near &= body[i + 1 :] != body[i]
        near &= (body[i + 1 :] < walls_from) | (body[i] < walls_from)
        found = np.flatnonzero(near) + i + 1
        first.append(np.full(len(found), i))
        second.append(found)
    if not first:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    return np.concatenate(first), np.concatenate(second)


def pair_scale(weights, first, second, energy, reading):
    """K_LJ of each pair: Eq. 22's at the paper's spacing, in proportion to both weights."""
    power = 2 if reading == "energy" else 1
    return energy * weights[first] * weights[second] / REFERENCE_NODE_SPACING**power


def contact_energy(positions, weights, pairs, length, contact_range, energy, reading):
    """Σ 4 K_LJ [3 (σ/r)^8 - 4 (σ/r)^6 + 1] over pairs within σ: Eq. 22, shifted to 0 there."""
    first, second = pairs
    arm = positions[second] - positions[first]
    ratio = contact_range / np.hypot(minimum_image(arm[:, 0], length), arm[:, 1])
    ratio = np.maximum(ratio, 1.0)
    scale = pair_scale(weights, first, second, energy, reading)
    return float(np.sum(4 * scale * (3 * ratio**8 - 4 * ratio**6 + 1)))


def contact_pushes(positions, weights, pairs, length, contact_range, energy, reading):
    """Push of "second" on "first" of each pair, minus the derivative of Eq. 22, (pairs, 2)."""
    first, second = pairs
    arm = positions[second] - positions[first]
    arm[:, 0] = minimum_image(arm[:, 0], length)
    distance = np.hypot(*arm.T)
    ratio = contact_range / distance
    scale = pair_scale(weights, first, second, energy, reading)
    size = np.where(distance < contact_range, 96 * scale / distance * (ratio**8 - ratio**6), 0.0)
    return -(size / distance)[:, None] * arm


def contact_forces(positions, weights, pairs, *law):
    pushes = contact_pushes(positions, weights, pairs, *law)
    forces = np.zeros_like(positions)
    np.add.at(forces, pairs[0], pushes)
    np.add.at(forces, pairs[1], -pushes)
    return forces


def evaluate_kernel(offsets):
    """Return the kernel φ at each offset, in units of the mesh size (Eq. 16 as printed)."""
    values = np.empty_like(offsets)
    for i in range(offsets.size):
        x = abs(offsets[i])
        if x <= 0.5:
            values[i] = 3 / 8 + math.pi / 32 - x * x / 4
        elif x <= 1.5:
            root = math.sqrt(max(-2 + 8 * x - 4 * x * x, 0.0))
            angle = math.asin(min(max(math.sqrt(2.0) * (x - 1), -1.0), 1.0))
            values[i] = 1 / 4 + (1 - x) / 8 * root - angle / 8
        elif x <= 2.5:
            root = math.sqrt(max(-14 + 16 * x - 4 * x * x, 0.0))
            angle = math.asin(min(max(math.sqrt(2.0) * (x - 2), -1.0), 1.0))
            values[i] = (
                17 / 16 - math.pi / 64 - 3 * x / 4 + x * x / 8 + (x - 2) / 16 * root + angle / 16
            )
        else:
            values[i] = 0.0
    return values


def mesh_velocity(solver, positions, forces):
    """Velocity D × (ψ ẑ) of the mesh scheme on its mesh, shape (N_x, N_y, 2) (Eqs. 9 and 12)."""
    psi = solver.streamfunction(positions, forces)
    along = np.roll(psi, -1, axis=1) - np.roll(psi, 1, axis=1)
    across = np.roll(psi, 1, axis=0) - np.roll(psi, -1, axis=0)
    return np.stack((along, across), axis=-1) / (2 * solver.mesh_size)
