"""The materials: solvent, particles, their membranes and their contacts."""

from typing import Literal

from softslip.config.fields import quantity
from softslip.config.sections.base import Section
from softslip.solver.films import REFERENCE_MESH_SIZE


class Solvent(Section):
    """The Newtonian fluid inside and around the particles (Table III)."""

    viscosity: float = quantity(
        1.0, symbol="η", unit="viscosity unit", paper=1.0, gt=0, description="Solvent viscosity."
    )


class Particles(Section):
    """The soft particles (Sec. II A and III)."""

    area_fraction: float = quantity(
        0.84,
        symbol="φ",
        unit="1",
        paper=0.84,
        ge=0,
        le=0.95,
        description="Particle area over the area of the channel; 0 means no particles.",
    )
    area_reference: Literal["channel", "free"] = quantity(
        "channel",
        symbol="A_φ",
        unit="1",
        paper="channel",
        description="Area that the area fraction refers to: 'channel' is L_x H, 'free' leaves out "
        "what the bumps of the walls take up, so that smooth and rough walls of a small channel "
        "hold equally dense suspensions.",
    )
    mean_radius: float = quantity(
        0.00846,
        symbol="R",
        unit="length unit",
        paper=0.0085,
        ge=1e-6,
        le=10,
        description="Mean particle radius. The number of particles follows from it, and the radii "
        "are then adjusted (by less than one part in 4N) so that the area fraction is exact; "
        "0.00846 gives the paper's 800 particles.",
    )
    size_ratio: float = quantity(
        1.4,
        symbol="R_2/R_1",
        unit="1",
        paper=1.4,
        ge=1,
        le=3,
        description="Radius of the larger half of the particles over that of the smaller half.",
    )


class Membrane(Section):
    """Elastic boundary of a particle while it is sheared (Eqs. 4-5, 18-21)."""

    elastic_constant: float = quantity(
        1.0, symbol="K_e", unit="stress unit", paper=1.0, gt=0, description="Membrane modulus."
    )
    area_correction: Literal["flux", "none"] = quantity(
        "flux",
        symbol="M",
        unit="1",
        paper="flux",
        description="'flux' subtracts the mean normal velocity of each membrane (Eqs. 20-21); "
        "'none' moves nodes with the bare velocity.",
    )
    area_restoring: float = quantity(
        0.0,
        symbol="κ_A",
        unit="1 / time unit",
        paper=0.0,
        ge=0,
        le=100,
        description="Rate at which 'flux' also brings a particle's area back to what it should be; "
        "without it the errors of time steps add up.",
    )
    order: Literal[2, 6] = quantity(
        2,
        symbol="p",
        unit="1",
        paper=2,
        description="Order in the node spacing of tension, normals and areas; 6 goes with nodes "
        "that are several mesh sizes apart.",
    )


class Steric(Section):
    """Short-ranged contact repulsion between nodes (Eqs. 2 and 22)."""

    length: float = quantity(
        9 * REFERENCE_MESH_SIZE,
        symbol="σ_LJ",
        unit="length unit",
        paper=9 * REFERENCE_MESH_SIZE,
        gt=0,
        description="Contact range and cutoff.",
    )
    energy: float = quantity(
        1e-9, symbol="K_LJ", unit="energy unit", paper=1e-9, ge=0, description="Contact energy."
    )
    reading: Literal["energy", "density"] = quantity(
        "energy",
        symbol="K_LJ",
        unit="1",
        description="'energy' takes K_LJ as an energy of a pair of nodes at the paper's spacing; "
        "'density' takes the pair force as a force density, as Eq. 28 reads literally.",
    )
    refinement: int = quantity(
        1,
        symbol="m",
        unit="1",
        paper=1,
        ge=1,
        le=8,
        description="Contact points per node, the others interpolated between nodes. Contact "
        "points more than 2.5 of the paper's mesh sizes apart interlock like gears.",
    )
