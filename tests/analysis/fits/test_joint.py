"""One yield stress for flow and slip: what slip adds, what is assumed, and when it is refused."""

import numpy as np
import pytest
import xarray as xr

from softslip.analysis.fits import FITTED, fit_laws, flow_and_slip, herschel_bulkley
from softslip.analysis.fits.branches import two_branches
from softslip.analysis.fits.flow import PARAMETERS, flow_rate
from softslip.studies.coverage.made_up_curves import CurveKind

TRUTHS = {
    "yield_stress": 0.055,
    "consistency": 0.6,
    "flow_index": 0.57,
    "slip_coefficient": 0.0021,
    "newtonian_slip_coefficient": 0.00124,
}


def drawn(seed, **options) -> xr.Dataset:
    kind = CurveKind("", **{"slip": (0.0021,), "newtonian": 0.00124, **options})
    return kind.drawn(np.random.default_rng(np.random.SeedSequence((seed, 17))))


def of_bulk_near_yield_unknown(seed) -> xr.Dataset:
    """Flow and slip of samples whose bulk has not flowed near yield, as in short runs."""
    curve = drawn(seed)
    for flag, words in (("steady_bulk", False), ("verdict_bulk", "drifting")):
        curve[flag] = curve[flag].where(curve["stress"] > 0.12, words)
    return curve


def test_branches_are_faster_one_by_one():
    found = two_branches(np.array([0.05, 0.1, 0.3]), 0.05, 2.0, 1.0)
    assert found == pytest.approx([0.05, 0.1, 0.5])


def test_all_parameters_are_given_back():
    curve = drawn(1, seeds=1)
    stress = curve["stress"].values
    exact = {
        "shear_rate_bulk": flow_rate(stress, *(TRUTHS[name] for name in PARAMETERS)),
        "slip_velocity": two_branches(stress, TRUTHS["yield_stress"], 0.0021, 0.00124),
    }
    for name, values in exact.items():
        curve[name] = curve[name].copy(data=np.reshape(values, curve[name].shape))
        curve[f"{name}_error"] = 0.01 * curve[name]
    found = flow_and_slip(curve)
    assert found["joint_fit_message"].item() == FITTED
    assert float(found["joint_agreement"]) > 0.99
    for name, truth in TRUTHS.items():
        assert float(found[f"joint_{name}"]) == pytest.approx(truth, rel=1e-3), name


def test_slip_tells_the_yield_stress_where_the_bulk_does_not():
    told, alone, covered = 0, 0, 0
    for seed in range(25):
        curve = of_bulk_near_yield_unknown(seed)
        found, flow = flow_and_slip(curve), herschel_bulkley(curve)
        alone += flow["pooled_fit_message"].item() == FITTED
        told += found["joint_fit_message"].item() == FITTED
        low, high = found["joint_yield_stress_interval"].sel(confidence=0.95).values
        covered += low <= TRUTHS["yield_stress"] <= high
    assert told >= 20
    assert told > 1.5 * alone
    assert covered >= 20


def test_different_yield_stresses_are_noticed():
    curve = drawn(3, scatter=0.03)
    other = drawn(4, scatter=0.03, yield_stress=0.2, slip=(0.006,))
    for name in ("slip_velocity", "slip_velocity_error"):
        curve[name] = other[name]
    found = flow_and_slip(curve)
    assert float(found["joint_agreement"]) < 0.01
    assert found["joint_fit_message"].item().startswith("flow and slip have different yield")
    assert fit_laws(curve)["pooled_fit_message"].item() == FITTED


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"newtonian": 0.0}, "the smoothest wall does not slip below yield"),
        ({"stresses": (0.01, 0.02, 0.3, 0.5)}, "too few steady points of the bulk"),
        ({"shape": "rest"}, "the smoothest wall does not slip below yield"),
    ],
)
def test_what_cannot_be_known_is_refused(change, said):
    kind = CurveKind("", **{"slip": (0.002,), **change})
    found = flow_and_slip(kind.drawn(np.random.default_rng(5)))
    assert found["joint_fit_message"].item().startswith(said)
    assert np.isnan(found["joint_yield_stress"])


def test_nothing_depends_on_units():
    curve = drawn(6)
    scaled = curve.assign_coords(stress=curve["stress"].values * 1e-9)
    for name in ("slip_velocity", "shear_rate_bulk"):
        for end in ("", "_error"):
            scaled[f"{name}{end}"] = scaled[f"{name}{end}"] * 1e7
    found, other = flow_and_slip(curve), flow_and_slip(scaled)
    assert 1e9 * float(other["joint_yield_stress"]) == pytest.approx(
        float(found["joint_yield_stress"]), rel=1e-4
    )
    assert float(other["joint_agreement"]) == pytest.approx(
        float(found["joint_agreement"]), abs=1e-3
    )
    assert other["joint_fit_message"].item() == found["joint_fit_message"].item()


def test_powers_and_slip_are_counted_from_it_where_the_bulk_alone_tells_nothing():
    for seed in range(40):
        curve = of_bulk_near_yield_unknown(seed)
        fits = fit_laws(curve)
        if fits["pooled_fit_message"].item() != FITTED == fits["joint_fit_message"].item():
            break
    assert fits["slip_coefficient_message"].item() == FITTED
    assert fits["pooled_yielding_exponent_message"].item() == FITTED
    assert fits["slip_exponent_message"].item() == "the yield stress is not known"
