"""How well the time that batch jobs request fits what the finished runs of a scenario took."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softslip.config.scenario import Scenario
from softslip.config.stages import FLOWING
from softslip.operations.costs import Costs, Measured, shipped
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
        runs = finished[stage]
        if runs:
            fits.append(RequestFit(stage, SHIPPED, _ratios(model, runs)))
        if len(runs) >= FEWEST:
            fits.append(RequestFit(stage, OTHERS, _ratios(model, runs) * _by_others(model, runs)))
    return fits


def _ratios(model: Costs, runs: Sequence[Measured]) -> NDArray[np.float64]:
    """Return the time requested over the time used."""
    estimates = [model.estimate(run.stage, run.parameters).core_seconds for run in runs]
    return MARGIN * np.array(estimates) / [run.core_seconds for run in runs]


def _by_others(model: Costs, runs: Sequence[Measured]) -> NDArray[np.float64]:
    """Return the factor by which all other runs correct the estimate of each."""
    return np.array(
        [
            model.correction(run.stage, (*runs[:number], *runs[number + 1 :]))
            .at(run.parameters)
            .core_seconds
            for number, run in enumerate(runs)
        ]
    )
