"""What each variable of the fits was fitted to."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from softslip.analysis.fits.critical_roughness import NAME as CRITICAL
from softslip.analysis.fits.finite_size import (
    FLAGS_OF_TRENDS,
    MOONEY_BULK,
    MOONEY_SLIP,
    SEPARATION,
    SIZES,
    trend_name,
)
from softslip.analysis.fits.flow import PARAMETERS
from softslip.analysis.fits.powers import EXPONENTS
from softslip.analysis.fits.slip import (
    COEFFICIENT,
    EVIDENCE,
    EXPONENT,
    FILM,
    INTERCEPT,
    NEWTONIAN,
)
from softslip.files.quantities import JOINT, POOLED

SLIP_LAWS = {NEWTONIAN: -1, COEFFICIENT: 1, EXPONENT: 1, INTERCEPT: 1}
"""Parameters of slip, and on which side of yield they are fitted."""

WITHOUT_YIELD_STRESS = (NEWTONIAN, INTERCEPT)
"""Those that need no yield stress: without one, the bulk's verdicts tell the sides."""

BY_THE_BULK_ALONE = (EXPONENT, INTERCEPT)
"""Those that the yield stress of flow and slip together does not serve, as it assumes p = 1."""


@dataclass(frozen=True)
class Law:
    """What a fitted variable was fitted to.

    Attributes
    ----------
    series, flag
        Variables of the flow curve: the points, and whether each is steady.
    points
        Variable of the fits with the number of points.
    message
        Variable of the fits that says whether it was fitted.
    side
        1 for stresses above the yield stress only, -1 for those below, 0 for all.
    alone
        Whether it is also fitted where the yield stress is not known.
    prefixes
        Beginnings of the names of the yield stresses that tell the sides, the first that is known.
    film
        Variable of the fits that says whether all points were fitted, beside a film; empty where
        there is none.
    smoothest
        Whether it is fitted at the smoothest wall only.
    size
        Dimension of the channel's size that it is fitted over at each stress; empty where it is
        fitted over stresses.
    """

    series: str
    flag: str
    points: str
    message: str
    side: int
    alone: bool = False
    prefixes: tuple[str, ...] = (POOLED, JOINT)
    film: str = ""
    smoothest: bool = False
    size: str = ""


_OF_BOTH = f"{JOINT}points", f"{JOINT}fit_message", 0
BULK = Law("shear_rate_bulk", "steady_bulk", *_OF_BOTH)
SLIP = Law("slip_velocity", "steady_slip", *_OF_BOTH, smoothest=True)
"""What flow and slip were fitted to with one yield stress; their points are counted together."""


def laws_of(variable: str) -> tuple[Law, ...]:
    """Return all that a variable of the fits was fitted to, nothing where it is no such outcome."""
    if variable.startswith(JOINT):
        return BULK, SLIP
    law = law_of(variable)
    return () if law is None else (law,)


def law_of(variable: str) -> Law | None:
    """Return what a variable of the fits was fitted to, None where it is no outcome of a fit.

    Of what was fitted to flow and slip together it is the flow.
    """
    if variable.startswith(JOINT):
        return BULK
    if variable == EVIDENCE:
        return law_of(EXPONENT)
    if variable.startswith(CRITICAL):
        # It follows from the slip coefficients of all roughnesses.
        return replace(_slip_law(COEFFICIENT), message=f"{CRITICAL}_message")
    for name in SLIP_LAWS:
        if variable == name or variable.startswith(f"{name}_"):
            return _slip_law(name)
    for name, law in _LAWS_OF_SIZE.items():
        if variable == name or variable.startswith(f"{name}_"):
            return law
    prefix = POOLED if variable.startswith(POOLED) else ""
    bare = variable.removeprefix(prefix)
    for series, name in EXPONENTS.items():
        if bare == name or bare.startswith(f"{name}_"):
            side = 0 if series == "heterogeneity" else 1
            return Law(series, "", f"{prefix}{name}_points", f"{prefix}{name}_message", side)
    bare = bare.removesuffix("_error").removesuffix("_interval")
    if bare in (*PARAMETERS, "covariance", "reduced_chi_square", "points", "fit_message"):
        return Law("shear_rate_bulk", "steady_bulk", f"{prefix}points", f"{prefix}fit_message", 0)
    return None


def _slip_law(name: str) -> Law:
    """Return what a parameter of slip was fitted to."""
    points, message = f"{name}_points", f"{name}_message"
    prefixes = (POOLED,) if name in BY_THE_BULK_ALONE else (POOLED, JOINT)
    return Law(
        "slip_velocity",
        "steady_slip",
        points,
        message,
        SLIP_LAWS[name],
        alone=name in WITHOUT_YIELD_STRESS,
        prefixes=prefixes,
        film="" if name == NEWTONIAN else f"{name}{FILM}",
    )


def _law_of_size(name: str, series: str, flag: str, size: str) -> Law:
    """Return what is fitted over a size of the channel."""
    return Law(series, flag, f"{name}_points", f"{name}_message", 0, size=size)


_LAWS_OF_SIZE: Mapping[str, Law] = {
    **dict.fromkeys(
        (MOONEY_SLIP, MOONEY_BULK),
        _law_of_size(MOONEY_SLIP, "shear_rate_wall", "steady_wall", SEPARATION),
    ),
    **{
        trend_name(series, size): _law_of_size(trend_name(series, size), series, flag, size)
        for size in SIZES
        for series, flag in FLAGS_OF_TRENDS.items()
    },
}
"""What the outcomes of `analysis.fits.finite_size` were fitted to, by their parameter."""
