# What all rules share: the scenario, where its results go, and who needs what.

import atexit
import os
import sys
import time
from contextlib import ExitStack
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.utils import min_version

from softslip.errors import ConfigError, SoftslipError
from softslip.files.products import ANY_MORE, FIGURES
from softslip.provenance.fingerprints import fingerprint
from softslip.operations.lock import run_lock
from softslip.operations.leftovers import remove
from softslip.config.stages import STAGES
from softslip.operations.status import scenario_status
from softslip.config.scenario import load_scenario
from softslip.provenance.timestamps import keep_in_order

min_version("9.0")

# Rules call the command that belongs to this very Python, whether or not it is activated.
# Sums that BLAS splits over threads would depend on how many there are.
os.environ |= {
    "PATH": os.pathsep.join([os.path.dirname(sys.executable), *os.get_exec_path()]),
    "OPENBLAS_NUM_THREADS": "1",
}

unknown = sorted(set(config) - {"scenario", "numerics", "checkpoint"})
if unknown:
    raise WorkflowError(
        f"--config {unknown[0]}: is no setting of this workflow; put parameters into a "
        "scenario file and choose it with --config scenario=NAME, or a study of the numerics with "
        "--config numerics=NAME; the seconds between two checkpoints are --config checkpoint=60"
    )

# The name of a file in config/ without its suffix, or the path of a .yaml file anywhere.
SOURCE = str(config.get("scenario", "demo"))

try:
    SCENARIO = load_scenario(SOURCE)
except ConfigError as error:
    raise WorkflowError(str(error)) from None

# Seconds between two checkpoints of a run.
CHECKPOINT_INTERVAL = config.get("checkpoint", 60)
if (
    not isinstance(CHECKPOINT_INTERVAL, int | float)
    or isinstance(CHECKPOINT_INTERVAL, bool)
    or not 0 <= CHECKPOINT_INTERVAL < float("inf")
):
    raise WorkflowError(
        f"--config checkpoint={CHECKPOINT_INTERVAL}: is not a number of seconds from 0 on; "
        "leave it out for the default, 60"
    )

RESULTS = f"results/{SCENARIO.name}"

# Snakemake's own lock is a file that outlives a killed process (profiles/default leaves it out).
# This one is freed by the system, so that the same command starts again at once.
ALONE = ExitStack()
atexit.register(ALONE.close)
BEGUN = time.time()


onstart:
    try:
        ALONE.enter_context(run_lock(Path(RESULTS), "workflow"))
    except SoftslipError as error:
        raise WorkflowError(f"{RESULTS}: {error}") from None


# Only now does Snakemake hold every result for complete: what made them is of no more use.
onsuccess:
    for _ in remove(Path(RESULTS), scenario_status(SCENARIO, Path(RESULTS)).leftovers(), print):
        pass
    keep_in_order(Path(RESULTS), BEGUN)


ENVIRONMENT = "envs/softslip.yaml"
TABLES = {stage: SCENARIO.stage_table(stage) for stage in STAGES}


LABELS = {
    run.ids["shear"]: {label: str(value) for label, value in run.coordinates.items()}
    for run in SCENARIO.runs()
}


wildcard_constraints:
    run="[0-9a-f]{16}",


def parent_of(stage):
    """Return an input function: the file of the stage before."""
    before = STAGES[STAGES.index(stage) - 1]

    def parent(wildcards):
        return f"{RESULTS}/{before}/{TABLES[stage][wildcards.run].parent}.nc"

    return parent


def parameters_of(stage):
    """Return a params function: all parameters of a run, so that its job reads no scenario.

    It takes the output because Snakemake then does not rerun jobs whose parameters differ: what
    only later stages depend on may differ between two scenarios that share a run.
    """

    def parameters(wildcards, output):
        return TABLES[stage][wildcards.run].parameters.model_dump_json()

    return parameters


def run_labels(wildcards):
    """Name a run's swept values in the report."""
    return LABELS.get(wildcards.run, {})


# The benchmark figure's datasets, that of the bars over N first.
COMPARED = ["scaling", "mobility_100", "mobility_800", "run_100", "run_800"]


def benchmarks_drawn(wildcards):
    """Return the datasets that a figure of the benchmarks shows."""
    parents = FIGURES[wildcards.figure].parents
    if ANY_MORE in parents:
        parents = [f"bench/{name}" for name in COMPARED]
    return [f"results/{parent}.nc" for parent in parents]
