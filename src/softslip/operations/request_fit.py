"""How well the time that batch jobs request fits what the finished runs of a scenario took."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softslip.config.scenario import Scenario
from softslip.config.stages import FLOWING
from softslip.operations.correction import by_others
from softslip.operations.costs import Costs, shipped
from softslip.operations.job_requests import MARGIN, SLACK
from softslip.operations.planning import finished_runs

SHIPPED = "costs that come with softslip"
OTHERS = "the same, corrected by the other finished runs"

FEWEST = 3
"""Runs from which on there are others that correct the estimate of one."""


@dataclass(frozen=True)
class RequestFit:
    """How the time that is requested for finished runs of a stage compares with what they took.

    Attributes
    ----------
    stage
        Ageing or shear, whose requests follow the estimate; the others request minutes for seconds.
    estimate
        What is requested follows from: `SHIPPED` or `OTHERS`.
    ratios
        Time requested over processor time used, of each run, without what a job takes until its
        run begins and from when it is told to stop.
    """

    stage: str
    estimate: str
    ratios: NDArray[np.float64]

    def quantile(self, share: float) -> float:
        """Return the ratio that a share of the runs does not exceed."""
        return float(np.quantile(self.ratios, share))

    @property
    def within(self) -> float:
        """Share of runs that request at most `SLACK` times what they use."""
        return float(np.mean(self.ratios <= SLACK))

    @property
    def sufficient(self) -> float:
        """Share of runs that end within what they request."""
        return float(np.mean(self.ratios >= 1))


def request_fits(scenario: Scenario, results: Path, costs: Costs | None = None) -> list[RequestFit]:
    """Compare the time that jobs request with what finished runs took, by stage and estimate.

    Parameters
    ----------
    scenario, results, costs
        As of `operations.planning.make_plan`.

    Raises
    ------
    DatasetError
        When a folder of results cannot be read.
    """
    model, finished = costs or shipped(), finished_runs(scenario, results)
    fits = []
    for stage in FLOWING:
        runs = model.compared(finished[stage])
        requested = MARGIN * np.exp([-run.time for run in runs])
        if runs:
            fits.append(RequestFit(stage, SHIPPED, requested))
        if len(runs) >= FEWEST:
            fits.append(RequestFit(stage, OTHERS, requested * np.exp(by_others(runs))))
    return fits
