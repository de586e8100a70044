"""How requests fit finished runs follows from what these took over their estimates."""

import math

import numpy as np
import pytest
from plans_synthetic import leave
from runs_synthetic import Work

from softslip.config.scenario import Scenario
from softslip.operations.correction import FinishedRun, condition_of, correction_by
from softslip.operations.costs import shipped
from softslip.operations.job_requests import MARGIN
from softslip.operations.request_fit import OTHERS, SHIPPED, request_fits

TOOK = (0.5, 1.0, 2.0, 1.0)
"""Time that each shear took over its estimate."""


def leave_shears(scenario: Scenario, work: Work, count: int = len(TOOK)) -> None:
    rows = list(scenario.stage_table("shear").items())[:count]
    for (run, row), over in zip(rows, TOOK, strict=False):
        estimate = shipped().estimate("shear", row.parameters).core_seconds
        leave(work.results, "shear", run, seconds=over * estimate)


def test_requests_are_compared_with_what_runs_took(scenario: Scenario, work: Work) -> None:
    leave_shears(scenario, work)
    fits = {fit.estimate: fit for fit in request_fits(scenario, work.results)}
    assert {fit.stage for fit in fits.values()} == {"shear"}
    ratios = MARGIN / np.array(TOOK)
    np.testing.assert_allclose(fits[SHIPPED].ratios, ratios, rtol=1e-12)
    assert fits[SHIPPED].within == pytest.approx(0.75), "the first requests twice as much"
    assert fits[SHIPPED].sufficient == pytest.approx(0.75), "the third takes twice as long"
    rows = list(scenario.stage_table("shear").values())[: len(TOOK)]
    done = [
        FinishedRun(condition_of(row.parameters), math.log(over), 0.0)
        for row, over in zip(rows, TOOK, strict=True)
    ]
    others = [
        correction_by([*done[:own], *done[own + 1 :]], 1.0).at(row.parameters).core_seconds
        for own, row in enumerate(rows)
    ]
    np.testing.assert_allclose(fits[OTHERS].ratios, ratios * others, rtol=1e-12)


def test_the_least_median_and_most_are_quantiles(scenario: Scenario, work: Work) -> None:
    leave_shears(scenario, work)
    fit = request_fits(scenario, work.results)[0]
    expected = [MARGIN / 2, MARGIN, 2 * MARGIN]
    assert [fit.quantile(share) for share in (0.0, 0.5, 1.0)] == pytest.approx(expected)


@pytest.mark.parametrize(("count", "estimates"), [(0, []), (2, [SHIPPED]), (3, [SHIPPED, OTHERS])])
def test_few_runs_do_not_correct_each_other(
    scenario: Scenario, work: Work, count: int, estimates: list[str]
) -> None:
    leave_shears(scenario, work, count)
    assert [fit.estimate for fit in request_fits(scenario, work.results)] == estimates
