"""From the model's units to those of a laboratory: pascal, second and micrometre.

The equations have one length, the particles' mean radius R, and with the solvent's viscosity η and
the membranes' elastic constant K_e one time and one stress. Tension is T = K_e (λ − 1) (Eq. 4), a
force per depth like a surface tension, and its derivative along a membrane is a stress: K_e is a
stress times a length (Table III gives its unit where the unit of length is 1). If R, η and K_e of a
suspension in the laboratory are R', η' and K_e',

    unit of length = R'/R,  unit of stress = (K_e'/K_e) / (R'/R),
    unit of time   = (η'/η) / unit of stress,

and σ R/K_e and γ̇ η R/K_e are the same in both. All other numbers of the model (area fraction,
roughness, range of contacts over R, contact energy over K_e R) have no units, so that the mapping
holds for the suspension with these numbers.
"""

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from softslip.errors import ConfigError, DatasetError
from softslip.messages import brief

MICRO = 1e-6
"""Metres in a micrometre."""

NEEDED: Mapping[str, tuple[str, str]] = {
    "viscosity": ("solvent.viscosity", "Pa s, such as 1e-3 for water"),
    "elastic-constant": ("membrane.elastic_constant", "N/m, such as 1e-2 for an emulsion"),
    "radius": ("suspension.mean_radius", "µm, such as 1"),
}
"""What is to be known of a suspension in the laboratory: its parameter and unit."""

_DIMENSIONS = {
    "length unit": {"length": 1},
    "time unit": {"time": 1},
    "stress unit": {"stress": 1},
    "viscosity unit": {"stress": 1, "time": 1},
}
"""Units of the model, as powers of those that are converted."""

_LAB = {"length": "µm", "time": "s", "stress": "Pa"}


@dataclass(frozen=True)
class LabUnits:
    """The units of the model in those of a laboratory.

    Attributes
    ----------
    length
        Unit of length [µm].
    time
        Unit of time [s].
    stress
        Unit of stress [Pa].
    """

    length: float
    time: float
    stress: float

    @classmethod
    def of(cls, scenario: Mapping[str, Any], measured: Mapping[str, float | None]) -> "LabUnits":
        """Return the units of the results of a scenario.

        Parameters
        ----------
        scenario
            Its base and axes, as its datasets carry them.
        measured
            `NEEDED` of the suspension in the laboratory: viscosity [Pa s], elastic constant [N/m]
            and radius [µm].

        Raises
        ------
        ConfigError
            When one of them is missing or not positive, or the scenario sweeps its parameter.
        DatasetError
            When the scenario does not say what its parameters are.
        """
        viscosity, elastic, radius = (
            _positive(name, measured.get(name)) / _of_model(name, scenario) for name in NEEDED
        )
        stress = elastic / (radius * MICRO)
        return cls(length=radius, time=viscosity / stress, stress=stress)

    def factor(self, unit: str) -> tuple[float, str]:
        """Return by what a value in a unit of the model is multiplied, and the unit that it has.

        Parameters
        ----------
        unit
            As datasets spell it: products and quotients of units, such as
            ``length unit / time unit``; pure numbers, angles and words stay as they are.

        Raises
        ------
        ConfigError
            When its powers are no whole numbers, as those of a Herschel-Bulkley consistency.
        """
        if "unit" not in unit:
            return 1.0, unit
        powers: Counter[str] = Counter()
        for place, part in enumerate(unit.split(" / ")):
            for each in part.split(" * "):
                name = each.removesuffix(" squared")
                if name == "1":
                    continue
                if name not in _DIMENSIONS:
                    limit = "has no counterpart that is the same for all values"
                    remedy = "export the flow curve and fit it in units of the laboratory"
                    raise ConfigError("unit", brief(unit), limit, remedy)
                sign = (-1 if place else 1) * (2 if name != each else 1)
                for dimension, power in _DIMENSIONS[name].items():
                    powers[dimension] += sign * power
        product = math.prod(float(getattr(self, name)) ** power for name, power in powers.items())
        return product, _spelt(powers)


def _spelt(powers: Mapping[str, int]) -> str:
    """Return a product of powers, such as µm/s."""
    over = [_power(name, power) for name, power in powers.items() if power > 0]
    under = [_power(name, -power) for name, power in powers.items() if power < 0]
    return "/".join([" ".join(over) or "1", *under])


def _power(name: str, power: int) -> str:
    return _LAB[name] + (f"^{power}" if power != 1 else "")


def _positive(name: str, value: float | None) -> float:
    """Return a number that was given for the laboratory.

    Raises
    ------
    ConfigError
        When it is missing or not positive.
    """
    if value is None or not 0 < value < math.inf:
        limit = "is not given" if value is None else "must be a number above 0"
        raise ConfigError(name, brief(value), limit, f"give it in {NEEDED[name][1]}")
    return value


def _of_model(name: str, scenario: Mapping[str, Any]) -> float:
    path = NEEDED[name][0]
    group, key = path.split(".")
    values = scenario.get("axes", {}).get(path)
    if values and len(values) > 1:
        raise ConfigError(
            path,
            brief(values),
            "is swept, so that the results have no common unit",
            "export a scenario with a single value of it",
        )
    try:
        return float(values[0] if values else scenario["base"][group][key])
    except KeyError:
        raise DatasetError(
            f"{path}: is not among the parameters that the dataset says it is of; gather it again"
        ) from None
