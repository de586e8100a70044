"""The two mobilities side by side: seconds per evaluation and how far the velocities differ."""

from typing import Any

import numpy as np

from softslip.config.parameters import Parameters
from softslip.simulation import assembly
from softslip.solver.geometry import FloatArray, Layout
from softslip.solver.mobility import Mobility
from softslip.studies import boxes, scenes
from softslip.studies.membrane_nodes import chain_offsets, on_nodes, renoded
from softslip.studies.timing import Tell, alternately, silent

MODES = 6
"""Fourier modes of a smooth force density along each membrane."""


def smooth_forces(coefficients: FloatArray, layout: Layout) -> FloatArray:
    """Return the node forces of a smooth force density, the same one whatever the nodes.

    Parameters
    ----------
    coefficients
        Of cosines and sines along each membrane and wall, shape (chains, 2, `MODES`, components).
    layout
        Nodes and their weights.

    Returns
    -------
    FloatArray
        Shape (nodes, 2). The total force of every membrane and wall is zero.
    """
    modes = np.arange(1, MODES + 1)
    parts = []
    for waves, count, offset in zip(
        coefficients, np.diff(layout.chains), chain_offsets(layout), strict=True
    ):
        angle = 2 * np.pi * (np.arange(count) + offset)[:, None] * modes / count
        parts.append(np.cos(angle) @ waves[0] + np.sin(angle) @ waves[1])
    forces: FloatArray = np.concatenate(parts) * layout.weights[:, None]
    return forces


def random_coefficients(layout: Layout) -> FloatArray:
    """Return coefficients for `smooth_forces`, the same for the same number of particles."""
    seed = np.random.SeedSequence(layout.particles, spawn_key=tuple(b"bench forces"))
    shape = (layout.particles + 2, 2, MODES, 2)
    return np.random.default_rng(seed).standard_normal(shape)


def difference(found: FloatArray, reference: FloatArray) -> dict[str, float]:
    """Return the rms and the largest difference of two velocity fields over the rms velocity."""
    scale = np.sqrt(np.mean(np.sum(reference**2, axis=1)))
    apart = np.sqrt(np.sum((found - reference) ** 2, axis=1))
    return {
        "rms_error": float(np.sqrt(np.mean(apart**2)) / scale),
        "max_error": float(apart.max() / scale),
    }


def bench_mobility(
    particles: int,
    fidelity: str = "paper",
    *,
    ageing: float = scenes.AGEING,
    budget: float = 5.0,
    tell: Tell = silent,
) -> dict[str, Any]:
    """Compare the mesh at dx = 1/8192 with the Ewald sum in one box, on aged membranes.

    First both get the same nodes, those of the paper, and the same forces: the difference is that
    of the two operators. Then each has its own nodes for the same membranes and the same smooth
    force density, and the velocities are compared at the material points of the level's nodes:
    the difference is all that the level's nodes, quadrature and regularisation change.

    Parameters
    ----------
    particles
        N.
    fidelity
        Level that gives the second comparison its nodes and its mobility.
    ageing
        Time at rest that shapes the membranes [time unit].
    budget
        Time for the repeats of each comparison [s].

    Returns
    -------
    dict
        With smooth forces on the same nodes: ``ratio`` of the seconds per evaluation
        ``grid_seconds`` and ``ewald_seconds``, ``rms_error`` and ``max_error`` over the rms
        velocity, numbers of ``nodes`` and near ``pairs``. Then ``real`` with the errors under the
        membrane and contact forces of the state, and ``own`` with the same keys where each has
        its own nodes (``nodes`` are the level's, ``grid_nodes`` the mesh scheme's).

    Raises
    ------
    SoftslipError
        When there is no such scene.
    """
    tell(f"making {particles} aged particles at fidelity {fidelity}")
    membranes = scenes.aged(particles, fidelity, ageing)
    paper = boxes.parameters_of(particles)
    fine = scenes.untethered(renoded(membranes, paper), paper)
    coarse = scenes.untethered(membranes, boxes.parameters_of(particles, fidelity))
    coefficients = random_coefficients(fine.layout)
    tell("comparing on the same nodes")
    same = _on_same_nodes(fine, coefficients, budget)
    tell("comparing on each scheme's own nodes")
    own = _on_own_nodes(fine, coarse, coefficients, budget)
    return {
        "bench": "mobility",
        "particles": particles,
        "fidelity": fidelity,
        **same,
        "own": own,
    }


def _on_same_nodes(fine: scenes.Scene, coefficients: FloatArray, budget: float) -> dict[str, Any]:
    """Compare both mobilities on the nodes of the paper."""
    positions = fine.suspension.positions(fine.state)
    forces = smooth_forces(coefficients, fine.layout)
    grid = assembly.solver_of(fine.parameters, fine.layout)
    ewald = scenes.plain_sum(by_ewald(fine), fine.layout)
    seconds = alternately(
        {
            "grid_seconds": lambda: grid.velocities(positions, forces),
            "ewald_seconds": lambda: ewald.velocities(positions, forces),
        },
        budget,
    )
    real, _ = fine.suspension.body_forces(positions)
    return {
        "ratio": seconds["grid_seconds"] / seconds["ewald_seconds"],
        **seconds,
        **_differences(ewald, grid, positions, forces),
        "nodes": fine.layout.nodes,
        "pairs": ewald.pairs,
        "real": _differences(ewald, grid, positions, real),
    }


def by_ewald(scene: scenes.Scene) -> Parameters:
    """Return the paper's scheme but for its mobility, which becomes the Ewald sum."""
    channel = scene.parameters.channel
    return boxes.parameters_of(
        scene.layout.particles, gap=channel.outer_gap, hydrodynamics={"mobility": "ewald"}
    )


def _differences(
    tried: Mobility, trusted: Mobility, positions: FloatArray, forces: FloatArray
) -> dict[str, float]:
    return difference(tried.velocities(positions, forces), trusted.velocities(positions, forces))


def _on_own_nodes(
    fine: scenes.Scene, coarse: scenes.Scene, coefficients: FloatArray, budget: float
) -> dict[str, Any]:
    """Compare the mesh on the paper's nodes with a level's mobility on its own."""
    grid = assembly.solver_of(fine.parameters, fine.layout)
    plain = scenes.plain_sum(coarse.parameters, coarse.layout)
    level = assembly.mobility_of(coarse.parameters, coarse.layout, plain)
    positions = [each.suspension.positions(each.state) for each in (fine, coarse)]
    forces = [smooth_forces(coefficients, each.layout) for each in (fine, coarse)]
    seconds = alternately(
        {
            "grid_seconds": lambda: grid.velocities(positions[0], forces[0]),
            "ewald_seconds": lambda: level.velocities(positions[1], forces[1]),
        },
        budget,
    )
    reference = on_nodes(grid.velocities(positions[0], forces[0]), fine.layout, coarse.layout)
    return {
        "ratio": seconds["grid_seconds"] / seconds["ewald_seconds"],
        **seconds,
        **difference(level.velocities(positions[1], forces[1]), reference),
        "nodes": coarse.layout.nodes,
        "grid_nodes": fine.layout.nodes,
        "pairs": plain.pairs,
    }
