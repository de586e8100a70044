"""The fits in words: a line for each cell, one where all say alike that there is nothing."""

import numpy as np
import pytest
from synthetic import shear_run

from softslip.analysis.fits import fit_laws, summary
from softslip.analysis.observables.tables import flow_curve

STRESSES, HEIGHTS = (0.15, 0.3), (0.125, 0.25, 0.5)


def lines(runs):
    curve = flow_curve(runs)
    fits = fit_laws(curve)
    return fits, summary(fits, curve).splitlines()


def of_law(said, law):
    return [line for line in said if line.startswith(law)]


@pytest.fixture(scope="module")
def wide():
    return lines(
        [
            (
                {"stress": stress, "wall_separation": height},
                shear_run(stress, height=height, duration=1000.0, noise=0.03, profiles=2),
            )
            for stress in STRESSES
            for height in HEIGHTS
        ]
    )


def test_each_stress_has_a_line_with_its_slip_velocity_over_separations(wide):
    fits, said = wide
    found = of_law(said, "apparent shear rate over wall separations")
    assert len(found) == len(STRESSES)
    for line, stress in zip(found, STRESSES, strict=True):
        assert f"(stress {stress}): fitted: mooney_slip_velocity = " in line
        value = float(fits["mooney_slip_velocity"].sel(stress=stress))
        assert f"{value:.4g} ± " in line
        assert "mooney_slip_velocity_mismatch = " in line


def test_what_was_not_swept_takes_one_line(wide):
    _, said = wide
    assert of_law(said, "slip velocity over channel lengths") == [
        "slip velocity over channel lengths: one channel length only: sweep channel.length"
    ]
    assert of_law(said, "bulk shear rate in time") == [
        "bulk shear rate in time, over roughnesses: one roughness only: sweep wall.roughness"
    ]


@pytest.mark.parametrize("seeds", [(1,), (1, 2)])
def test_the_collapse_over_roughness_is_told_with_its_error_where_that_is_known(seeds):
    runs = [
        (
            {"stress": stress, "roughness": roughness, "seed": seed},
            None
            if (stress, roughness) == (0.5, 0.59)
            else shear_run(stress, roughness, seed, duration=60.0, profiles=2),
        )
        for stress in (0.3, 0.5)
        for roughness in (0.0, 0.59)
        for seed in seeds
    ]
    curve = flow_curve(runs)
    _, said = lines(runs)
    first, second = of_law(said, "bulk shear rate in time, over roughnesses")
    spread = float(curve["master_curve_spread"][0])
    assert first.startswith(
        f"bulk shear rate in time, over roughnesses (stress 0.3): spread = {spread:.2g} of the rate"
    )
    assert ("chance" in first) == (len(seeds) > 1)
    assert ("sweep seed" in first) == (len(seeds) == 1)
    assert second.endswith("(stress 0.5): runs at 1 of at least 2 roughnesses")
    assert np.isnan(curve["master_curve_spread"][1])
