"""By how much each quantity of a result may differ when it is recomputed on another machine.

The same code on the same kind of machine with the same software gives the same bytes. Elsewhere
numbers are rounded otherwise, and what follows depends on what they are of. The tolerances were
chosen from runs of 28 particles, of which one began from positions that had been changed by one
unit in the last place; each `Tolerance` says why it is as it is.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from softslip.files.products import COMPARISON, FITS, TABLES

EARLY_STRAIN = 0.5
"""Strain up to which two runs stay together: differences of rounding grew about tenfold for each
unit of strain in the runs that tolerances were chosen from."""


@dataclass(frozen=True)
class Tolerance:
    """By how much a quantity may differ on another machine.

    Attributes
    ----------
    tolerance
        Largest difference over the scale.
    reason
        Why it is as large as that.
    scale
        ``"own"`` for the root mean square of the quantity itself, or the name of an attribute or
        variable whose root mean square it is.
    chaotic
        Whether the quantity parts with strain: then only what comes before `EARLY_STRAIN` is held
        to the tolerance, and of what comes late only the mean is compared.
    """

    tolerance: float
    reason: str
    scale: str = "own"
    chaotic: bool = False


EXACT = Tolerance(0.0, "a number, word or flag that no rounding changes")
ROUNDING = Tolerance(1e-12, "a few operations on the parameters")
SUMS = Tolerance(1e-9, "sums and fits of straight lines over its runs")
FITTED = Tolerance(1e-5, "where a search for the least squares stops")
MINIMISED = Tolerance(
    0.25,
    "minimised by LAMMPS until forces are small, and then moved by noise: 0.02 of a radius apart "
    "after 10,000 steps, 0.12 after 50,000",
    scale="mean_radius",
)
GROWN = Tolerance(
    1e-6, "growth is overdamped: differences grew a hundredfold, to 3e-14", "mean_radius"
)
FLOW = Tolerance(
    5e-3,
    "steps are chosen from errors and tethers solved for to a residual, both of which rounding "
    "moves: 1e-4 of slip velocities, 5e-4 of deviations of areas",
    chaotic=True,
)
POSITION = replace(FLOW, scale="mean_radius")
NOISE = replace(FLOW, scale="traction", reason="what is left over of the balance of stress")

TOLERANCES: Mapping[str, tuple[Tolerance, Mapping[str, Tolerance]]] = {
    "packing": (ROUNDING, {"centre": MINIMISED}),
    "expansion": (SUMS, {"node_position": GROWN}),
    "ageing": (
        FLOW,
        {"node_position": POSITION, "wall_displacement": POSITION, "reference_area": ROUNDING},
    ),
    "shear": (
        FLOW,
        {
            "node_position": POSITION,
            "stress_deviation": NOISE,
            **dict.fromkeys(
                ("time", "interval", "profile_time", "snapshot_time", "wall_distance"), ROUNDING
            ),
            **dict.fromkeys(("field_x", "field_y"), ROUNDING),
        },
    ),
    **dict.fromkeys(TABLES, (SUMS, {})),
    FITS: (FITTED, {}),
    COMPARISON: (FITTED, {}),
}
"""For each stage the tolerance of its quantities, and those that have one of their own."""

MEASURED = {
    # Of a relative error, which is rounding itself.
    "largest_area_error": 1e-9,
    # The tolerance of positions times the paper's mean radius, and over a contact's thickness.
    "smallest_distance": 1e-8,
    "smallest_distance_over_contact_length": 1e-4,
}
"""Attributes of an expansion that are measured, and by how much each may differ."""


@dataclass(frozen=True)
class Difference:
    """One quantity of a result, compared.

    Attributes
    ----------
    name
        Of a variable or attribute, with what was compared of it.
    difference, tolerance
        Found and allowed, over the quantity's scale.
    reason
        Of the tolerance.
    """

    name: str
    difference: float
    tolerance: float
    reason: str

    @property
    def fits(self) -> bool:
        """Whether the difference is allowed."""
        return self.difference <= self.tolerance

    def as_mapping(self) -> dict[str, Any]:
        """Return it as JSON has it: no difference is larger than that of different things."""
        finite = self.difference if np.isfinite(self.difference) else None
        return asdict(self) | {"difference": finite, "fits": self.fits}


def different(name: str) -> Difference:
    """Return what no tolerance allows: a difference of kind."""
    return Difference(name, np.inf, EXACT.tolerance, EXACT.reason)
