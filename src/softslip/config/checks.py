"""What must hold between values of different keys.

Values are checked once, here and by their own fields; below this module nobody checks again.
"""

import math

from softslip.config.contact_points import check_films
from softslip.config.resolution import check_box, check_ewald, check_nodes
from softslip.config.sections import Tree
from softslip.config.space import check_bulk, check_bumps, check_free_area, check_particles
from softslip.errors import ConfigError
from softslip.messages import brief

MOST_STEPS = 10**9
"""More time steps than this are taken for a typo in a time."""


def _check_level(parameters: Tree) -> None:
    if parameters.accuracy is not None and parameters.fidelity is not None:
        raise ConfigError(
            "accuracy",
            parameters.accuracy,
            f"is given together with fidelity {parameters.fidelity!r}, which sets the same keys",
            "give one of the two",
        )


def _check_rheometer(parameters: Tree) -> None:
    rheometer = parameters.rheometer
    given: dict[str, float | None] = {
        "stress": rheometer.stress,
        "shear_rate": rheometer.shear_rate,
    }
    imposed = "stress" if rheometer.mode == "stress" else "shear_rate"
    if given.pop(imposed) is None:
        raise ConfigError(
            f"rheometer.{imposed}",
            brief(None),
            f"must be a number when rheometer.mode is '{rheometer.mode}'",
            f"give rheometer.{imposed}",
        )
    for other, value in given.items():
        if value is not None:
            raise ConfigError(
                f"rheometer.{other}",
                value,
                f"has no effect when rheometer.mode is '{rheometer.mode}'",
                f"set rheometer.{other} to null",
            )
    if rheometer.mode == "rate" and rheometer.control == "printed":
        raise ConfigError(
            "rheometer.control",
            "printed",
            "is defined for an imposed stress only",
            "use 'exact' when rheometer.mode is 'rate'",
        )


def _check_times(parameters: Tree) -> None:
    stepping = parameters.time_stepping
    durations = {"shear_time": stepping.shear_time, "ageing_time": stepping.ageing_time}
    for name, duration in durations.items():
        if 0 < duration < stepping.step:
            raise ConfigError(
                f"time_stepping.{name}",
                duration,
                f"is shorter than one step of {stepping.step:g}",
                f"use a longer {name} or a smaller time_stepping.step",
            )
        if duration > MOST_STEPS * stepping.step:
            raise ConfigError(
                f"time_stepping.{name}",
                duration,
                f"takes more than {MOST_STEPS:.0e} steps of {stepping.step:g}",
                f"use a shorter {name} or a larger time_stepping.step",
            )


def _check_snapshots(parameters: Tree) -> None:
    shear_time, earlier = parameters.time_stepping.shear_time, -math.inf
    for index, time in enumerate(parameters.recording.snapshots):
        if not 0 <= time <= shear_time:
            raise ConfigError(
                f"recording.snapshots[{index}]",
                time,
                f"lies outside the shear stage, 0 to {shear_time:g}",
                "use times within time_stepping.shear_time",
            )
        if time <= earlier:
            raise ConfigError(
                f"recording.snapshots[{index}]",
                time,
                f"does not come after the time before it, {earlier:g}",
                "list each time once, in increasing order",
            )
        earlier = time


CHECKS = (
    _check_level,
    check_bumps,
    check_free_area,
    check_particles,
    check_bulk,
    check_box,
    check_ewald,
    check_nodes,
    _check_rheometer,
    _check_times,
    _check_snapshots,
    check_films,
)
"""What must hold between values of different keys, in the order in which it is checked."""
