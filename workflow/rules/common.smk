# What all rules share: the scenario, where its results go, and who needs what.

import os
import sys

from snakemake.exceptions import WorkflowError
from snakemake.utils import min_version

from softslip.errors import ConfigError
from softslip.stages import STAGES
from softslip.sweep import load_scenario

min_version("9.0")

# Rules call the command that belongs to this very Python, whether or not it is activated.
# Sums that BLAS splits over threads would depend on how many there are.
os.environ |= {
    "PATH": os.pathsep.join([os.path.dirname(sys.executable), *os.get_exec_path()]),
    "OPENBLAS_NUM_THREADS": "1",
}

unknown = sorted(set(config) - {"scenario", "numerics"})
if unknown:
    raise WorkflowError(
        f"--config {unknown[0]}: is no setting of this workflow; put parameters into a "
        "scenario file and choose it with --config scenario=NAME, or a study of the numerics with "
        "--config numerics=NAME"
    )

# The name of a file in config/ without its suffix, or the path of a .yaml file anywhere.
SOURCE = str(config.get("scenario", "demo"))

try:
    SCENARIO = load_scenario(SOURCE)
except ConfigError as error:
    raise WorkflowError(str(error)) from None

RESULTS = f"results/{SCENARIO.name}"
ENVIRONMENT = "envs/softslip.yaml"
TABLES = {stage: SCENARIO.stage_table(stage) for stage in STAGES}


wildcard_constraints:
    run="[0-9a-f]{16}",


def parent_of(stage):
    """Return an input function: the file of the stage before."""
    before = STAGES[STAGES.index(stage) - 1]

    def parent(wildcards):
        return f"{RESULTS}/{before}/{TABLES[stage][wildcards.run].parent}.nc"

    return parent


def run_labels(wildcards):
    """Name a run's swept values in the report."""
    for run in SCENARIO.runs():
        if run.ids["shear"] == wildcards.run:
            return {label: str(value) for label, value in run.coordinates.items()}
    return {}
