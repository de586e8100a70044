"""Slip velocity above and below yield."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from softslip.analysis.fits.branches import quantile_factors, two_branches
from softslip.analysis.fits.likelihood import Problem
from softslip.analysis.fits.measured_points import FloatArray, Points, dimensionless
from softslip.analysis.fits.outcomes import LawToFit, fitted, least_deviance
from softslip.analysis.fits.points import (
    DRIVES,
    FITTED,
    Fit,
    each_cell,
    laid_out,
    nothing,
    number_at,
    with_stress,
)
from softslip.analysis.observables import mean_over_seeds
from softslip.files.quantities import described

CLEAR = 2.0
"""Errors of the yield stress by which a stress is clearly above or below it."""

QUADRATIC = 2.0
"""Exponent that p = 1 is compared with (Refs. 21, 22 of the paper)."""

CONCLUSIVE = 3.0
"""Size of the evidence, a logarithm of a ratio of likelihoods, from which it favours an exponent:
one is then twenty times as likely as the other."""

COEFFICIENT, NEWTONIAN = "slip_coefficient", "newtonian_slip_coefficient"
EXPONENT, INTERCEPT = "slip_exponent", "slip_yield_stress"
EVIDENCE = "slip_linear_evidence"

FILM = "_film"
"""End of the names of what says whether a law was fitted beside a film, to all points."""

LINEAR = (COEFFICIENT, NEWTONIAN)
"""Parameters of the laws with p = 1."""

LEAST_POINTS = {COEFFICIENT: 2, EXPONENT: 3, INTERCEPT: 3, NEWTONIAN: 2}
"""Fewest points of each fit, on its side of the yield stress."""


@dataclass(frozen=True)
class SlipLaw:
    """A law of slip above yield, V = A ((σ − σ_y)/Δ)^p, with Δ the largest σ − σ_y.

    Where there is a film of solvent the wall slips by it, V = ν_N σ, as long as that is faster.

    Attributes
    ----------
    offset, offset_error
        σ_y and its error, over the unit of stress.
    exponent
        p; None where it is free.
    film
        Whether there is a film.
    """

    offset: float
    offset_error: float
    exponent: float | None = 1.0
    film: bool = False

    def over(self, stress: float) -> "SlipLaw":
        """Return the law over a unit of stress."""
        return replace(self, offset=self.offset / stress, offset_error=self.offset_error / stress)

    def problem(self, points: Points) -> tuple[Problem, list[FloatArray]]:
        """Return the fit, and what to start from: parameters A, p where it is free, ν_N, σ_y.

        σ_y is as likely as its error says; it is no parameter where it is exact.
        """
        largest = float(points.abscissa.max()) - self.offset
        exact = self.offset_error == 0

        def deviations(parameters: FloatArray) -> FloatArray:
            level, power, newtonian, start = self._named(parameters)
            excess = np.maximum(points.abscissa - start, 1e-9 * largest)
            speeds = level * (excess / largest) ** power
            if self.film:
                speeds = np.maximum(speeds, newtonian * points.abscissa)
            found = (points.value - speeds) / points.error
            doubt = (start - self.offset) / self.offset_error if not exact else 0.0
            return found if exact else np.append(found, doubt)

        freedom = points.freedom if exact else np.append(points.freedom, 1e6)
        return Problem(deviations, freedom, points.common), self._starts(points)

    def _named(self, parameters: FloatArray) -> tuple[float, float, float, float]:
        """Return A, p, ν_N and σ_y, those too that are no parameters."""
        rest = list(parameters)
        level = rest.pop(0)
        power = rest.pop(0) if self.exponent is None else self.exponent
        newtonian = rest.pop(0) if self.film else 0.0
        return level, power, newtonian, rest.pop(0) if rest else self.offset

    def _starts(self, points: Points) -> list[FloatArray]:
        if self.film:
            # Where the other branch is faster, if anywhere.
            level, film = float(points.value[-1]), [float(points.value[0] / points.abscissa[0])]
        else:
            weights = (points.abscissa - self.offset) / points.error**2
            level, film = float(np.average(points.value, weights=weights)), []
        middle = [] if self.exponent is not None else [1.0]
        last = [] if self.offset_error == 0 else [self.offset]
        return [np.array([level * factor, *middle, *film, *last]) for factor in (1.0, 2.0)]


def has_film(below: Points) -> bool:
    """Tell whether walls slip below yield by a film of solvent: V/σ is above 0 for certain.

    It is where the wider interval of ν_N is, which counts how few samples errors are known from.

    Parameters
    ----------
    below
        Slip velocities at stresses below yield.
    """
    if not below.count:
        return False
    film = _fit_below(below)
    return film.message == FITTED and bool(film.intervals[0, -1, 0] > 0)


def _fit_above(points: Points, law: SlipLaw) -> Fit:
    """Fit ν with p = 1."""
    scaled, stress, speed = dimensionless(points)
    law = law.over(stress)
    problem, starts = law.problem(scaled)
    unit = speed / (1 - law.offset) / stress
    free = LawToFit(problem, starts, (unit,), ("the slip coefficient",), law.film)
    return fitted(free, points.count)


def _fit_exponent(points: Points, law: SlipLaw) -> Fit:
    """Fit p with a free coefficient, and compare p = 1 with p = 2."""
    scaled, stress, _ = dimensionless(points)
    law = law.over(stress)
    problem, starts = replace(law, exponent=None).problem(scaled)

    def turned(parameters: FloatArray) -> FloatArray:
        return problem.deviations(np.concatenate(([parameters[1], parameters[0]], parameters[2:])))

    first = [np.concatenate(([start[1], start[0]], start[2:])) for start in starts]
    turned_problem = replace(problem, deviations=turned)
    free = LawToFit(turned_problem, first, (1.0,), ("the exponent",), law.film)
    linear, quadratic = (
        least_deviance(LawToFit(*replace(law, exponent=power).problem(scaled), (1.0,), ("",)))
        for power in (1.0, QUADRATIC)
    )
    more = {"evidence": 0.5 * (quadratic - linear)}
    return replace(fitted(free, points.count), more=more)


def _starts_of_line(points: Points, offset: float) -> list[FloatArray]:
    """Return σ' and ν to start from: those of a line through all points, from σ_y or from 0."""
    slope, _ = np.polyfit(points.abscissa, points.value, 1, w=1 / points.error)
    return [np.array([start, slope]) for start in (offset, 0.0)]


def _starts_of_branches(points: Points) -> list[FloatArray]:
    """Return σ', ν and ν_N to start from: a film at the first points, a line through the others.

    One for each number of points that may belong to the film.
    """
    found = []
    for first in range(1, points.count - 1):
        low = np.arange(points.count) < first
        film, rest = points.where(low), points.where(~low)
        weights = (film.abscissa / film.error) ** 2
        newtonian = np.average(film.value / film.abscissa, weights=weights)
        slope, level = np.polyfit(rest.abscissa, rest.value, 1, w=1 / rest.error)
        found.append(np.array([-level / slope, slope, newtonian]))
    return found


def _fit_intercept(points: Points, law: SlipLaw) -> Fit:
    """Fit the stress at which slip begins, V = ν (σ − σ'), with a free coefficient."""
    scaled, stress, _ = dimensionless(points)

    def deviations(parameters: FloatArray) -> FloatArray:
        if law.film:
            speeds = two_branches(scaled.abscissa, *parameters)
        else:
            speeds = parameters[1] * (scaled.abscissa - parameters[0])
        return np.asarray((scaled.value - speeds) / scaled.error)

    free = LawToFit(
        Problem(deviations, scaled.freedom, scaled.common),
        _starts_of_line(scaled, law.offset / stress),
        (stress,),
        ("the stress at which slip begins",),
    )
    if law.film:

        def factors(parameters: FloatArray) -> FloatArray:
            return quantile_factors(scaled.abscissa, scaled.error, parameters)

        free = replace(
            free, starts=_starts_of_branches(scaled), branched=True, quantile_factors=factors
        )
    return fitted(free, points.count)


def _fit_below(points: Points) -> Fit:
    """Fit V = ν_N σ."""
    scaled, stress, speed = dimensionless(points)
    problem, starts = SlipLaw(0.0, 0.0).problem(scaled)
    return fitted(
        LawToFit(problem, starts, (speed / stress,), ("the slip coefficient",)), points.count
    )


def slip_law(
    flow_curve: xr.Dataset,
    yield_stress: float | xr.DataArray,
    yield_stress_error: float | xr.DataArray = 0.0,
    *,
    linear_yield_stress: float | xr.DataArray | None = None,
    linear_yield_stress_error: float | xr.DataArray | None = None,
) -> xr.Dataset:
    """Fit the slip velocity above and below yield (Fig. 6a-c).

    V_s = ν (σ − σ_y)^p for σ > σ_y and V_s = ν_N σ for σ < σ_y, by maximum likelihood with the
    errors of V_s (at least 1 %, Student's by their degrees of freedom). Every point enters whose
    verdict is steady, or steady within its error, also where V_s is zero or negative, as at rough
    walls. A stress counts as above or below yield if it is so by two errors of σ_y. σ_y itself is
    fitted along, as likely as its error says. Where σ_y is not known, the two laws without it are
    fitted by verdicts: below the least stress at which the bulk flows, and from there on. Seeds are
    averaged and judged together first.

    Smooth walls slip by a film of solvent below yield, which is still there above: until
    ν (σ − σ_y)^p is faster, they slip by ν_N σ. Where the points below yield show such a film, by
    two errors of ν_N, the laws above yield are fitted to all points as the faster of the two, with
    ν_N free; elsewhere to the points above alone.

    Parameters
    ----------
    flow_curve
        From `analysis.observables.flow_curve`, with a dimension ``stress``.
    yield_stress, yield_stress_error
        σ_y and its error [stress unit], one number or one for each combination of some of the
        other dimensions, as from `herschel_bulkley`; NaN leaves nothing to fit.
    linear_yield_stress, linear_yield_stress_error
        The same for ν and ν_N, if others: what was found by the slip itself, with p = 1, tells
        nothing of p.

    Returns
    -------
    xr.Dataset
        For every combination of the other dimensions: ``slip_coefficient`` (ν, p = 1),
        ``newtonian_slip_coefficient`` (ν_N) [length unit / time unit / stress unit],
        ``slip_exponent`` (p, free) and ``slip_yield_stress`` (σ_y free, p = 1), each with
        ``_error``, ``_interval``, ``_reduced_chi_square``, ``_points`` and ``_message``, and all
        but ν_N with ``_film``, whether there is a film beside it; and ``slip_linear_evidence``,
        the natural logarithm of the likelihood of p = 1 over that of p = 2, which have as many
        parameters: above 3 for p = 1, below −3 for p = 2, else neither (`CONCLUSIVE`).
    """
    averaged = with_stress(mean_over_seeds(flow_curve))
    flowing = least_flowing_stress(averaged)
    given = yield_stress, yield_stress_error
    linear = given
    if linear_yield_stress is not None and linear_yield_stress_error is not None:
        linear = linear_yield_stress, linear_yield_stress_error
    parts = []
    for name in _MAKERS:
        value, error = linear if name in LINEAR else given
        offsets = xr.Dataset({"value": value, "error": error, "flowing": flowing})
        parts.append(_fitted_everywhere(averaged, offsets, name))
    return xr.merge(parts, compat="no_conflicts", join="exact")


_MAKERS: dict[str, Callable[[Points, SlipLaw], Fit]] = {
    COEFFICIENT: _fit_above,
    EXPONENT: _fit_exponent,
    INTERCEPT: _fit_intercept,
    NEWTONIAN: lambda points, _: _fit_below(points),
}
"""What fits each parameter, given the law that the points are to follow."""


def _fitted_everywhere(flow_curve: xr.Dataset, offsets: xr.Dataset, name: str) -> xr.Dataset:
    """Fit one parameter in every cell."""

    def fit(at: dict[str, int], points: Points) -> Fit:
        offset, error = number_at(offsets["value"], at), number_at(offsets["error"], at)
        if math.isfinite(offset) and math.isfinite(error):
            above, below = (on_side(points.abscissa, offset, error, side) for side in (True, False))
        elif name in (NEWTONIAN, INTERCEPT):
            above = points.abscissa >= number_at(offsets["flowing"], at)
            below, offset, error = ~above, 0.0, 0.0
        else:
            return nothing(1, 0, "the yield stress is not known")
        side = points.where(below if name == NEWTONIAN else above)
        if side.count < LEAST_POINTS[name]:
            said = f"too few steady points: {side.count} of at least {LEAST_POINTS[name]}"
            return nothing(1, side.count, said)
        law = SlipLaw(offset, error, film=name != NEWTONIAN and has_film(points.where(below)))
        made = _MAKERS[name](points if law.film else side, law)
        return replace(made, more={**made.more, FILM: float(law.film)})

    dims, fits = each_cell(flow_curve, "slip_velocity", "steady_slip", DRIVES, fit)
    part = laid_out(flow_curve, dims, fits, (name,), f"{name}_")
    shape = tuple(flow_curve.sizes[dim] for dim in dims)

    def further(key: str, otherwise: float) -> tuple[tuple[str, ...], FloatArray]:
        every = [fits[place].more.get(key, otherwise) for place in np.ndindex(*shape)]
        return dims, np.reshape(every, shape)

    if name == EXPONENT:
        part[EVIDENCE] = further("evidence", np.nan)
    if name != NEWTONIAN:
        part[f"{name}{FILM}"] = part[f"{name}_points"].copy(data=further(FILM, 0.0)[1] > 0)
    return described(part)


def least_flowing_stress(flow_curve: xr.Dataset) -> xr.DataArray:
    """Return the least stress at which the bulk flows at any roughness; NaN where it never does."""
    stress = flow_curve["stress"].where(flow_curve["steady_bulk"])
    return stress.min([dim for dim in stress.dims if dim in (*DRIVES, "roughness")])


def on_side(stress: FloatArray, offset: float, error: float, above: bool) -> np.ndarray:
    """Tell which stresses are clearly above, or below, a yield stress with an error."""
    side = 1.0 if above else -1.0
    return np.asarray(side * (stress - offset) > CLEAR * error)
