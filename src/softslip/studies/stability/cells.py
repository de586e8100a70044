"""The cells of the map: one run each, of parameters that stretch one axis, with its criterion."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from softslip.config.parameters import Parameters
from softslip.solver.films import REFERENCE_MESH_SIZE
from softslip.studies import scenes
from softslip.studies.stability.map_design import MapDesign
from softslip.studies.stability.scenery import (
    NARROW,
    SCHEMES,
    Scheme,
    Tree,
    dense,
    in_scheme,
    merged,
    particle_area,
    scene_of,
    start_tree,
)
from softslip.studies.stability.step_limits import spectral_radius

WIDEST = 0.65
"""Node spacing over the contact range where the range is the axis, just below what is allowed."""

FEWEST_STEPS = 64
"""Steps of a cell at least, where its step is long; a multiple of the looks at it."""

PATIENCE = 4.0
"""How much longer cells of the level are than those of the mesh, whose steps cost more."""


@dataclass(frozen=True)
class Cell:
    """One run of the map.

    Attributes
    ----------
    group, label, value
        The axis, and where on it the cell lies, in words and as a number.
    scheme
        Which scheme runs it.
    tree
        Parameters of the run.
    start
        Parameters of the packing, its growth and its ageing, at 'standard' but for those at rest.
    duration
        Length of the run [time unit].
    criterion
        'finer' compares with a finer run, 'rates' with its shear rate only, 'rest' with the
        state at the start; 'sharper' is 'finer', and also notes the difference from a run of a
        smaller regularisation length.
    """

    group: str
    label: str
    value: float
    scheme: Scheme
    tree: Tree
    start: Tree
    duration: float
    criterion: Literal["finer", "sharper", "rates", "rest"] = "finer"


def _along(
    group: str,
    design: MapDesign,
    values: tuple[float, ...],
    change: Callable[[float], Mapping[str, Mapping[str, Any]]],
    duration: Callable[[float], float],
) -> list[Cell]:
    """Return the cells of an axis that only changes parameters of the dense scene."""
    start = dense(design)
    return [
        Cell(
            group,
            f"{value:g}",
            value,
            scheme,
            merged(in_scheme(design, start, scheme), change(value)),
            start,
            duration(value) * (PATIENCE if scheme == "standard" else 1.0),
        )
        for scheme in SCHEMES
        for value in values
    ]


def _between(
    group: str,
    design: MapDesign,
    starts: Mapping[float, Tree],
    schemes: tuple[Scheme, ...] = SCHEMES,
) -> list[Cell]:
    """Return the cells of an axis that changes the packing or the walls."""
    return [
        Cell(
            group,
            f"{value:g}",
            value,
            scheme,
            in_scheme(design, start, scheme),
            start,
            design.duration * (PATIENCE if scheme == "standard" else 1.0),
        )
        for scheme in schemes
        for value, start in starts.items()
    ]


def _stresses(design: MapDesign) -> list[Cell]:
    return _along(
        "stress",
        design,
        design.stresses,
        lambda value: {"rheometer": {"stress": value}},
        lambda value: design.duration / max(1.0, 2.0 * value),
    )


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


def _rkc2_steps(design: MapDesign) -> list[Cell]:
    """Return cells of 'rkc2' at its loosest tolerance, asked for steps over the Euler limit."""
    start = dense(design)
    limit = 2.0 / spectral_radius(scene_of(start, start))
    return [
        Cell(
            "step_rkc2",
            f"{value:g}",
            value,
            "standard",
            merged(
                start,
                {
                    "time_stepping": {
                        "step": value * limit,
                        "longest_step": max(value * limit, 1.0 if value >= 1 else 0.0),
                        "tolerance": 0.1,
                    }
                },
            ),
            start,
            design.duration,
        )
        for value in design.steps
    ]


def _wall_stiffnesses(design: MapDesign) -> list[Cell]:
    return _along(
        "wall_stiffness",
        design,
        design.wall_stiffnesses,
        lambda value: {"wall": {"stiffness": value}},
        lambda value: design.duration,
    )


def _membrane_moduli(design: MapDesign) -> list[Cell]:
    return _along(
        "membrane_modulus",
        design,
        design.membrane_moduli,
        lambda value: {"membrane": {"elastic_constant": value}},
        lambda value: design.duration / max(1.0, value),
    )


def _contact_energies(design: MapDesign) -> list[Cell]:
    return _along(
        "contact_energy",
        design,
        design.contact_energies,
        lambda value: {"steric": {"energy": value}},
        lambda value: design.duration,
    )


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
    cells = _between("contact_range", design, starts, ("standard",))
    return [replace(cell, criterion="sharper") for cell in cells]


def _roughnesses(design: MapDesign) -> list[Cell]:
    length = scenes.channel_sides(design.particles)[0]
    return _between(
        "roughness",
        design,
        {
            value: start_tree(design, design.particles, length, roughness=value)
            for value in design.roughnesses
        },
    )


def _area_fractions(design: MapDesign) -> list[Cell]:
    length = scenes.channel_sides(design.particles)[0]
    return _between(
        "area_fraction",
        design,
        {
            value: start_tree(design, design.particles, length, fraction=value)
            for value in design.area_fractions
        },
    )


def _separations(design: MapDesign) -> list[Cell]:
    starts = {}
    for value in design.separations:
        height = value * scenes.MEAN_RADIUS
        starts[value] = merged(
            start_tree(design, 6, NARROW),
            {"channel": {"height": height, "outer_gap": scenes.outer_gap(height)}},
        )
    return _between("wall_separation", design, starts)


def _counts(design: MapDesign) -> list[Cell]:
    return _between(
        "particles",
        design,
        {float(count): start_tree(design, count, NARROW) for count in design.counts},
    )


def _rests(design: MapDesign) -> list[Cell]:
    """Return cells of one particle at rest: by the level, by explicit steps, and on the mesh.

    The box is the smallest that has room around the particle, and the mesh coarse: what takes a
    million steps must be cheap. The level itself goes through the same time as the mesh.
    """
    start = merged(
        start_tree(design, 1, REST_LENGTH),
        {
            "rheometer": {"stress": 0.0},
            "channel": {"height": REST_HEIGHT, "outer_gap": scenes.outer_gap(REST_HEIGHT)},
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


REST_LENGTH, REST_HEIGHT, COARSE = 1 / 32, 0.03, 2
"""Box of a particle at rest [length unit], and its mesh size over the paper's. The forces by which
places within a cell of the mesh differ fall with the cube of its size: at 4 they move the particle
by 0.02 contact ranges in a million steps."""

REST_STEP = 1e-3
"""Explicit step at the level, whose shorter regularisation makes forces of nodes stiffer than those
of the mesh: it is unstable from 1.9e-3 on [time unit]."""

FASTEST = 5.0
"""Stress that shears walls past many periods [stress unit]."""


def _far_shears(design: MapDesign) -> list[Cell]:
    start = start_tree(design, 1, 3 / 64, roughness=0.3)
    cells = _between("far_shear", design, dict.fromkeys(design.periods, start), ("standard",))
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
    "step_rkc2": _rkc2_steps,
    "stress": _stresses,
    "membrane_modulus": _membrane_moduli,
    "wall_stiffness": _wall_stiffnesses,
    "contact_energy": _contact_energies,
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
