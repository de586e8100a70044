"""Laws fitted to flow curves, with uncertainties: Dataset → Dataset.

Every fit says in a sentence whether it was made. Errors are those of maximum likelihood, enlarged
by √χ²_red where the points scatter by more than their errors allow (chance below 1 %); intervals
are those of the profile of the likelihood.
"""

import xarray as xr

from softslip.analysis.fits.critical_roughness import critical_roughness
from softslip.analysis.fits.finite_size import finite_size
from softslip.analysis.fits.flow import flow_law, herschel_bulkley
from softslip.analysis.fits.joint import flow_and_slip, law_in_use, yield_stress_of
from softslip.analysis.fits.points import FITTED
from softslip.analysis.fits.powers import powers
from softslip.analysis.fits.slip import slip_law
from softslip.analysis.fits.summary import summary
from softslip.analysis.observables import mean_over_seeds
from softslip.files.quantities import POOLED

__all__ = [
    "FITTED",
    "critical_roughness",
    "finite_size",
    "fit_laws",
    "flow_and_slip",
    "flow_law",
    "herschel_bulkley",
    "law_in_use",
    "powers",
    "slip_law",
    "summary",
    "yield_stress_of",
]


def fit_laws(flow_curve: xr.Dataset) -> xr.Dataset:
    """Fit the flow law; by its pooled yield stress the laws of slip, and the powers of the stress.

    Where the bulk alone does not determine a yield stress, that of flow and slip together takes
    its place (`flow_and_slip`), but for the exponent of slip, which it assumes. What depends on
    the size of the channel is fitted at each stress by itself.

    Returns
    -------
    xr.Dataset
        The variables of `herschel_bulkley`, `flow_and_slip`, `slip_law`, `powers`,
        `critical_roughness` and `finite_size`. Where neither determines a yield stress there is
        nothing that depends on it, and the messages say so.
    """
    averaged = mean_over_seeds(flow_curve)
    flow = herschel_bulkley(averaged)
    flow = flow.merge(flow_and_slip(averaged), compat="no_conflicts", join="exact")
    offset, error = yield_stress_of(flow, (POOLED,))
    known = yield_stress_of(flow)
    slip = slip_law(
        averaged,
        offset,
        error,
        linear_yield_stress=known[0],
        linear_yield_stress_error=known[1],
    )
    parts = [flow, slip, powers(averaged, *known), critical_roughness(slip)]
    parts.append(finite_size(averaged))
    return xr.merge(parts, compat="no_conflicts", join="exact")
