"""Flow curves made up from known laws, with seeds that differ."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.random import Generator
from numpy.typing import NDArray

from softslip.analysis.fits.flow import flow_law, flow_rate
from softslip.analysis.observables.steady import FLAGS, VERDICT_NAMES
from softslip.analysis.observables.verdicts import DRIFTING, WITHIN_ERROR
from softslip.files.quantities import unit_of

FloatArray = NDArray[np.float64]

STRESSES = (0.01, 0.02, 0.03, 0.04, 0.08, 0.1, 0.15, 0.2, 0.3, 0.5)
"""Imposed stresses [stress unit], on both sides of the paper's yield stress."""

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
        Slip coefficient below yield.
    scatter
        Standard deviation of a seed's rate, slip, heterogeneity and times, over the true value.
    seeds
        Number of samples; with one, its error is known.
    shape
        ``law``, or rates that no law describes: ``plateau`` (one rate at all stresses) and
        ``falling``.
    imposed_rate
        Whether rates are imposed and stresses measured.
    roughnesses
        Of the walls.
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

    @property
    def truths(self) -> dict[str, float]:
        """The true values of what is fitted; those that depend on roughness at the smoothest."""
        known = {
            "pooled_yield_stress": self.yield_stress,
            "pooled_consistency": self.consistency,
            "pooled_flow_index": self.flow_index,
            "pooled_heterogeneity_exponent": -0.8,
            "pooled_yielding_exponent": -1.3,
            "slip_time_exponent": -1.3,
        }
        if self.imposed_rate:
            known = {name: known[name] for name in list(known)[:3]}
        elif self.exponent == 1:
            fall = (self.slip[1] - 0.5 * self.slip[0]) / max(self.slip[1] - self.slip[2], 1e-9)
            critical = self.roughnesses[-1] / 3 * (1 + fall)
            known |= {
                "slip_coefficient": self.slip[0],
                "slip_exponent": 1.0,
                "slip_yield_stress": self.yield_stress,
                "newtonian_slip_coefficient": self.newtonian,
            }
            if len(self.roughnesses) > 1:
                known["critical_roughness"] = critical
        return known

    def drawn(self, random: Generator) -> xr.Dataset:
        """Return one such flow curve, as `analysis.observables.flow_curve` would."""
        stress = np.array(STRESSES)
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
        excess = np.maximum(stress - self.yield_stress, 0.0)
        slip = np.where(
            flows[:, None],
            excess[:, None] ** self.exponent * np.array(self.slip[: len(roughness)]),
            (stress * self.newtonian)[:, None] * (roughness == 0),
        )
        late = np.where(flows, np.where(flows, excess, 1.0) ** -1.3, np.nan)
        shape = (len(stress), len(roughness))
        true = {
            "shear_rate_wall": np.broadcast_to((rate + 1e-4)[:, None], shape),
            "shear_rate_bulk": np.broadcast_to(rate[:, None], shape),
            "slip_velocity": slip,
            "heterogeneity": np.broadcast_to((0.02 * stress**-0.8)[:, None], shape),
            "yielding_time": np.broadcast_to(late[:, None], shape),
            "slip_time": np.broadcast_to(late[:, None], shape),
        }
        least = {"slip_velocity": 2e-5, "shear_rate_bulk": 1e-5}
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
        "the same, one seed with a known error", seeds=1, roughnesses=ROUGHNESSES
    ),
    "five seeds": CurveKind("the same, five seeds that scatter by 20 %", seeds=5, scatter=0.2),
    "imposed rate": CurveKind("the same at imposed rate", imposed_rate=True, scatter=0.03),
    "no yield stress": CurveKind("power-law fluid, σ_y = 0", yield_stress=0.0),
    "no slip": CurveKind("Herschel–Bulkley without slip", slip=(0.0,) * 4, newtonian=0.0),
    "negative slip": CurveKind(
        "Herschel–Bulkley with negative slip", slip=(-0.002, -0.0016, -0.0004, 0.0)
    ),
    "quadratic slip": CurveKind("slip as (σ − σ_y)²", exponent=2.0),
    "plateau": CurveKind("one rate at all stresses", shape="plateau", yield_stress=0.0),
    "falling": CurveKind("rates that fall with stress", shape="falling", yield_stress=0.0),
}
"""Kinds of flow curves by name."""
