"""What a batch system is asked for: the time and the memory of the job of each run.

Time is what `softslip plan` estimates to be left. A run with a checkpoint goes by its own rate so
far, another by the estimate of `operations.costs` in the light of the scenario's finished runs, so
that requests come to fit the cluster that they are made on. It is asked for `MARGIN` times that:
enough as long as the run takes no more than that, and at most `SLACK` times what is used where it
takes 0.8 times its estimate or more. Where it is not enough, the run is told to stop, writes a
checkpoint, and is submitted again.
"""

import math
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

from softslip.config.parameters import Parameters
from softslip.config.scenario import Scenario
from softslip.config.stages import FLOWING
from softslip.operations.checkpoint_files import checkpointed_progress
from softslip.operations.correction import Correction
from softslip.operations.costs import shipped
from softslip.operations.planning import continued_part, corrections
from softslip.operations.workload import mesh_points, nodes

SLACK = 1.5
"""Most time to ask for over the time that is used."""

MARGIN = 1.2
"""Time that is asked for over the estimate: near the root of `SLACK`, so that too much and too
little are about as rare."""

STARTING = 20.0
"""Seconds from the start of a job until its run begins to work: two Snakemakes, one in the job and
one in its step, read the workflow, each for 2 to 8 s."""

LEAST = 300.0
"""Least seconds to ask for where an interrupted run begins again: a slow file system or a busy node
may take minutes for what takes seconds, and all of it would be lost."""

STOPPING = 90.0
"""Seconds of a time limit in which a run does not work any more: it is told to stop 60 s before the
end (profiles/slurm), and Slurm's controller, which looks every 30 s, does so up to 30 s early."""

SNAKEMAKE_MEMORY = 400.0
"""Megabytes of the two Snakemakes of a job, of 180 each, and of what starts them."""

STAGE_MEMORY = {"packing": 200.0, "expansion": 350.0, "ageing": 460.0, "shear": 460.0}
"""Megabytes of a stage of a few particles while its kernels are compiled, measured as the most that
benchmarks show: 192, 350, 455 and 455. Compiled before, expansion takes 270 and the others 310."""

NODE_MEMORY = 2e-3
"""Megabytes for each node of a membrane or wall: 304 at 1,700, 325 at 9,000 and 351 at 26,500."""

POINT_MEMORY = 2.5e-5
"""Megabytes for each point of a mesh, nodes included: 330 at 1.6 million, 449 at 6.6 million."""

MEMORY_STEP = 100.0
"""Megabytes that requests are whole multiples of."""


class JobRequests:
    """What the jobs of a scenario ask a batch system for.

    Parameters
    ----------
    scenario
        Which runs there are.
    results
        Folder of the scenario's results.
    corrected
        Whether finished runs correct the estimates, for which all datasets are looked at, once.
    longest
        Minutes that no job is asked to exceed.
    """

    def __init__(
        self,
        scenario: Scenario,
        results: Path,
        corrected: bool = True,
        longest: float = math.inf,
    ) -> None:
        self._scenario, self._results, self._is_corrected = scenario, results, corrected
        self._longest = longest

    @cached_property
    def _corrections(self) -> Mapping[str, Correction]:
        return corrections(self._scenario, self._results) if self._is_corrected else {}

    def seconds_left(self, stage: str, run: str) -> float:
        """Return the estimate of the time that is left of a run [s]."""
        progress = checkpointed_progress(self._results, stage, run)
        if progress is not None and progress.remaining is not None:
            return progress.remaining
        row = self._scenario.stage_table(stage)[run]
        estimate = shipped().estimate(stage, row.parameters)
        if stage in self._corrections:
            estimate = shipped().corrected(stage, row.parameters, self._corrections[stage])
        return estimate.core_seconds * (1 - continued_part(self._results, row))

    def minutes(self, stage: str, run: str, attempt: int = 1) -> int:
        """Return the time limit of a job [min].

        Parameters
        ----------
        stage, run
            What the job does.
        attempt
            How often it is tried, from 1 on. What always begins again gets as many times the time,
            as it may have been too little.
        """
        seconds = MARGIN * self.seconds_left(stage, run)
        if stage in FLOWING:
            seconds = STARTING + seconds + STOPPING
        else:
            seconds = max(STARTING + seconds, LEAST) * attempt
        return int(min(math.ceil(seconds / 60), self._longest))

    def megabytes(self, stage: str, run: str, attempt: int = 1) -> int:
        """Return the memory of a job [MB].

        Parameters
        ----------
        stage, run
            What the job does.
        attempt
            How often it is tried, from 1 on. It may have been too little: what begins again gets
            twice as much from the second on, and what resumes a tenth more each time up to twice
            as much, as most likely it was interrupted.
        """
        parameters = self._scenario.stage_table(stage)[run].parameters
        memory = MARGIN * stage_memory(stage, parameters) + SNAKEMAKE_MEMORY
        growth = 0.1 if stage in FLOWING else 1.0
        memory *= min(1 + growth * (attempt - 1), 2)
        return int(MEMORY_STEP * math.ceil(memory / MEMORY_STEP))


def stage_memory(stage: str, parameters: Parameters) -> float:
    """Return the estimate of the most memory that the process of a stage takes [MB]."""
    memory = STAGE_MEMORY[stage]
    if stage == "packing":
        return memory
    memory += NODE_MEMORY * nodes(parameters)
    if stage in FLOWING and parameters.hydrodynamics.mobility == "grid":
        memory += POINT_MEMORY * mesh_points(parameters)
    return memory
