"""The groups of a scenario's parameters, each value with its unit, symbol, bounds and the paper's.

"Eq.", "Table" and "Sec." mean those of Jung & Fielding, *Wall slip and bulk yielding in soft
particle suspensions*. Lengths are in units of the paper's box height, stresses in units of its
membrane modulus, and the time unit follows from the viscosity. What must hold between values of
different keys is checked in `softslip.checks`.
"""

from softslip.sections.base import REFERENCE_MESH_SIZE, REFERENCE_NODE_SPACING, Section, Standalone
from softslip.sections.channel import Channel, Rheometer, Wall
from softslip.sections.material import Membrane, Solvent, Steric, Suspension
from softslip.sections.numerics import Hydrodynamics, TimeStepping
from softslip.sections.preparation import Expansion, Packing
from softslip.sections.recording import Recording
from softslip.sections.tree import Tree

__all__ = [
    "REFERENCE_MESH_SIZE",
    "REFERENCE_NODE_SPACING",
    "Channel",
    "Expansion",
    "Hydrodynamics",
    "Membrane",
    "Packing",
    "Recording",
    "Rheometer",
    "Section",
    "Solvent",
    "Standalone",
    "Steric",
    "Suspension",
    "TimeStepping",
    "Tree",
    "Wall",
]
