"""What a run writes down."""

from typing import Annotated

from pydantic import Strict

from softslip.config.fields import quantity
from softslip.config.sections.base import Section


class Recording(Section):
    """What a run writes."""

    stride: int = quantity(
        5,
        symbol="n_s",
        unit="1",
        ge=1,
        le=10**6,
        description="Steps between two samples of the observables.",
    )
    samples_per_decade: int = quantity(
        30,
        symbol="n_dec",
        unit="1",
        ge=1,
        le=10**4,
        description="Records per decade of time; each record is the mean over its interval.",
    )
    longest_interval: float = quantity(
        5.0, symbol="Δt_max", unit="time unit", gt=0, description="Longest interval of one record."
    )
    profile_interval: float = quantity(
        15.0,
        symbol="Δt_p",
        unit="time unit",
        gt=0,
        description="Interval of one velocity profile, which is the mean over it.",
    )
    bulk_margin: float | None = quantity(
        5.0,
        symbol="m/R",
        unit="1",
        paper=5.0,
        gt=0,
        description="Distance from the walls, in mean radii, where the bulk begins; null records "
        "no bulk observables.",
    )
    snapshots: Annotated[tuple[float, ...], Strict(False)] = quantity(
        (),
        symbol="t_snap",
        unit="time unit",
        description="Times of the shear stage at which membranes and the velocity field are kept.",
    )
    field_spacing: float = quantity(
        0.25,
        symbol="Δ_field/R",
        unit="1",
        gt=0,
        description="Distance between the points of a kept velocity field, in mean radii.",
    )
