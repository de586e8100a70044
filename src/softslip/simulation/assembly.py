"""A run's equations of motion, assembled from its parameters (Sec. II B)."""

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.simulation.sample import channel_box, wall_contour
from softslip.solver.contact_list import PairSource
from softslip.solver.contacts import ContactLaw, Contacts, NoContacts
from softslip.solver.control import Control, PrintedControl, RateControl, StressControl
from softslip.solver.films import contact_strength
from softslip.solver.geometry import LOWER, UPPER, Layout, wall_positions
from softslip.solver.health import Guard
from softslip.solver.membrane import MembraneLaw, rest_spacing
from softslip.solver.membrane_response import MembraneResponse
from softslip.solver.mobility import Mobility
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.mobility.grid import GridMobility, regularisation_length
from softslip.solver.mobility.outside import StillOutside
from softslip.solver.mobility.profile import MeanFlow
from softslip.solver.mobility.quadrature import CorrectedQuadrature
from softslip.solver.rheometer import Balance, unit_drive
from softslip.solver.splitting import farthest_reach, split_length
from softslip.solver.suspension import Suspension
from softslip.solver.wall_response import WallResponse


def regularisation_of(parameters: Parameters) -> float:
    """Return the regularisation length ε, by default that of the mesh scheme [length unit]."""
    hydrodynamics = parameters.hydrodynamics
    mesh_size = 1.0 / hydrodynamics.resolution
    if hydrodynamics.regularisation is None:
        return regularisation_length(mesh_size, hydrodynamics.symbol)
    return hydrodynamics.regularisation * mesh_size


def split_length_of(parameters: Parameters) -> float:
    """Return the split length a of the Ewald sum [length unit]."""
    hydrodynamics, box = parameters.hydrodynamics, channel_box(parameters)
    return split_length(
        hydrodynamics.split,
        hydrodynamics.regularisation or 1.0,
        hydrodynamics.node_spacing,
        hydrodynamics.resolution,
        farthest_reach(box),
    )


def contact_law(parameters: Parameters) -> ContactLaw:
    """Return how the run's membranes and walls repel each other."""
    steric = parameters.steric
    strength = contact_strength(steric.energy, steric.reading)
    return ContactLaw(steric.length, strength, steric.refinement)


def membrane_law(parameters: Parameters) -> MembraneLaw:
    """Return how the run's membranes resist stretching, and whether they keep their area."""
    membrane = parameters.membrane
    restoring = membrane.area_restoring if membrane.area_correction == "flux" else None
    return MembraneLaw(membrane.elastic_constant, membrane.order, restoring)


def contacts_of(
    parameters: Parameters, layout: Layout, shared: tuple[PairSource, float] | None = None
) -> Contacts | NoContacts:
    """Return the run's contacts, or their absence; for ``shared`` see `Contacts`."""
    if not layout.particles:
        return NoContacts()
    return Contacts(contact_law(parameters), parameters.channel.length, layout, shared)


def layout_of(packing: xr.Dataset, parameters: Parameters) -> Layout:
    """Return the node layout of an expanded packing between the run's walls.

    Rest distances are those of the circle of each particle's reference area (Sec. II B).

    Parameters
    ----------
    packing
        Dataset with ``nodes_per_particle`` and ``reference_area``.
    parameters
        Of the run.
    """
    hydrodynamics = parameters.hydrodynamics
    counts = packing["nodes_per_particle"].values
    offsets = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
    contour = wall_contour(parameters)
    spacing = hydrodynamics.node_spacing / hydrodynamics.resolution
    walls = wall_positions(contour, parameters.channel.height, spacing)
    areas = packing["reference_area"].values
    return Layout(offsets, rest_spacing(areas, offsets), walls, contour.arc_length / walls.shape[1])


def solver_of(
    parameters: Parameters, layout: Layout, threads: int = 1
) -> GridMobility | EwaldMobility:
    """Return the Stokes solver of a run in its periodic box; 'grid' uses one thread only."""
    box, hydrodynamics = channel_box(parameters), parameters.hydrodynamics
    viscosity = parameters.solvent.viscosity
    if hydrodynamics.mobility == "grid":
        return GridMobility(box, hydrodynamics.resolution, viscosity, hydrodynamics.symbol)
    walls = layout.wall_reference.reshape(-1, 2)
    epsilon, split = regularisation_of(parameters), split_length_of(parameters)
    return EwaldMobility(box, epsilon, viscosity, split, rigid=walls, threads=threads)


def mobility_of(parameters: Parameters, layout: Layout, solver: Mobility | None = None) -> Mobility:
    """Return a run's Stokes solver, a new one unless it is given, with the run's quadrature."""
    solver = solver or solver_of(parameters, layout)
    if parameters.hydrodynamics.quadrature == "plain":
        return solver
    length, viscosity = parameters.channel.length, parameters.solvent.viscosity
    return CorrectedQuadrature(solver, layout, length, regularisation_of(parameters), viscosity)


def guard_of(parameters: Parameters, layout: Layout) -> Guard:
    """Return what stops a run whose numbers no longer mean anything."""
    return Guard(
        layout,
        parameters.channel.length,
        parameters.channel.height,
        parameters.membrane.order,
        parameters.steric.length,
        regularisation_of(parameters),
        float(layout.spacing.max(initial=0.0)),
    )


def control_of(
    parameters: Parameters, layout: Layout, *, stress: float | None, shear_rate: float | None = None
) -> Control:
    """Return what imposes a stress, or without one a shear rate.

    The paper prints an equation for a stress that drives the walls; at rest and under an imposed
    rate the control is exact whatever ``rheometer.control`` says.

    Raises
    ------
    ValueError
        When neither a stress nor a rate is imposed.
    """
    heights = layout.wall_reference[:, :, 1].mean(axis=1)
    arm = float(heights[UPPER] - heights[LOWER])
    balance = Balance(channel_box(parameters), arm, parameters.channel.outside == "still")
    unit = unit_drive(layout.wall_nodes, parameters.channel.length)
    if stress and parameters.rheometer.control == "printed":
        viscosity, stiffness = parameters.solvent.viscosity, parameters.wall.stiffness
        return PrintedControl(balance, stress, unit, layout.wall_spacing, viscosity, stiffness)
    if stress is not None:
        return StressControl(balance, unit, stress)
    if shear_rate is None:
        raise ValueError("A run needs a stress or a shear rate.")
    return RateControl(balance, unit, shear_rate)


def assemble(
    parameters: Parameters,
    layout: Layout,
    *,
    stress: float | None,
    shear_rate: float | None = None,
    threads: int = 1,
) -> Suspension:
    """Return the equations of motion of a run under a stress or a shear rate.

    The number of threads changes how long an evaluation takes, and no bit of it.
    """
    solver = solver_of(parameters, layout, threads)
    return assemble_around(solver, parameters, layout, stress=stress, shear_rate=shear_rate)


def assemble_around(
    solver: GridMobility | EwaldMobility,
    parameters: Parameters,
    layout: Layout,
    *,
    stress: float | None,
    shear_rate: float | None = None,
) -> Suspension:
    """Return the equations of motion of a run around a Stokes solver of its box.

    Parameters
    ----------
    solver
        Whose list of node pairs the contacts share, if it has one.
    parameters, layout
        Of the run.
    stress, shear_rate
        What is imposed.
    """
    box, mobility = channel_box(parameters), mobility_of(parameters, layout, solver)
    if parameters.channel.outside == "still":
        mobility = StillOutside(mobility, box, parameters.solvent.viscosity)
    shared = None
    if isinstance(solver, EwaldMobility):
        shared = (solver.near_pairs, solver.reach)
    law, stiffness = membrane_law(parameters), parameters.wall.stiffness
    line = regularisation_of(parameters), parameters.solvent.viscosity
    corrected = parameters.hydrodynamics.quadrature == "corrected"
    return Suspension(
        layout,
        box,
        mobility,
        contacts_of(parameters, layout, shared),
        law,
        control_of(parameters, layout, stress=stress, shear_rate=shear_rate),
        membrane_response=MembraneResponse(layout, law, *line, corrected=corrected),
        wall_response=WallResponse(layout, box, stiffness, *line, corrected=corrected),
        wall_stiffness=stiffness,
        contact_range=parameters.steric.length,
    )


def mean_flow(parameters: Parameters) -> MeanFlow:
    """Return the one-dimensional solver of the run's x-averaged flow."""
    hydrodynamics = parameters.hydrodynamics
    return MeanFlow(
        channel_box(parameters),
        hydrodynamics.resolution,
        parameters.solvent.viscosity,
        hydrodynamics.symbol,
        parameters.channel.outside,
    )
