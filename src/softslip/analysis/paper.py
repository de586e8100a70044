"""What the paper reports, to compare with.

G. Jung and S. M. Fielding, *Wall slip and bulk yielding in soft particle suspensions*,
arXiv:1911.05392. Units are those of `config.parameters`.
"""

from dataclasses import dataclass

from softslip.config.sections import REFERENCE_MESH_SIZE


@dataclass(frozen=True)
class Reported:
    """A number as the paper gives it.

    Attributes
    ----------
    value
        The number.
    uncertainty
        Its standard error; None where the paper gives none.
    symbol
        How the paper writes it, as TeX.
    unit
        Its unit; "1" for a pure number.
    source
        Where the paper says so.
    """

    value: float
    uncertainty: float | None
    symbol: str
    unit: str
    source: str


@dataclass(frozen=True)
class Sample:
    """What a picture of a sample shows.

    Attributes
    ----------
    stress
        Imposed stress σ [stress unit].
    roughness
        Wall roughness β; None where the paper does not say.
    time
        Time t since the stress began [time unit].
    """

    stress: float
    roughness: float | None
    time: float


YIELD_STRESS = Reported(0.055, 0.004, r"\sigma_y", "stress unit", "Fig. 5, Sec. IV A")
"""Bulk yield stress, from the fit of a Herschel-Bulkley law to all roughnesses."""

FLOW_INDEX = Reported(0.57, 0.03, "n", "1", "Fig. 5, Sec. IV A")
"""Exponent of the Herschel-Bulkley law."""

YIELDING_EXPONENT = Reported(-1.3, None, r"\delta", "1", "Fig. 8d, Sec. IV C")
"""Exponent of the yielding time in the stress above yield."""

YIELDING_SNAPSHOT_TIME = Reported(17.5, None, r"t", "time unit", "Fig. 3")
"""When a sample is shown as it yields, at the stress and roughness below: not a mean."""

YIELDING_SNAPSHOT_STRESS = Reported(0.5, None, r"\sigma", "stress unit", "Fig. 3")
"""Stress of that sample."""

YIELDING_SNAPSHOT_ROUGHNESS = Reported(0.59, None, r"\beta", "1", "Fig. 3")
"""Wall roughness of that sample."""

FLOWING_SAMPLE = Sample(0.3, None, 254.0)
"""What Fig. 1 shows: a sample that flows."""

YIELDING_SAMPLE = Sample(
    YIELDING_SNAPSHOT_STRESS.value, YIELDING_SNAPSHOT_ROUGHNESS.value, YIELDING_SNAPSHOT_TIME.value
)
"""What Fig. 3 shows: a sample as it yields."""

SLIP_EXPONENT = Reported(1.0, None, "p", "1", "Fig. 6a-b, Sec. IV B")
"""Exponent of the slip velocity: in σ − σ_y above yield, in σ below it at smooth walls."""

CRITICAL_ROUGHNESS = Reported(0.3, None, r"\beta^*", "1", "Fig. 6c, Sec. IV B")
"""Roughness above which slip is suppressed, approximately."""

CRITICAL_ROUGHNESS_ABOVE = Reported(0.35, None, r"\beta^*", "1", "Sec. IV B, of Fig. 7")
"""The same as it is put for the slip lengths: there the two values bracket it."""

LEAST_SEPARATION = Reported(0.3, None, "H", "length unit", "Fig. 9c, Appendix A")
"""Wall separation above which neither the bulk nor the slip velocity depends on it."""

SEPARATION_EFFECT = Reported(0.0, None, r"\Delta_H", "1", "Fig. 9c, Appendix A")
"""Relative change of the bulk shear rate between wall separations from that one on."""

FULL_SEPARATION = Reported(0.44, None, "H", "length unit", "Sec. III, Fig. 9")
"""Wall separation of all other figures, to which Eq. A1 is pinned."""

HETEROGENEITY_EXPONENT = Reported(-0.8, None, r"\delta_{het}", "1", "Fig. 6d, Sec. IV B")
"""Exponent of the heterogeneity of the bulk flow in the stress."""

SOLVENT_LAYER = Reported(0.0025, None, r"\Delta y", "length unit", "Fig. 4, Sec. IV A")
"""Thickness of the solvent layer at a smooth wall, approximately."""

FLUIDISED_LAYER = Reported(0.1, None, r"\Delta y", "length unit", "Fig. 4, Sec. IV A")
"""Thickness of the fluidised layers of particles near a wall above yield, approximately."""

PROFILE_STRESS = Reported(0.15, None, r"\sigma", "stress unit", "Fig. 4")
"""Stress at which profiles of several roughnesses are compared."""

MEAN_RADIUS = Reported(0.0085, None, "R", "length unit", "Sec. III")
"""Mean radius of the particles, of which the bumps of the walls are a multiple: b = βR."""

CONTACT_LENGTH = Reported(
    9 * REFERENCE_MESH_SIZE, None, r"\sigma_{LJ}", "length unit", "Table III, Fig. 7"
)
"""Range of the contact force; the Newtonian slip length at a smooth wall, approximately."""


def newtonian_slip_length(bump_radius: float) -> Reported:
    """Return the Newtonian slip length that Sec. IV B reports, l ≈ σ_LJ + b.

    Parameters
    ----------
    bump_radius
        Radius b of the wall's bumps [length unit].
    """
    length = CONTACT_LENGTH.value + bump_radius
    return Reported(length, None, r"l_s^{newton}", "length unit", "Fig. 7, Sec. IV B")
