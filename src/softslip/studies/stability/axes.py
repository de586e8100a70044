"""The axes of the map: which cells each has, from its values in the design."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from softslip.config.parameters import Parameters
from softslip.solver.films import REFERENCE_MESH_SIZE
from softslip.studies import boxes
from softslip.studies.boxes import Tree, merged, particle_area
from softslip.studies.stability.cells import Cell, cells_along
from softslip.studies.stability.longest_steps import spectral_radius
from softslip.studies.stability.map_design import MapDesign
from softslip.studies.stability.map_scenes import (
    NARROW,
    SCHEMES,
    Scheme,
    dense,
    in_scheme,
    scene_of,
    start_tree,
)

WIDEST = 0.65
"""Node spacing over the contact range where the range is the axis, just below what is allowed."""

FEWEST_STEPS = 64
"""Steps of a cell at least, where its step is long; a multiple of the looks at it."""

REST_LENGTH, REST_HEIGHT, COARSE = 1 / 32, 0.03, 2
"""Box of a particle at rest [length unit], and its mesh size over the paper's. The forces by which
places within a cell of the mesh differ fall with the cube of its size: at 4 they move the particle
by 0.02 contact ranges in a million steps."""

REST_STEP = 1e-3
"""Explicit step at the level, whose shorter regularisation makes forces of nodes stiffer than those
of the mesh: it is unstable from 1.9e-3 on [time unit]."""

FASTEST = 5.0
"""Stress that shears walls past many periods [stress unit]."""

MATERIAL: Mapping[str, tuple[str, str, str, float]] = {
    "stress": ("stresses", "rheometer", "stress", 2.0),
    "membrane_modulus": ("membrane_moduli", "membrane", "elastic_constant", 1.0),
    "wall_stiffness": ("wall_stiffnesses", "wall", "stiffness", 0.0),
    "contact_energy": ("contact_energies", "steric", "energy", 0.0),
}
"""Axes that change one parameter of the dense scene: its values in the design, its group and key,
and how much faster runs become for each unit of it."""


def _material(axis: str) -> Callable[[MapDesign], list[Cell]]:
    values, group, key, speed = MATERIAL[axis]

    def cells(design: MapDesign) -> list[Cell]:
        starts = dict.fromkeys(getattr(design, values), dense(design))
        return cells_along(
            axis, design, starts, change=lambda value: {group: {key: value}}, speed=speed
        )

    return cells


def _euler_steps(design: MapDesign) -> list[Cell]:
    start = dense(design)
    tree = in_scheme(design, start, "literal")
    limit = 2.0 / spectral_radius(scene_of(start, tree))
    # A whole number of steps to each look, so that none is cut short.
    count = {
        value: max(math.ceil(design.duration / (value * limit) / FEWEST_STEPS), 1) * FEWEST_STEPS
        for value in design.steps
    }
    return [
        Cell(
            "step_euler",
            f"{value:g}",
            value,
            "literal",
            merged(tree, {"time_stepping": {"step": value * limit}}),
            start,
            count[value] * value * limit,
        )
        for value in design.steps
    ]


def _adaptive_steps(integrator: str) -> Callable[[MapDesign], list[Cell]]:
    """Return a function of cells of an integrator that adapts its steps.

    At its loosest tolerance, asked for steps over the Euler limit.
    """

    def cells(design: MapDesign) -> list[Cell]:
        start = dense(design)
        limit = 2.0 / spectral_radius(scene_of(start, start))

        def stepping(value: float) -> Tree:
            return {
                "integrator": integrator,
                "step": value * limit,
                "longest_step": max(value * limit, 1.0 if value >= 1 else 0.0),
                "tolerance": 0.1,
            }

        return [
            Cell(
                f"step_{integrator}",
                f"{value:g}",
                value,
                "standard",
                merged(start, {"time_stepping": stepping(value)}),
                start,
                design.duration,
            )
            for value in design.steps
        ]

    return cells


def _contact_ranges(design: MapDesign) -> list[Cell]:
    """Return cells of the paper's ε, of particles grown with films in proportion to the range."""
    starts = {}
    for value in design.contact_ranges:
        spacing = min(5.0, WIDEST * value)
        starts[value] = merged(
            start_tree(design, 6, 3 / 64),
            {
                "steric": {"length": value * REFERENCE_MESH_SIZE},
                "hydrodynamics": {"node_spacing": spacing, "regularisation": None},
                "expansion": {"contact_length": 0.00125 * value / 9},
            },
        )
    cells = cells_along("contact_range", design, starts, schemes=("standard",))
    return [replace(cell, criterion="sharper") for cell in cells]


def _roughnesses(design: MapDesign) -> list[Cell]:
    length = boxes.channel_sides(design.particles)[0]
    starts = {
        value: start_tree(design, design.particles, length, roughness=value)
        for value in design.roughnesses
    }
    return cells_along("roughness", design, starts)


def _area_fractions(design: MapDesign) -> list[Cell]:
    length = boxes.channel_sides(design.particles)[0]
    starts = {
        value: start_tree(design, design.particles, length, fraction=value)
        for value in design.area_fractions
    }
    return cells_along("area_fraction", design, starts)


def _separations(design: MapDesign) -> list[Cell]:
    heights = {value: value * boxes.MEAN_RADIUS for value in design.separations}
    starts = {
        value: merged(
            start_tree(design, 6, NARROW),
            {"channel": {"height": height, "outer_gap": boxes.outer_gap(height)}},
        )
        for value, height in heights.items()
    }
    return cells_along("wall_separation", design, starts)


def _counts(design: MapDesign) -> list[Cell]:
    starts = {float(count): start_tree(design, count, NARROW) for count in design.counts}
    return cells_along("particles", design, starts)


def _rests(design: MapDesign) -> list[Cell]:
    """Return cells of one particle at rest: by the level, by explicit steps, and on the mesh.

    The box is the smallest that has room around the particle, and the mesh coarse: what takes a
    million steps must be cheap. The level itself goes through the same time as the mesh.
    """
    start = merged(
        start_tree(design, 1, REST_LENGTH),
        {
            "rheometer": {"stress": 0.0},
            "channel": {"height": REST_HEIGHT, "outer_gap": boxes.outer_gap(REST_HEIGHT)},
        },
    )
    fraction = particle_area() / (REST_LENGTH * REST_HEIGHT)
    start = merged(start, {"suspension": {"area_fraction": fraction}})
    coarse = {"resolution": round(1.0 / (COARSE * REFERENCE_MESH_SIZE))}
    mesh = merged(
        in_scheme(design, start, "literal"),
        {"hydrodynamics": coarse, "time_stepping": start["time_stepping"]},
    )
    explicit = {"integrator": "euler", "step": REST_STEP}
    kinds: list[tuple[Scheme, str, Tree]] = [
        ("standard", "", start),
        ("standard", ", Euler", merged(start, {"time_stepping": explicit})),
        ("literal", ", Euler", mesh),
    ]
    usual = Parameters.from_mapping(mesh).time_stepping.step
    # Each from membranes on its own nodes: moved to fewer, they enclose less, are slack and buckle.
    return [
        Cell(
            "rest",
            f"{count:.0e}{how}",
            count,
            scheme,
            tree,
            tree,
            count * tree["time_stepping"].get("step", usual),
            "rest",
        )
        for scheme, how, tree in kinds
        for count in design.rests
    ]


def _far_shears(design: MapDesign) -> list[Cell]:
    start = start_tree(design, 1, 3 / 64, roughness=0.3)
    starts = dict.fromkeys(design.periods, start)
    cells = cells_along("far_shear", design, starts, schemes=("standard",))
    speed = FASTEST * start["channel"]["height"]
    return [
        replace(
            cell,
            tree=merged(cell.tree, {"rheometer": {"stress": FASTEST}}),
            duration=cell.value * start["channel"]["length"] / speed,
            criterion="rates",
        )
        for cell in cells
    ]


def _printed_controls(design: MapDesign) -> list[Cell]:
    start = start_tree(design, 6, NARROW)
    return [
        Cell(
            "printed_control",
            f"{control}, {outside}",
            float(control == "printed"),
            scheme,
            merged(
                in_scheme(design, start, scheme),
                {"rheometer": {"control": control}, "channel": {"outside": outside}},
            ),
            start,
            design.duration,
        )
        for scheme in SCHEMES
        for outside in ("still", "periodic")
        for control in ("exact", "printed")
    ]


GROUPS: Mapping[str, Callable[[MapDesign], list[Cell]]] = {
    "step_euler": _euler_steps,
    "step_rkc2": _adaptive_steps("rkc2"),
    "step_imex_rkc2": _adaptive_steps("imex_rkc2"),
    "stress": _material("stress"),
    "membrane_modulus": _material("membrane_modulus"),
    "wall_stiffness": _material("wall_stiffness"),
    "contact_energy": _material("contact_energy"),
    "contact_range": _contact_ranges,
    "roughness": _roughnesses,
    "area_fraction": _area_fractions,
    "wall_separation": _separations,
    "particles": _counts,
    "rest": _rests,
    "far_shear": _far_shears,
    "printed_control": _printed_controls,
}
"""Makers of each group's cells, in the order of the map."""
