"""Coverage of what is fitted to flow curves, and what the evidence for the law of slip says."""

import numpy as np
import xarray as xr
from numpy.random import SeedSequence

from softslip.analysis.fits import FITTED, fit_laws, herschel_bulkley
from softslip.analysis.fits.flow import PARAMETERS
from softslip.analysis.fits.slip import CONCLUSIVE, EVIDENCE
from softslip.files.quantities import JOINT, POOLED
from softslip.studies.coverage.made_up_curves import CurveKind
from softslip.studies.coverage.tallies import Tally

NOT_FITTED = "not fitted"
"""Said of an estimate that was not made, or that the points do not determine."""

LINEAR, QUADRATIC, NEITHER = "linear", "quadratic", "neither"

FAVOURED = (LINEAR, QUADRATIC, NEITHER)
"""What the evidence may favour; neither, too, where there is none."""


def curve_tallies(kind: CurveKind, draws: int, key: int) -> dict[str, Tally]:
    """Fit many flow curves of one kind; by the name of the parameter.

    Where it depends on roughness, a parameter is that of the smoothest wall. The evidence for
    linear slip is among them for imposed stress, without intervals.
    """
    tallies = {name: Tally() for name in kind.truths}
    if not kind.imposed_rate:
        tallies[EVIDENCE] = Tally()
    for number in range(draws):
        random = np.random.default_rng(SeedSequence((2, key, number)))
        curve = kind.drawn(random)
        fits = herschel_bulkley(curve) if kind.imposed_rate else fit_laws(curve)
        for name, tally in tallies.items():
            if name == EVIDENCE:
                tally.add(_favoured(float(_smoothest(fits[name]))), None, np.nan)
                continue
            said = str(_smoothest(fits[_message_of(name)]).item())
            ends = _smoothest(fits[f"{name}_interval"]).values
            value = float(_smoothest(fits[name]))
            tally.add(said if said == FITTED else NOT_FITTED, ends, kind.truths[name], value)
    return tallies


def _smoothest(fitted: xr.DataArray) -> xr.DataArray:
    """Return what was fitted at the smoothest wall."""
    return fitted.isel(roughness=0) if "roughness" in fitted.dims else fitted


def _message_of(name: str) -> str:
    """Return the name of the message on a parameter; those of the flow law share one."""
    prefix = next((each for each in (POOLED, JOINT) if name.startswith(each)), "")
    shared = name.removeprefix(prefix) in PARAMETERS
    return f"{prefix}fit_message" if shared else f"{name}_message"


def _favoured(evidence: float) -> str:
    """Return which exponent of slip a logarithm of the ratio of likelihoods favours."""
    if abs(evidence) > CONCLUSIVE:
        return LINEAR if evidence > 0 else QUADRATIC
    return NEITHER
