"""When a run may end before its time."""

from softslip.config.fields import quantity
from softslip.config.sections.base import Section


class Until(Section):
    """What ends the shear stage before `TimeStepping.shear_time`."""

    error: float | None = quantity(
        None,
        symbol="δ_γ̇",
        unit="1",
        ge=1e-4,
        lt=1,
        description="Relative standard error at which the mean shear rates are known well enough, "
        "of the wall and in the bulk (the mean stress, where the rate is imposed); null runs for "
        "time_stepping.shear_time.",
    )
