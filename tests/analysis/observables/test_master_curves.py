"""Whether bulk rates in time collapse over roughnesses, on curves of known scatter."""

import numpy as np
import pytest
import xarray as xr
from synthetic import red_noise

from softslip.analysis.observables.master_curves import NAMES, collapse, collapse_of
from softslip.analysis.observables.tables import creep, flow_curve

TIME = np.geomspace(0.1, 1000.0, 60)


def generator(*key):
    return np.random.default_rng(np.random.SeedSequence((*key, 31)))


def rate_of(time=TIME):
    """A rate that creeps, yields and flows."""
    return time**-0.7 + 0.3 / (1 + (20 / time) ** 3)


def curves(random, factors=(1.0,) * 4, seeds=3, noise=0.1, level=None):
    """Rates of shape (roughness, seed, time), whose noise is correlated over half a decade."""
    level = rate_of() if level is None else level
    shape = (len(factors), seeds)
    wander = [[red_noise(len(TIME), 8.0, random) for _ in range(seeds)] for _ in factors]
    noisy = level * (1 + noise * np.reshape(wander, (*shape, len(TIME))))
    return np.array(factors)[:, None, None] * noisy


def test_curves_that_are_one_spread_as_their_errors_let_expect():
    found = [collapse_of(curves(generator(1, n)), np.log(TIME)) for n in range(200)]
    spread = np.mean([each.spread**2 for each in found]) ** 0.5
    assert spread == pytest.approx(0.1 / 3**0.5, rel=0.1)
    ratio = np.mean([each.ratio**2 for each in found]) ** 0.5
    assert 0.9 < ratio < 1.15, f"the ratio is {ratio:.2f}, about 1 expected"
    chances = np.array([each.chance for each in found])
    for level in (0.05, 0.3, 0.7):
        share = np.mean(chances <= level)
        assert abs(share - level) < 0.1, f"a chance of {level} comes up in {share:.0%}"


def test_chances_hold_where_packings_of_one_seed_are_alike_at_all_roughnesses():
    chances = []
    for number in range(150):
        random = generator(2, number)
        common = 1 + 0.3 * random.standard_normal(3)
        rates = curves(random, noise=0.05) * common[None, :, None]
        chances.append(collapse_of(rates, np.log(TIME)).chance)
    for level in (0.1, 0.5):
        share = np.mean(np.array(chances) <= level)
        assert abs(share - level) < 0.12, f"a chance of {level} comes up in {share:.0%}"


def test_curves_that_differ_are_told_apart():
    factors = np.array([0.7, 0.9, 1.1, 1.3])
    found = collapse_of(curves(generator(3), factors, noise=0.02), np.log(TIME))
    truth = np.std(factors, ddof=1) / np.sqrt(np.mean(factors**2))
    assert found.spread == pytest.approx(truth, rel=0.05)
    assert found.ratio > 5
    assert found.chance < 0.01
    assert found.curves == 4


def test_the_spread_of_close_curves_is_that_of_their_logarithms():
    rates = curves(generator(4), noise=0.03)
    logs = np.log(rates.mean(axis=1))
    weight = np.gradient(np.log(TIME))
    expected = np.average(np.var(logs, axis=0, ddof=1), weights=weight) ** 0.5
    assert collapse_of(rates, np.log(TIME)).spread == pytest.approx(expected, rel=0.02)


def test_rates_about_zero_are_neither_left_out_nor_taken_for_a_difference():
    random = generator(5)
    found = [
        collapse_of(random.standard_normal((4, 3, len(TIME))), np.log(TIME)) for _ in range(50)
    ]
    ratio = np.mean([each.ratio for each in found])
    assert 0.9 < ratio < 1.1, f"noise about zero has a ratio of {ratio:.2f}"
    assert 0.3 < np.mean([each.spread for each in found]) < 1
    # The sign of all rates does not matter, nor does their unit.
    rates = curves(generator(6))
    plain, turned = (collapse_of(each, np.log(TIME)) for each in (rates, -1e3 * rates))
    assert np.array(plain) == pytest.approx(np.array(turned), rel=1e-12)


def test_the_logarithm_of_time_counts():
    rates = curves(generator(7), noise=1e-3)
    late = TIME > 300
    rates[0, :, late] *= 3
    decades = np.log10(TIME[-1] / TIME[late][0]) / np.log10(TIME[-1] / TIME[0])
    # One of four curves at 3 and three at 1: variance 1 over a mean square of 3.
    expected = (decades / 3) ** 0.5
    assert collapse_of(rates, np.log(TIME)).spread == pytest.approx(expected, rel=0.1)


def test_one_seed_leaves_the_error_unknown_and_one_roughness_everything():
    one = collapse_of(curves(generator(8), seeds=1), np.log(TIME))
    assert np.isfinite(one.spread)
    assert np.isnan([one.expected, one.ratio, one.chance]).all()
    alone = collapse_of(curves(generator(8), factors=(1.0,)), np.log(TIME))
    assert np.isnan(alone[:4]).all()
    assert alone.curves == 1


def test_missing_runs_and_ends_are_no_rates():
    rates = curves(generator(9))
    gaps = rates.copy()
    gaps[1, 2] = np.nan
    gaps[0, 0, 50:] = np.nan
    found = collapse_of(gaps, np.log(TIME))
    kept = rates[..., :50].copy()
    kept[1, 2] = np.nan
    assert found == collapse_of(kept, np.log(TIME[:50]))
    assert found.curves == 4
    gone = rates.copy()
    gone[2:] = np.nan
    assert collapse_of(gone, np.log(TIME)) == collapse_of(rates[:2], np.log(TIME))
    assert collapse_of(np.full((3, 2, 5), np.nan), np.log(TIME[:5])).curves == 0


def table(rates, dims, **coords):
    return xr.Dataset({"shear_rate_bulk": (dims, rates)}, coords={**coords, "time": ("time", TIME)})


def test_all_other_dimensions_stay():
    random = generator(10)
    rates = np.stack([[curves(random), curves(random)]] * 3)
    dims = ("stress", "area_fraction", "roughness", "seed", "time")
    found = collapse(table(rates, dims, stress=[0.1, 0.2, 0.3]))
    assert found["master_curve_spread"].dims == ("stress", "area_fraction")
    single = collapse_of(rates[1, 0], np.log(TIME))
    at = found.isel(stress=1, area_fraction=0)
    assert [at[NAMES[field]].item() for field in single._fields] == list(single)
    turned = collapse(table(rates.swapaxes(2, 3), (*dims[:2], "seed", "roughness", "time")))
    assert turned["master_curve_spread"].values.tolist() == (
        found["master_curve_spread"].values.tolist()
    )
    bare = collapse(table(rates[0, 0, 0, 0], ("time",), roughness=0.0))
    assert bare["master_curves"].item() == 1
    assert np.isnan(bare["master_curve_spread"])


def test_the_flow_curve_says_how_well_its_runs_collapse(made_up_runs):
    curve, series = flow_curve(made_up_runs), creep(made_up_runs)
    for name, expected in collapse(series).items():
        xr.testing.assert_identical(curve[name].variable, expected.variable)
    assert curve["master_curves"].values.tolist() == [2, 2]
    assert set(curve["master_curve_spread"].dims) == {"stress"}
    # The rates of `synthetic` do not depend on roughness but for their noise.
    assert (curve["master_curve_spread"] < 0.2).all()
    assert (curve["master_curve_spread_chance"] > 0.02).all()


@pytest.fixture
def made_up_runs():
    from synthetic import sweep

    return sweep((0.1, 0.3), (0.0, 0.59), (1, 2, 3), duration=100.0, noise=0.05, profiles=2)
