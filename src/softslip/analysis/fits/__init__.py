"""Laws fitted to flow curves, with uncertainties: Dataset → Dataset.

Every fit says in a sentence whether it was made. Errors are those of the weighted least-squares
fit, enlarged by √χ²_red where the scatter exceeds the errors of the points (χ²_red > 1).
"""

import xarray as xr

from softslip.analysis.fits.flow import flow_law, herschel_bulkley
from softslip.analysis.fits.points import FITTED
from softslip.analysis.fits.slip import slip_law
from softslip.analysis.fits.summary import summary

__all__ = ["FITTED", "fit_laws", "flow_law", "herschel_bulkley", "slip_law", "summary"]


def fit_laws(flow_curve: xr.Dataset) -> xr.Dataset:
    """Fit the Herschel-Bulkley law, and the slip law above and below its pooled yield stress.

    Returns
    -------
    xr.Dataset
        The variables of `herschel_bulkley` and of `slip_law`. Where the flow curve gives no yield
        stress there is no slip law either, and its messages say so.
    """
    flow = herschel_bulkley(flow_curve)
    error = flow["pooled_yield_stress_error"]
    slip = slip_law(flow_curve, flow["pooled_yield_stress"], error)
    return flow.merge(slip, compat="no_conflicts")
