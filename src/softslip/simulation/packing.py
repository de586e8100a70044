"""Equilibrated packings of soft discs, made with LAMMPS (Sec. II A 1, Table I).

The discs repel one another and the nodes of the walls through the Lennard-Jones potential of
Eq. 2, cut off and shifted to zero at its minimum. Its range exceeds the sum of two radii by 1.35,
so that an equilibrated packing leaves room between the discs for `simulation.expansion`.
"""

import math
from collections.abc import Iterator

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.errors import PackingError
from softslip.files.quantities import described
from softslip.simulation.contour import wall_clearance
from softslip.simulation.lammps_library import lammps_instance
from softslip.simulation.sample import particle_radii, wall_contour
from softslip.solver.geometry import FloatArray, WallContour, wall_positions

RANGE_FACTOR = 1.2
"""σ over the sum of the radii of two discs, or over the radius of a disc at a wall (Table I)."""

CUTOFF_FACTOR = 2 ** (1 / 6)
"""Cutoff of the potential over σ: the distance of its minimum (Table I)."""

WALL_NODES_PER_RADIUS = 8
"""Wall nodes over one small disc's radius: as good as a continuous wall to a disc."""

PLACEMENT_FACTOR = 0.77
"""Distance of the first random placement over the sum of radii; the minimiser does the rest."""

PLACEMENT_TRIES = 400
"""Random positions tried for a disc before all discs are placed again at a smaller distance."""

SMALLEST_PLACEMENT_FACTOR = 0.3
"""Placement factor below which the discs do not fit into the channel."""

MINIMISER_ITERATIONS = 20000
"""Limit of the conjugate-gradient iterations; a packing of 800 discs takes a few hundred."""

LARGEST_LAMMPS_SEED = 900_000_000
"""Bound of the seeds that LAMMPS' generators take."""


def pack(parameters: Parameters) -> xr.Dataset:
    """Return discs at the packing's area fraction, equilibrated between the walls.

    Randomly placed discs are relaxed by LAMMPS with the Polak-Ribiere conjugate-gradient method
    and then moved by Langevin dynamics (Eq. 3, velocity Verlet) for
    ``packing.equilibration_steps``. The area fraction is ``packing.area_fraction``, or that of
    the suspension if it is lower. The result is a function of the parameters alone.

    Returns
    -------
    xarray.Dataset
        ``centre`` (particle, axis) in the channel frame with x in [0, L_x), ``radius`` (particle)
        of the discs, ``final_radius`` (particle) of discs with the particles' final areas; all
        in length units.

    Raises
    ------
    PackingError
        When the discs cannot be placed, LAMMPS is missing or fails, or discs overlap each other
        or a wall in the end.
    """
    final_radius = particle_radii(parameters)
    if not len(final_radius):
        return _dataset(np.empty((0, 2)), final_radius, final_radius)
    fraction = min(parameters.packing.area_fraction, parameters.suspension.area_fraction)
    radius = final_radius * math.sqrt(fraction / parameters.suspension.area_fraction)
    contour = wall_contour(parameters)
    generator = np.random.default_rng(
        np.random.SeedSequence(parameters.seed, spawn_key=tuple(b"packing"))
    )
    start = _random_placement(radius, contour, parameters.channel.height, generator)
    centre = _equilibrate(parameters, start, radius, contour, generator)
    centre[:, 0] %= contour.length
    check_discs(centre, radius, contour, parameters.channel.height)
    return _dataset(centre, radius, final_radius)


def check_discs(
    centre: FloatArray, radius: FloatArray, contour: WallContour, height: float
) -> None:
    """Make sure that no disc overlaps another, its own periodic image or a wall.

    Parameters
    ----------
    centre, radius
        Positions, shape (discs, 2), and radii, shape (discs,) [length unit].
    contour, height
        The walls: contour of the lower one and distance H of their flat parts [length unit].

    Raises
    ------
    PackingError
        Naming the first offending disc.
    """
    gap = wall_clearance(centre, contour, height) - radius
    if not np.all(gap >= 0):
        disc = int(np.argmin(gap))
        raise PackingError(
            f"disc {disc} overlaps a wall by {-gap[disc]:.3g}; lower packing.area_fraction or "
            "wall.roughness"
        )
    for disc in range(len(centre)):
        distance = _periodic_distances(centre[disc], centre[disc:], contour.length)
        distance[0] = contour.length
        gap = distance - radius[disc] - radius[disc:]
        if not np.all(gap >= 0):
            other = disc + int(np.argmin(gap))
            raise PackingError(
                f"discs {disc} and {other} overlap by {-gap.min():.3g}; lower "
                "packing.area_fraction, now too high for this channel"
            )


def _periodic_distances(point: FloatArray, others: FloatArray, length: float) -> FloatArray:
    """Distances to the nearest images of other points, shape (others,)."""
    delta = others - point
    delta[:, 0] -= length * np.round(delta[:, 0] / length)
    return np.hypot(delta[:, 0], delta[:, 1])


def _random_placement(
    radius: FloatArray, contour: WallContour, height: float, generator: np.random.Generator
) -> FloatArray:
    """Place discs one after the other at random, large ones first, shape (discs, 2)."""
    order = np.argsort(-radius, kind="stable")
    factor = PLACEMENT_FACTOR
    while factor > SMALLEST_PLACEMENT_FACTOR:
        centre = np.empty((len(radius), 2))
        for placed, disc in enumerate(order):
            before = order[:placed]
            for _ in range(PLACEMENT_TRIES):
                point = generator.random(2) * (contour.length, height)
                apart = _periodic_distances(point, centre[before], contour.length)
                if wall_clearance(point[None], contour, height)[0] >= radius[disc] and np.all(
                    apart >= factor * (radius[before] + radius[disc])
                ):
                    centre[disc] = point
                    break
            else:
                break
        else:
            return centre
        factor *= 0.9
    raise PackingError(
        f"{len(radius)} discs of mean radius {radius.mean():.3g} cannot be placed at random "
        f"between walls {height:g} apart; lower packing.area_fraction, suspension.mean_radius or "
        "wall.roughness"
    )


def _equilibrate(
    parameters: Parameters,
    start: FloatArray,
    radius: FloatArray,
    contour: WallContour,
    generator: np.random.Generator,
) -> FloatArray:
    """Minimise and equilibrate the discs with LAMMPS; return their positions, shape (discs, 2)."""
    height = parameters.channel.height
    spacing = float(radius.min()) / WALL_NODES_PER_RADIUS
    walls = wall_positions(contour, height, spacing).reshape(-1, 2)
    sizes, kind = np.unique(radius, return_inverse=True)
    wall_kind = len(sizes) + 1
    position = np.zeros((len(start) + len(walls), 3))
    position[:, :2] = np.concatenate((start, walls))
    kinds = np.concatenate((kind + 1, np.full(len(walls), wall_kind)))
    seed = int(generator.integers(1, LARGEST_LAMMPS_SEED))
    with lammps_instance() as engine:
        for line in _setup(sizes, contour.length, height, len(start)):
            engine.command(line)
        engine.create_atoms(
            len(kinds),
            list(range(1, len(kinds) + 1)),
            kinds.tolist(),
            position.ravel().tolist(),
            shrinkexceed=False,
        )
        for line in _dynamics(parameters, wall_kind, float(sizes[0]), seed):
            engine.command(line)
        count = engine.get_natoms()
        if count != len(kinds):
            raise PackingError(
                f"LAMMPS lost {len(kinds) - count} of {len(kinds)} discs and wall nodes; lower "
                "packing.time_step or packing.area_fraction"
            )
        gathered = np.array(engine.gather_atoms("x", 1, 3)).reshape(-1, 3)
    return gathered[: len(start), :2].copy()


def _setup(sizes: FloatArray, length: float, height: float, discs: int) -> Iterator[str]:
    """Commands that make the box and the pair potential (Eq. 2, Table I)."""
    ranges = RANGE_FACTOR * np.append(sizes, 0.0)
    largest = float(sizes[-1])
    yield "units lj"
    yield "dimension 2"
    yield "boundary p f p"
    yield "atom_style atomic"
    # Cells and neighbour lists in LAMMPS' order would depend on where atoms are sorted to.
    yield "atom_modify map array sort 0 0"
    yield (
        f"region box block 0 {length!r} {-largest!r} {height + largest!r} "
        f"{-0.5 * largest!r} {0.5 * largest!r}"
    )
    yield f"create_box {len(ranges)} box"
    yield "mass * 1.0"
    yield f"pair_style lj/cut {CUTOFF_FACTOR * 2 * float(ranges.max())!r}"
    yield "pair_modify shift yes"
    for i, first in enumerate(ranges, start=1):
        for j, second in enumerate(ranges[i - 1 :], start=i):
            if i == j == len(ranges):
                # Wall nodes do not interact, but LAMMPS wants coefficients for every pair.
                yield f"pair_coeff {i} {j} 0.0 1.0 0.0"
                continue
            sigma = float(first + second)
            yield f"pair_coeff {i} {j} 1.0 {sigma!r} {CUTOFF_FACTOR * sigma!r}"
    yield f"neighbor {0.3 * largest!r} bin"
    yield "neigh_modify every 1 delay 0 check yes"


def _dynamics(parameters: Parameters, wall_kind: int, smallest: float, seed: int) -> Iterator[str]:
    """Commands that minimise the energy and then integrate Eq. 3 from rest."""
    packing = parameters.packing
    yield f"group wall type {wall_kind}"
    yield "group discs subtract all wall"
    yield "neigh_modify exclude group wall wall"
    yield "fix plane all enforce2d"
    yield "fix still wall setforce 0.0 0.0 0.0"
    yield "min_style cg"
    # Overlaps make huge forces at first: no disc may jump over its neighbours or a wall.
    yield f"min_modify dmax {0.1 * smallest!r}"
    yield f"minimize 0.0 1.0e-3 {MINIMISER_ITERATIONS} {10 * MINIMISER_ITERATIONS}"
    yield "unfix still"
    yield f"timestep {packing.time_step!r}"
    yield "fix verlet discs nve"
    yield (
        f"fix noise discs langevin {packing.temperature!r} {packing.temperature!r} "
        f"{packing.damping_time!r} {seed}"
    )
    yield "thermo 500"
    yield f"run {packing.equilibration_steps}"


def _dataset(centre: FloatArray, radius: FloatArray, final_radius: FloatArray) -> xr.Dataset:
    return described(
        xr.Dataset(
            {
                "centre": (("particle", "axis"), centre),
                "radius": ("particle", radius),
                "final_radius": ("particle", final_radius),
            },
            coords={"axis": ("axis", ["x", "y"])},
            attrs={"discs": len(centre)},
        )
    )
