"""Flow curves made up from known laws, with seeds that differ."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import xarray as xr
from numpy.random import Generator
from numpy.typing import NDArray

from softslip.analysis.fits.flow import PARAMETERS, flow_law, flow_rate
from softslip.analysis.observables.steady import FLAGS, VERDICT_NAMES
from softslip.analysis.observables.verdicts import DRIFTING, WITHIN_ERROR
from softslip.files.quantities import JOINT, unit_of

FloatArray = NDArray[np.float64]

STRESSES = (0.01, 0.02, 0.03, 0.04, 0.08, 0.1, 0.15, 0.2, 0.3, 0.5)
"""Imposed stresses [stress unit], on both sides of the paper's yield stress."""

BELOW_YIELD = (0.005, 0.01, 0.015, 0.02, 0.03, 0.04)
"""Imposed stresses [stress unit] below the paper's yield stress."""

ROUGHNESSES = (0.0, 0.2, 0.4, 0.6)
"""Wall roughnesses; slip is halved between the second and the third."""


@dataclass(frozen=True)
class CurveKind:
    """A kind of flow curve.

    Attributes
    ----------
    words
        What it is, as the document says it.
    yield_stress, consistency, flow_index
        Of the bulk.
    slip
        Slip coefficient above yield, at each roughness.
    exponent
        Of the slip velocity above yield.
    newtonian
        Slip coefficient of the film of solvent at the smooth wall: below yield, and above it until
        slip in the stress above yield is faster.
    scatter
        Standard deviation of a seed's rate, slip, heterogeneity and times, over the true value.
    seeds
        Number of samples; with one, its error is known.
    shape
        ``law``, or rates that no law describes: ``plateau`` (one rate at all stresses),
        ``falling``, and ``rest`` (none, and none is said to creep).
    imposed_rate
        Whether rates are imposed and stresses measured.
    roughnesses
        Of the walls.
    stresses
        Imposed [stress unit].
    heterogeneity_exponent, time_exponent
        Exponents of the heterogeneity in the stress, and of the times of yielding and of slip in
        the stress above yield.
    """

    words: str
    yield_stress: float = 0.055
    consistency: float = 0.6
    flow_index: float = 0.57
    slip: tuple[float, ...] = (0.002, 0.0016, 0.0004, 0.0)
    exponent: float = 1.0
    newtonian: float = 0.0012
    scatter: float = 0.1
    seeds: int = 3
    shape: str = "law"
    imposed_rate: bool = False
    roughnesses: tuple[float, ...] = (0.0,)
    stresses: tuple[float, ...] = STRESSES
    heterogeneity_exponent: float = -0.8
    time_exponent: float = -1.3

    @property
    def truths(self) -> dict[str, float]:
        """The true values of what is fitted, NaN where there is none.

        Those that depend on roughness are of the smoothest wall. With one roughness, fits that
        pool over it are the same as those of each.
        """
        nothing, lawful = float("nan"), self.shape == "law"
        own = {
            "yield_stress": self.yield_stress if lawful else nothing,
            "consistency": self.consistency if lawful else nothing,
            "flow_index": self.flow_index if lawful else nothing,
        }
        if self.imposed_rate:
            return own
        own |= {
            "heterogeneity_exponent": self.heterogeneity_exponent,
            "yielding_exponent": self.time_exponent,
        }
        several = len(self.roughnesses) > 1
        pooled = {f"pooled_{name}": value for name, value in own.items()} if several else {}
        straight, slips = self.exponent == 1, self.slip[0] != 0
        joint = {f"{JOINT}{name}": own[name] for name in PARAMETERS} if straight and slips else {}
        return {
            **own,
            **pooled,
            **joint,
            "slip_time_exponent": self.time_exponent,
            "slip_coefficient": self.slip[0] if straight else nothing,
            "slip_exponent": self.exponent if slips else nothing,
            "slip_yield_stress": self.yield_stress if straight and slips else nothing,
            "newtonian_slip_coefficient": self.newtonian,
            "critical_roughness": self._critical_roughness() if straight else nothing,
        }

    def _critical_roughness(self) -> float:
        """Return where slip falls to half that of the smoothest wall; NaN if nowhere."""
        half = 0.5 * self.slip[0]
        pairs = list(zip(self.roughnesses, self.slip, strict=False))
        for (last, more), (roughness, less) in pairwise(pairs):
            if more > half >= less:
                return last + (roughness - last) * (more - half) / (more - less)
        return float("nan")

    def drawn(self, random: Generator) -> xr.Dataset:
        """Return one such flow curve, as `analysis.observables.flow_curve` would."""
        stress = np.array(self.stresses)
        if self.imposed_rate:
            above = stress[stress > self.yield_stress]
            return self._at_imposed_rates(above, random)
        roughness = np.array(self.roughnesses)
        flows = stress > self.yield_stress
        rate = flow_rate(stress, self.yield_stress, self.consistency, self.flow_index)
        if self.shape == "plateau":
            rate = np.full_like(stress, 0.01)
        if self.shape == "falling":
            rate = 0.01 * (stress[0] / stress) ** 2
        if self.shape == "rest":
            flows, rate = np.zeros_like(flows), np.zeros_like(rate)
        excess = np.maximum(stress - self.yield_stress, 0.0)
        layers = excess[:, None] ** self.exponent * np.array(self.slip[: len(roughness)])
        film = (stress * self.newtonian)[:, None] * (roughness == 0)
        slip = np.where(layers < 0, layers, np.maximum(layers, film))
        late = np.where(flows, np.where(flows, excess, 1.0) ** self.time_exponent, np.nan)
        uneven = 0.02 * stress**self.heterogeneity_exponent
        shape = (len(stress), len(roughness))
        true = {
            "shear_rate_wall": np.broadcast_to((rate + 1e-4)[:, None], shape),
            "shear_rate_bulk": np.broadcast_to(rate[:, None], shape),
            "slip_velocity": slip,
            "heterogeneity": np.broadcast_to(uneven[:, None], shape),
            "yielding_time": np.broadcast_to(late[:, None], shape),
            "slip_time": np.broadcast_to(late[:, None], shape),
        }
        least = {"slip_velocity": 2e-6, "shear_rate_bulk": 1e-5}
        curve = self._measured(true, least, random, ("stress", "roughness"))
        curve = curve.assign_coords(stress=stress, roughness=roughness)
        creeps = ~flows if self.shape == "law" else np.zeros_like(flows)
        return _judged(curve, xr.DataArray(creeps, dims="stress"))

    def _at_imposed_rates(self, stress: FloatArray, random: Generator) -> xr.Dataset:
        rate = flow_rate(stress, self.yield_stress, self.consistency, self.flow_index)
        true = {
            "shear_rate_bulk": rate,
            "shear_rate_wall": rate,
            "slip_velocity": 0 * rate,
            "shear_stress": flow_law(rate, self.yield_stress, self.consistency, self.flow_index),
        }
        curve = self._measured(true, {"slip_velocity": 1e-5}, random, ("imposed_shear_rate",))
        curve = curve.assign_coords(imposed_shear_rate=rate)
        return _judged(curve, xr.zeros_like(curve["imposed_shear_rate"], dtype=bool))

    def _measured(
        self,
        true: Mapping[str, FloatArray],
        least: Mapping[str, float],
        random: Generator,
        dims: tuple[str, ...],
    ) -> xr.Dataset:
        """Return values of all seeds that scatter about the true ones."""
        curve = xr.Dataset()
        for name, values in true.items():
            size = np.maximum(self.scatter * np.abs(values), least.get(name, 0.0))[..., None]
            shape = (*values.shape, self.seeds)
            drawn = values[..., None] + size * random.standard_normal(shape)
            units = {"units": unit_of(name), "long_name": name}
            curve[name] = (*dims, "seed"), drawn, units
            curve[f"{name}_error"] = (*dims, "seed"), np.broadcast_to(size, shape).copy(), units
        return curve.assign_coords(seed=np.arange(self.seeds))


def _judged(curve: xr.Dataset, creeps: xr.DataArray) -> xr.Dataset:
    """Return a curve with verdicts: bulk that creeps is drifting."""
    ones = xr.ones_like(curve["shear_rate_bulk"])
    creep = (ones * creeps).astype(bool)
    for name, flag in FLAGS.items():
        drifts = creep if name == "shear_rate_bulk" else xr.zeros_like(creep)
        curve[flag] = ~drifts
        words = np.where(drifts, DRIFTING, WITHIN_ERROR).astype(object)
        curve[VERDICT_NAMES[name]] = drifts.dims, words
        curve[f"{name}_drift"] = -1.0 * drifts
        curve[f"{name}_drift_error"] = 0.1 * ones
    curve["status"] = ones.dims, np.full(ones.shape, "done")
    return curve


CURVES: Mapping[str, CurveKind] = {
    "paper": CurveKind("Herschel–Bulkley with slip, three seeds", roughnesses=ROUGHNESSES),
    "one seed": CurveKind(
        "Herschel–Bulkley with slip, one seed with a known error", seeds=1, roughnesses=ROUGHNESSES
    ),
    "five seeds": CurveKind(
        "Herschel–Bulkley with slip, five seeds that scatter by 20 %", seeds=5, scatter=0.2
    ),
    "imposed rate": CurveKind(
        "Herschel–Bulkley with slip at imposed rate", imposed_rate=True, scatter=0.03
    ),
    "no yield stress": CurveKind("power-law fluid, σ_y = 0", yield_stress=0.0),
    "no slip": CurveKind(
        "Herschel–Bulkley without slip",
        slip=(0.0,) * 4,
        newtonian=0.0,
        roughnesses=ROUGHNESSES,
    ),
    "negative slip": CurveKind(
        "Herschel–Bulkley with negative slip",
        slip=(-0.002, -0.0016, -0.0004, 0.0),
        newtonian=0.0,
    ),
    "quadratic slip": CurveKind("slip as (σ − σ_y)²", exponent=2.0, slip=(0.02,)),
    "same slip": CurveKind(
        "slip that roughness does not suppress", slip=(0.002,) * 2, roughnesses=(0.0, 0.6)
    ),
    "constant": CurveKind(
        "heterogeneity and times that do not depend on stress",
        heterogeneity_exponent=0.0,
        time_exponent=0.0,
    ),
    "plateau": CurveKind("one rate at all stresses", shape="plateau", yield_stress=0.0),
    "falling": CurveKind("rates that fall with stress", shape="falling", yield_stress=0.0),
    "rest": CurveKind(
        "no rate at any stress, slip as σ",
        shape="rest",
        yield_stress=0.0,
        slip=(0.0012,) * 4,
        stresses=BELOW_YIELD,
    ),
    "below yield": CurveKind("creep at all stresses, below yield", stresses=BELOW_YIELD),
    "one stress": CurveKind(
        "all at one stress, four roughnesses", roughnesses=ROUGHNESSES, stresses=(0.3,)
    ),
}
"""Kinds of flow curves by name."""
