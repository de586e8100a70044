"""Two membranes a film apart: what the sum over their nodes makes of smooth forces."""

import math
from typing import ClassVar

import numpy as np

from softslip.config.fields import quantity
from softslip.config.parameters import Parameters
from softslip.solver.films import REFERENCE_MESH_SIZE
from softslip.solver.geometry import FloatArray, Layout
from softslip.solver.mobility.grid import regularisation_length
from softslip.solver.mobility.quadrature import CorrectedQuadrature
from softslip.studies.validation.case import Case, Outcome
from softslip.studies.validation.solvent_channel import level_of
from softslip.studies.validation.unbounded import Unbounded

SHAPES = (((0.0095, 0.0075), 0.3, -1.0), ((0.008, 0.009), -0.4, 1.0))
"""Half-axes [length unit], tilt and side of the film of the two ellipses."""

PERIMETERS = (0.0536, 0.0535)
"""Their circumferences [length unit]."""

MODES = 4
"""Waves along a membrane that the forces are made of."""

CONVERGED = 1.1
"""Node spacing over ε of the reference: its plain sum misses e^{-(2π/1.1)²} = 1e-14."""

LIMIT = 1e-3
"""Acceptable error: well below what the steps in time cost."""


class Quadrature(Case):
    """Velocities at the nodes of two membranes, against a sum over so many nodes that it is exact.

    The kernel is that of unbounded fluid, in closed form, so that the quadrature alone errs.
    """

    name: ClassVar[str] = "quadrature"
    summary: ClassVar[str] = (
        "Velocities of two membranes a film apart, by the sum over their nodes."
    )
    units: ClassVar[dict[str, tuple[str, str]]] = {
        "nodes": ("1", "number of nodes of both membranes"),
        "plain": ("1", "error without correction, largest over largest velocity"),
        "corrected": ("1", "error with correction, largest over largest velocity"),
        "velocity": ("1", "error of the level's own rule, largest over largest velocity"),
    }

    node_spacing: float | None = quantity(
        None,
        symbol="Δs/dx",
        unit="1",
        ge=0.5,
        le=16,
        description="Distance of nodes over the paper's mesh size; null takes the level's.",
    )
    regularisation: float | None = quantity(
        None,
        symbol="ε/dx",
        unit="1",
        ge=0.05,
        le=8,
        description="Regularisation length over the paper's mesh size; null takes the level's.",
    )
    film: float = quantity(
        7.0,
        symbol="h/dx",
        unit="1",
        ge=1,
        le=100,
        description="Distance of the two membranes over the paper's mesh size.",
    )
    stretch: float = quantity(
        0.3,
        symbol="λ",
        unit="1",
        ge=0,
        le=0.8,
        description="Uneven stretch: node spacings vary by (1 + λ)/(1 - λ).",
    )
    seed: int = quantity(7, symbol="seed", unit="1", ge=0, description="Seed of the forces.")

    def solve(self) -> Outcome:
        """Compare plain and corrected sums with the converged one."""
        given = Parameters.from_mapping({"fidelity": level_of(self.fidelity)}).hydrodynamics
        spacing = (self.node_spacing or given.node_spacing) * REFERENCE_MESH_SIZE
        wanted = self.regularisation or given.regularisation
        ratio = wanted or regularisation_length(1.0, given.symbol)
        counts, plain, corrected = self._errors(spacing, ratio * REFERENCE_MESH_SIZE)
        own = corrected if given.quadrature == "corrected" else plain
        return self.outcome(
            {"nodes": float(sum(counts)), "plain": plain, "corrected": corrected},
            {"plain": 0.0, "corrected": 0.0},
            {"velocity": own},
            {"velocity": LIMIT},
        )

    def _errors(self, spacing: float, regularisation: float) -> tuple[list[int], float, float]:
        counts = [max(round(length / spacing), 8) for length in PERIMETERS]
        # The widest spacing is this much wider than the mean, about.
        finer = math.ceil(1.4 * (1 + self.stretch) * spacing / (CONVERGED * regularisation))
        nodes, forces = self.membranes(counts)
        fine_nodes, fine_forces = self.membranes([finer * count for count in counts])
        direct, count = Unbounded(regularisation, 1.0), sum(counts)
        exact = direct.velocities_at(np.concatenate(nodes), np.concatenate(fine_nodes), fine_forces)
        layout = _layout(nodes)
        walls = layout.wall_reference.reshape(-1, 2)
        positions = np.concatenate((*nodes, walls))
        forces = np.concatenate((forces, np.zeros_like(walls)))
        sums = (direct, CorrectedQuadrature(direct, layout, 1.0, regularisation, 1.0))
        found = [rule.velocities(positions, forces)[:count] for rule in sums]
        plain, corrected = (
            float(np.abs(each - exact).max() / np.abs(exact).max()) for each in found
        )
        return counts, plain, corrected

    def membranes(self, counts: list[int]) -> tuple[list[FloatArray], FloatArray]:
        """Return the nodes of two ellipses a film apart, and balanced forces, smooth along them.

        The nodes are equally spaced in a material coordinate whose distance on the curve varies,
        apart from what the ellipse itself does.
        """
        nodes, forces = [], []
        for side, (axes, tilt, away) in enumerate(SHAPES):
            t = 2 * np.pi * np.arange(counts[side]) / counts[side]
            angle = t + self.stretch * np.sin(t + away)
            x, y = axes[0] * np.cos(angle), axes[1] * np.sin(angle)
            c, s = math.cos(tilt), math.sin(tilt)
            half_width = math.hypot(axes[0] * c, axes[1] * s)
            centre = away * (half_width + 0.5 * self.film * REFERENCE_MESH_SIZE)
            nodes.append(np.column_stack((c * x - s * y + centre, s * x + c * y)))
            random = np.random.default_rng(np.random.SeedSequence((self.seed, side)))
            modes = random.standard_normal((MODES, 2)) + 1j * random.standard_normal((MODES, 2))
            density = (np.exp(1j * np.outer(t, np.arange(1, MODES + 1))) @ modes).real
            forces.append(density * (2 * np.pi / counts[side]))
        return nodes, np.concatenate(forces)


def _layout(nodes: list[FloatArray]) -> Layout:
    """Return the layout of membranes between two far walls."""
    offsets = np.append(0, np.cumsum([len(ring) for ring in nodes])).astype(np.int64)
    spacing = np.array(
        [np.hypot(*(np.roll(ring, -1, axis=0) - ring).T).sum() / len(ring) for ring in nodes]
    )
    along = np.arange(4) / 4
    walls = np.stack([np.column_stack((along, np.full(4, y))) for y in (-3.0, 3.0)])
    return Layout(offsets, spacing, walls, float(spacing.mean()))
