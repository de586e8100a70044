"""From the records of runs to numbers with uncertainties: Dataset → Dataset.

Meets the solver only at the schema of the shear stage's files. Modules here import scipy as a
whole, which loads its parts when they are used: drawing a snapshot needs few of them. "Eq.", "Fig."
and "Sec." are those of the paper.
"""

from softslip.analysis.observables.seeds import mean_over_seeds
from softslip.analysis.observables.series import parameters_of
from softslip.analysis.observables.slip_lengths import slip_lengths
from softslip.analysis.observables.steady import steady_state
from softslip.analysis.observables.tables import collect
from softslip.analysis.observables.timescales import slip_time, yielding_time
from softslip.analysis.observables.velocity_fields import (
    heterogeneity,
    mean_profile,
    non_affine_velocity,
)

__all__ = [
    "collect",
    "heterogeneity",
    "mean_over_seeds",
    "mean_profile",
    "non_affine_velocity",
    "parameters_of",
    "slip_lengths",
    "slip_time",
    "steady_state",
    "yielding_time",
]
