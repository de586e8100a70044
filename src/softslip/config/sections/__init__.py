"""The groups of a scenario's parameters, each value with its unit, symbol, bounds and the paper's.

"Eq.", "Table" and "Sec." mean those of Jung & Fielding, *Wall slip and bulk yielding in soft
particle suspensions*. Lengths are in units of the paper's box height, stresses in units of its
membrane modulus, and the time unit follows from the viscosity. What must hold between values of
different keys is checked in `config.checks`.
"""

from softslip.config.sections.base import (
    Section,
    Standalone,
)
from softslip.config.sections.channel import Channel, Rheometer, Wall
from softslip.config.sections.discretisation import Hydrodynamics, TimeStepping
from softslip.config.sections.material import Membrane, Particles, Solvent, Steric
from softslip.config.sections.preparation import Expansion, Packing
from softslip.config.sections.recording import Recording
from softslip.config.sections.tree import Tree
from softslip.config.sections.until import Until
from softslip.solver.films import REFERENCE_MESH_SIZE

__all__ = [
    "REFERENCE_MESH_SIZE",
    "Channel",
    "Expansion",
    "Hydrodynamics",
    "Membrane",
    "Packing",
    "Particles",
    "Recording",
    "Rheometer",
    "Section",
    "Solvent",
    "Standalone",
    "Steric",
    "TimeStepping",
    "Tree",
    "Until",
    "Wall",
]
