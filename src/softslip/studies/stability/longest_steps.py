"""The longest stable step of both steppers, found by bisection, beside what theory says."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from softslip.errors import NumericalError
from softslip.solver.films import REFERENCE_MESH_SIZE
from softslip.solver.integrators import Vector
from softslip.solver.integrators.chebyshev import fixed_step, reach
from softslip.solver.integrators.explicit import REACH
from softslip.solver.integrators.recurrence import DAMPING
from softslip.studies.boxes import Tree, merged
from softslip.studies.meanings import with_meanings
from softslip.studies.scenes import Scene
from softslip.studies.stability.map_design import MapDesign
from softslip.studies.stability.map_scenes import in_scheme, scene_of, start_tree
from softslip.studies.timing import Tell, silent

MOST_ITERATIONS, CONVERGED = 400, 1e-5
"""Power iterations at most, and the relative change that ends them: far less than those of the
steppers, so that the radius is right to about a per cent even where the spectrum is dense."""

SIZE = 1e-7
"""Perturbation of a trajectory, in contact ranges: small against all that is not linear, large
against rounding."""

ROUGHNESS = 0.1
"""Size of the part of a perturbation that is in no particular direction, over the part that is in
the stiffest."""

SETTLING, WATCHED = 8, 16
"""Steps in which slower modes settle, and steps in which the perturbation is watched."""

WIDTH = 0.005
"""Relative width of the bracket at which the bisection ends."""

BRACKET = (0.5, 2.0)
"""Where the limit is looked for, in units of the theory's."""

PARTICLES, PERIOD = 6, 1 / 16
"""Of the scenes, which a stability limit does not depend on [length unit]."""

Step = Callable[[Vector, float], Vector]
"""One step of a given length from a vector."""


def _norm(vector: Vector, scale: Vector) -> float:
    return float(np.sqrt(np.mean((vector / scale) ** 2)))


def _rough(scale: Vector) -> Vector:
    """Return a fixed perturbation in which all wavelengths are, of unit size."""
    noise = np.random.default_rng(np.random.SeedSequence(0)).standard_normal(scale.size)
    noise[-4:] = 0.0  # Walls as wholes are not stiff.
    return noise * scale


def spectral_radius(scene: Scene) -> float:
    """Return the spectral radius ρ of the Jacobian of a scene [1 / time unit]; see `stiffest`."""
    return stiffest(scene)[0]


def stiffest(scene: Scene) -> tuple[float, Vector]:
    """Return ρ and the direction, of unit size, in which the rate changes that fast.

    A long power iteration, which shares the idea with that of the steppers, but neither its start
    nor its end.
    """
    rate, scale = _rate(scene), scene.suspension.error_scale(scene.state)
    vector = scene.state.vector
    first, direction = rate(vector, 0.0), _rough(scale)
    size = SIZE / _norm(direction, scale)
    radius = 0.0
    for _ in range(MOST_ITERATIONS):
        change = (rate(vector + size * direction, 0.0) - first) / size
        before, radius = radius, _norm(change, scale) / _norm(direction, scale)
        direction = change / _norm(change, scale)
        size = SIZE
        if abs(radius - before) <= CONVERGED * radius:
            break
    return radius, direction


def _rate(scene: Scene) -> Callable[[Vector, float], Vector]:
    state, suspension = scene.state, scene.suspension
    return lambda vector, time: suspension.rate(state.replace(vector, time, state.step))


def grows(step: Step, vector: Vector, stiff: Vector, scale: Vector, dt: float) -> bool:
    """Return whether a small perturbation of a relaxing trajectory grows in steps of a length.

    Two trajectories that begin apart in the stiffest direction, and a little in all others, take
    the same steps. What a step changes of their distance, in which slow modes hardly count, must
    not be larger after `WATCHED` more steps than after `SETTLING`. What leaves the numbers has
    grown.
    """
    start = stiff + ROUGHNESS * _rough(scale)
    other, apart, changes = vector + SIZE * start, SIZE * start, []
    with np.errstate(all="ignore"):
        for _ in range(SETTLING + WATCHED):
            try:
                vector, other = step(vector, dt), step(other, dt)
            except NumericalError:
                return True
            before, apart = apart, other - vector
            changes.append(_norm(apart - before, scale))
    # Written so that NaN has grown.
    return not changes[-1] <= changes[SETTLING - 1]


def longest_stable(
    step: Step, vector: Vector, stiff: Vector, scale: Vector, theory: float
) -> float:
    """Return the longest step at which no perturbation grows, by bisection [time unit].

    Raises
    ------
    NumericalError
        When the limit is not within `BRACKET` of the theory's.
    """
    low, high = (factor * theory for factor in BRACKET)
    if grows(step, vector, stiff, scale, low) or not grows(step, vector, stiff, scale, high):
        raise NumericalError(
            "step_size",
            0,
            0,
            f"the longest stable step is not between {low:.3g} and {high:.3g}; use a scene that "
            "is closer to rest",
        )
    while high > (1 + WIDTH) * low:
        middle = math.sqrt(low * high)
        if grows(step, vector, stiff, scale, middle):
            high = middle
        else:
            low = middle
    return math.sqrt(low * high)


def euler_limit(scene: Scene, radius: float, stiff: Vector) -> float:
    """Return the longest stable step of explicit Euler [time unit]; the theory's is 2/ρ."""
    rate, scale = _rate(scene), scene.suspension.error_scale(scene.state)

    def step(vector: Vector, dt: float) -> Vector:
        return vector + dt * rate(vector, 0.0)

    return longest_stable(step, scene.state.vector, stiff, scale, REACH / radius)


def rkc2_limit(scene: Scene, radius: float, stiff: Vector, stages: int) -> float:
    """Return the longest stable step of 'rkc2' with a fixed number of stages [time unit].

    The theory's is 2/3 (s² - 1)(1 - 2ε/15)/ρ, ε = 2/13 its damping.
    """
    rate, scale = _rate(scene), scene.suspension.error_scale(scene.state)

    def step(vector: Vector, dt: float) -> Vector:
        return fixed_step(rate, vector, 0.0, dt, stages)

    return longest_stable(step, scene.state.vector, stiff, scale, reach(stages) / radius)


@dataclass(frozen=True)
class Setting:
    """What the stability limit depends on.

    Attributes
    ----------
    mobility
        'grid' is the paper's mesh, 'ewald' the level 'standard'.
    regularisation, node_spacing
        ε and Δs over the paper's mesh size.
    roughness, stiffness
        β and K_w.
    """

    mobility: str
    regularisation: float
    node_spacing: float
    roughness: float
    stiffness: float


def _settings(design: MapDesign) -> list[tuple[Setting, Tree, Tree]]:
    """Return each setting with the parameters of its start and its run."""
    found: list[tuple[Setting, Tree, Tree]] = []
    usual = 20000.0
    stiff = 20.0 * usual
    for roughness, stiffness in ((0.0, usual), (0.0, stiff), (ROUGH, usual), (ROUGH, stiff)):
        start = start_tree(design, PARTICLES, PERIOD, roughness=roughness)
        mesh = in_scheme(design, start, "literal")
        spacing = GRID_SPACING / design.resolution / REFERENCE_MESH_SIZE
        epsilon = GRID_REGULARISATION / design.resolution / REFERENCE_MESH_SIZE
        wall = {"wall": {"stiffness": stiffness}}
        setting = Setting("grid", epsilon, spacing, roughness, stiffness)
        found.append((setting, start, merged(mesh, wall)))
        for epsilon in design.regularisations:
            for spacing in design.node_spacings:
                hydrodynamics = {"regularisation": epsilon, "node_spacing": spacing}
                setting = Setting("ewald", epsilon, spacing, roughness, stiffness)
                tree = merged(start, {**wall, "hydrodynamics": hydrodynamics})
                found.append((setting, start, tree))
    return found


ROUGH = 0.59
"""Roughness of the rough walls, one of the paper's."""

GRID_SPACING, GRID_REGULARISATION = 1.42, math.sqrt(0.6073)
"""Node spacing and regularisation length of the paper's scheme over its mesh size."""

UNITS: Mapping[str, tuple[str, str]] = {
    "spectral_radius": ("1 / time unit", "spectral radius of the Jacobian"),
    "euler_limit": ("time unit", "longest stable step of explicit Euler, measured"),
    "euler_theory": ("time unit", "longest stable step of explicit Euler, theory"),
    "rkc2_limit": ("time unit", "longest stable step of rkc2, measured"),
    "rkc2_theory": ("time unit", "longest stable step of rkc2, theory"),
    "mobility": ("1", "Stokes solver"),
    "regularisation": ("1", "regularisation length over the paper's mesh size"),
    "node_spacing": ("1", "node spacing over the paper's mesh size"),
    "roughness": ("1", "wall roughness"),
    "stiffness": ("stress unit / length unit", "rate constant of the tethers"),
    "stages": ("1", "stages of rkc2"),
}
"""Unit and meaning of each variable."""


def measure_limits(design: MapDesign, tell: Tell = silent) -> xr.Dataset:
    """Measure the longest stable steps of both steppers on relaxing packings.

    Returns
    -------
    xarray.Dataset
        Over ``setting``: ``spectral_radius``, ``euler_limit`` and ``euler_theory``; its coordinates
        say what it is. Over ``stages``: ``rkc2_limit`` and ``rkc2_theory``, of the first 'ewald'
        setting.

    Raises
    ------
    SoftslipError
        When a scene cannot be made, or a limit is nowhere near the theory's.
    """
    rows: list[tuple[Setting, float, float]] = []
    staged: dict[str, list[float]] | None = None
    for setting, start, tree in _settings(design):
        tell(f"stability limit: {setting}")
        scene = scene_of(start, tree)
        radius, stiff = stiffest(scene)
        rows.append((setting, radius, euler_limit(scene, radius, stiff)))
        if staged is None and setting.mobility == "ewald":
            staged = _staged(design, scene, (radius, stiff), tell)
    return _dataset(design, rows, staged or {})


def _staged(
    design: MapDesign, scene: Scene, mode: tuple[float, Vector], tell: Tell
) -> dict[str, list[float]]:
    result: dict[str, list[float]] = {"rkc2_limit": [], "rkc2_theory": []}
    for stages in design.stages:
        tell(f"stability limit of {stages} stages")
        result["rkc2_limit"].append(rkc2_limit(scene, *mode, stages))
        result["rkc2_theory"].append(reach(stages) / mode[0])
    return result


def _dataset(
    design: MapDesign, rows: list[tuple[Setting, float, float]], staged: Mapping[str, list[float]]
) -> xr.Dataset:
    radii = np.array([radius for _, radius, _ in rows])
    variables: dict[str, Any] = {
        "spectral_radius": ("setting", radii),
        "euler_limit": ("setting", np.array([limit for *_, limit in rows])),
        "euler_theory": ("setting", REACH / radii),
        **{name: ("stages", np.array(values)) for name, values in staged.items()},
    }
    names = ("mobility", "regularisation", "node_spacing", "roughness", "stiffness")
    coordinates: dict[str, Any] = {
        name: ("setting", [getattr(setting, name) for setting, *_ in rows]) for name in names
    }
    dataset = xr.Dataset(variables, {**coordinates, "stages": list(design.stages)})
    return with_meanings(dataset, UNITS).assign_attrs(damping=DAMPING, particles=PARTICLES)
