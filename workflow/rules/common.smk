# What all rules share: the scenario, where its results go, and who needs what.

import atexit
import os
import sys
from contextlib import ExitStack
from functools import cache
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.utils import min_version

try:
    import softslip
except ModuleNotFoundError:
    raise WorkflowError(
        f"softslip: is not installed for {sys.executable}, which runs Snakemake; install it there "
        "with pip, from its wheel or its repository"
    ) from None

from softslip.errors import ConfigError, SoftslipError
from softslip.files.expected_results import expected_results, run_shown
from softslip.files.products import ANY_MORE, FIGURES, MOVIE, SNAPSHOT
from softslip.provenance.fingerprints import fingerprint
from softslip.operations.asked_results import no_run_to_show, no_such_run, why_not
from softslip.operations.lock import run_lock
from softslip.operations.job_requests import JobRequests
from softslip.operations.leftovers import remove
from softslip.config.stages import STAGES
from softslip.config.sweep_order import priorities
from softslip.operations.scenario_status import scenario_status
from softslip.config.scenario import load_scenario
from softslip.provenance.scenario_file import refuse_other_file
from softslip.provenance.timestamps import put_in_order

min_version("9.0")

# Rules call the command that belongs to this very Python, whether or not it is activated.
os.environ |= {"PATH": os.pathsep.join([os.path.dirname(sys.executable), *os.get_exec_path()])}

# For a module they are given by the workflow that has it.
if os.path.isfile("config/config.yaml"):

    configfile: "config/config.yaml"


unknown = sorted(set(config) - {"scenario", "numerics", "checkpoint", "longest", "finished"})
if unknown:
    raise WorkflowError(
        f"--config {unknown[0]}: is no setting of this workflow; put parameters into a "
        "scenario file and choose it with --config scenario=NAME, or a study of the numerics with "
        "--config numerics=NAME; the seconds between two checkpoints are --config checkpoint=60, "
        "the minutes of the longest job on a cluster --config longest=1440; tables and figures of "
        "the runs that are done, without beginning others, --config finished=true"
    )

# Snakemake keeps the last of several --config, and what the others said would be lost.
given = [word.partition("=")[0] in ("--config", "-C") for word in sys.argv[1:]]
if workflow.is_main_process and sum(given) > 1:
    raise WorkflowError(
        "--config: is given more than once, and Snakemake would only keep the last; give all "
        "settings after one: --config scenario=NAME checkpoint=60"
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

# Minutes that the longest job of a batch system may take.
LONGEST = config.get("longest", float("inf"))
if not isinstance(LONGEST, int | float) or isinstance(LONGEST, bool) or not LONGEST >= 2:
    raise WorkflowError(
        f"--config longest={LONGEST}: is not a number of minutes from 2 on; leave it out where jobs "
        "may be as long as they need"
    )

# Whether tables and figures are made of the runs that are done, and no other is begun.
# Snakemake hands on words of the command line as text.
FINISHED = {"true": True, "false": False}.get(str(config.get("finished", False)).lower())
if FINISHED is None:
    raise WorkflowError(
        f"--config finished={config['finished']}: is neither true nor false; leave it out to make "
        "all runs"
    )

# A run that ends without a result is started once more, and resumes. Not so within a job of a batch
# system, which is one attempt: profiles/slurm says how often it is submitted.
RETRIES = 1 if workflow.is_main_process else 0

RESULTS = f"results/{SCENARIO.name}"


# Of this module, also when functions of its rules are called, which is later.
PREFIXED = workflow.modifier.path_modifier


def located(path):
    """Return where a path of the rules is: a module may be given a prefix for all of them."""
    return PREFIXED.replace_prefix(path)


PLACE = Path(located(RESULTS))

# What concerns the whole folder is done once, and not in the process of every job.
if workflow.is_main_process:
    try:
        refuse_other_file(SCENARIO, PLACE)
    except ConfigError as error:
        raise WorkflowError(str(error)) from None
    # Snakemake tells by times what is out of date, which copies and archives do not keep.
    put_in_order(PLACE)

# Snakemake's own lock is a file that outlives a killed process (profiles/default leaves it out).
# This one is freed by the system, so that the same command starts again at once. A workflow that
# has this one as a module calls `onstart` and `onsuccess` from its own, see config/README.md.
ALONE = ExitStack()
atexit.register(ALONE.close)


onstart:
    try:
        ALONE.enter_context(run_lock(PLACE, "workflow"))
    except SoftslipError as error:
        raise WorkflowError(f"{PLACE}: {error}") from None


# Only now does Snakemake hold every result for complete: what made them is of no more use.
onsuccess:
    for _ in remove(PLACE, scenario_status(SCENARIO, PLACE).leftovers(), print):
        pass


ENVIRONMENT = "envs/softslip.yaml"
TABLES = {stage: SCENARIO.stage_table(stage) for stage in STAGES}
SHOWN = [run for run in TABLES["shear"] if not FINISHED or (PLACE / "shear" / f"{run}.nc").exists()]
if not SHOWN:
    raise WorkflowError(
        f"--config finished=true: no run of {SCENARIO.name} is done; leave it out to begin them"
    )
PRIORITIES = priorities(SCENARIO)


LABELS = {
    run.ids["shear"]: {label: str(value) for label, value in run.coordinates.items()}
    for run in SCENARIO.runs()
}


wildcard_constraints:
    run="[0-9a-f]{16}",


def run_of(stage, wildcards):
    """Return the run of a stage that a file's name asks for."""
    try:
        return TABLES[stage][wildcards.run]
    except KeyError:
        raise WorkflowError(no_such_run(stage, wildcards.run, SCENARIO)) from None


# What is asked for on the command line is looked at before Snakemake does, whose own errors on
# what functions of rules raise are tracebacks. What is to be forgotten need not be known.
if workflow.is_main_process and not {"--cleanup-metadata", "--cm"} & set(sys.argv):
    for refusal in filter(None, (why_not(word, SCENARIO, PLACE) for word in sys.argv[1:])):
        raise WorkflowError(refusal)


def in_folder(word, folder):
    """Whether a word of the command line is a file in a folder."""
    return bool(word) and os.path.relpath(word).startswith(f"{folder}/")


def not_counted(value):
    """Return a params function: a value on which no result depends, such as a file's spelling.

    It takes the output because Snakemake then does not rerun jobs whose value differs.
    """

    def constant(wildcards, output):
        return value

    return constant


def parent_of(stage):
    """Return an input function: the file of the stage before."""
    before = STAGES[STAGES.index(stage) - 1]

    def parent(wildcards):
        return f"{RESULTS}/{before}/{run_of(stage, wildcards).parent}.nc"

    return parent


def parameters_of(stage):
    """Return a params function: all parameters of a run, so that its job reads no scenario.

    It takes the output because Snakemake then does not rerun jobs whose parameters differ: what
    only later stages depend on may differ between two scenarios that share a run.
    """

    def parameters(wildcards, output):
        return run_of(stage, wildcards).parameters.model_dump_json()

    return parameters


def priority_of(stage):
    """Return a priority function: a useful part of the sweep is done first."""

    def priority(wildcards):
        run_of(stage, wildcards)
        return PRIORITIES[stage][wildcards.run]

    return priority


@cache
def requests(corrected):
    return JobRequests(SCENARIO, PLACE, corrected, LONGEST)


def requests_of_jobs():
    """Return what a batch system is asked for, see docs/cluster.md.

    Finished runs are looked at only where jobs are submitted: not in the jobs themselves, nor where
    nobody asks.
    """
    return requests(workflow.is_main_process and not workflow.local_exec)


def minutes_of(stage):
    """Return a resource function: the time limit of a run's job."""

    def minutes(wildcards, attempt):
        run_of(stage, wildcards)
        return requests_of_jobs().minutes(stage, wildcards.run, attempt)

    return minutes


def memory_of(stage):
    """Return a resource function: the memory of a run's job, in megabytes."""

    def megabytes(wildcards, attempt):
        run_of(stage, wildcards)
        return requests_of_jobs().megabytes(stage, wildcards.run, attempt)

    return megabytes


def run_labels(wildcards):
    """Name a run's swept values in the report, or the run where nothing is swept."""
    return LABELS.get(wildcards.run) or {"run": wildcards.run}


# The benchmark figure's datasets, that of the bars over N first.
COMPARED = ["scaling", "mobility_100", "mobility_800", "run_100", "run_800"]


def benchmarks_drawn(wildcards):
    """Return the datasets that a figure of the benchmarks shows."""
    parents = FIGURES[wildcards.figure].parents
    if ANY_MORE in parents:
        parents = [f"bench/{name}" for name in COMPARED]
    return [f"results/{parent}.nc" for parent in parents]


def shown_in(figure):
    """Return the datasets that a figure shows: of the whole scenario, or of one of its runs."""
    entry = FIGURES[figure]
    if not entry.sample:
        return [f"{RESULTS}/{dataset}.nc" for dataset in entry.parents]
    run = run_shown(entry, SCENARIO, SHOWN)
    if run is None:
        raise WorkflowError(no_run_to_show(figure, SCENARIO))
    return [f"{RESULTS}/shear/{run}.nc"]


DRAWN = [
    f"{RESULTS}/{result.name}"
    for result in expected_results(SCENARIO, SHOWN)
    if result.rule in ("figure", MOVIE) or (result.rule == SNAPSHOT and result.run in SHOWN)
]
