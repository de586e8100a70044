"""The plan is what Snakemake would do, and thousands of runs are looked at in seconds."""

import json
import os
import re
import shutil
import subprocess
import sys
import time
from base64 import urlsafe_b64encode
from collections.abc import Callable, Iterable
from pathlib import Path

import netCDF4
import numpy as np
import pytest
from projects import copy_project

from softslip.config.parameters import Parameters
from softslip.config.scenario import Scenario, load_scenario
from softslip.config.stages import STAGES, stage_ids
from softslip.operations.planning import make_plan
from softslip.provenance.fingerprints import fingerprint

pytestmark = pytest.mark.workflow

SMALL = """\
description: Two runs of each of a few packings.
base: {fidelity: preview}
axes:
  seed: [1, 2, 3, 4, 5, 6, 7]
  rheometer.stress: [0.1, 0.5]
"""

LARGE = f"""\
description: Two thousand runs of a hundred packings.
base: {{fidelity: preview, recording: {{snapshots: [50.0]}}}}
axes:
  wall.roughness: [0.0, 0.12, 0.24, 0.35, 0.59]
  rheometer.stress: {[round(0.01 * number, 2) for number in range(1, 21)]}
  seed: {list(range(1, 21))}
"""

OLD = "0" * 16
"""Fingerprint of code that is no more."""

VARIABLES, LABELS = 30, 15
"""Of each dataset: as many as a sheared run has."""

WORDS = dict(zip(("Packing", "Growing", "Ageing", "Shearing"), STAGES, strict=True))
"""First words of the messages of each stage's jobs."""

FORMAT = 6
"""Version of the records of Snakemake 9."""


class Project:
    """A copy of the project with the results of a scenario that were never computed."""

    def __init__(self, folder: Path, scenario: str) -> None:
        self.folder = copy_project(folder)
        self.source = folder / "config" / "scale.yaml"
        self.source.write_text(scenario)
        self.scenario: Scenario = load_scenario(str(self.source))
        self.results = folder / "results" / "scale"

    def path(self, stage: str, packing: int, number: int = 0) -> Path:
        """Return the dataset of a stage of a packing's runs, which are counted from 0."""
        runs = [run for run in self.scenario.runs() if run.coordinates["seed"] == packing]
        return self.results / stage / f"{runs[number].ids[stage]}.nc"

    def make(self, outdated: Iterable[Path] = ()) -> "Project":
        """Leave every dataset, older ones first, and Snakemake's record of each.

        Parameters
        ----------
        outdated
            Datasets by code that is no more.
        """
        old = set(outdated)
        began = time.time() - 1000
        for place, stage in enumerate(STAGES):
            table = self.scenario.stage_table(stage)
            made = {code: dataset(stage, code, self.folder) for code in (OLD, fingerprint(stage))}
            (self.results / stage).mkdir(parents=True)
            for run, row in table.items():
                path = self.results / stage / f"{run}.nc"
                code = OLD if path in old else fingerprint(stage)
                shutil.copy(made[code], path)
                with netCDF4.Dataset(path, "a") as file:
                    file.setncattr("run", run)
                os.utime(path, (began + place,) * 2)
                before = f"results/scale/{STAGES[place - 1]}/{row.parent}.nc"
                self._record(path, stage, code, [before] if place else [])
        return self

    def _record(self, path: Path, stage: str, code: str, inputs: list[str]) -> None:
        words = {
            "rule": stage,
            "input": inputs,
            "log": [],
            "shellcmd": "",
            "params": [repr(code)],
            "code": None,
            "record_format_version": FORMAT,
            "incomplete": False,
            "input_checksums": {},
        }
        record = urlsafe_b64encode(str(path.relative_to(self.folder)).encode()).decode()
        place = self.folder / ".snakemake" / "metadata" / record
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(json.dumps(words))
        (self.folder / ".snakemake" / "incomplete").mkdir(exist_ok=True)

    def call(self, *words: str) -> str:
        """Run a module of Python in the project, to a good end, and return what it said."""
        command = [sys.executable, "-m", *words]
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    def dry_run(self) -> set[tuple[str, str]]:
        """Return the stages and runs that Snakemake would run."""
        said = self.call("snakemake", "--cores", "1", "--dry-run", "--config", "scenario=scale")
        assert "This was a dry-run" in said or "Nothing to be done" in said, said
        jobs = re.findall(r"^Job \d+: (\w+)\b.*\(([0-9a-f]{16})\)$", said, re.M)
        return {(WORDS[word], run) for word, run in jobs if word in WORDS}

    def planned(self) -> set[tuple[str, str]]:
        """Return the stages and runs that are to be done by the plan."""
        tasks = make_plan(load_scenario(str(self.source)), self.results).runs
        return {(task.stage, task.run) for task in tasks if task.is_open}

    def named(self, paths: Iterable[Path]) -> set[tuple[str, str]]:
        """Return the stages and runs of datasets."""
        return {(path.parent.name, path.stem) for path in paths}


def dataset(stage: str, code: str, folder: Path) -> Path:
    """Write a dataset of no run, with as many variables and labels as true ones have."""
    path = folder / f"{stage}.{code}.nc"
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("node", 100)
        for number in range(VARIABLES):
            variable = file.createVariable(f"x{number}", "f8", ("node",), zlib=True)
            variable.setncatts({"units": "1", "long_name": "nothing"})
            variable[:] = np.arange(100.0)
        file.setncatts({f"label{number}": "some words" for number in range(LABELS)})
        file.setncatts({"stage": stage, "parameters": "{}" * 500})
        words = {"fingerprint": code, "core_seconds": 12.5, "environment": "python " * 20}
        file.setncattr("provenance", json.dumps(words))
    return path


def test_the_plan_is_what_snakemake_would_do(tmp_path: Path) -> None:
    """Each packing has met with something else, but for the last; see the comments."""
    project = Project(tmp_path, SMALL)
    path = project.path
    project.make(outdated=[path("expansion", 6)])
    wanted = []
    # A shear is missing.
    wanted.append(path("shear", 1))
    path("shear", 1).unlink()
    # An ageing is missing, and nobody needs it.
    path("ageing", 2).unlink()
    # An ageing is missing, and one of its shears: the other is made anew from the new one.
    wanted += [path("ageing", 3), path("shear", 3), path("shear", 3, 1)]
    path("ageing", 3).unlink()
    path("shear", 3).unlink()
    # All before a missing shear is missing.
    for stage in STAGES:
        wanted.append(path(stage, 4))
        path(stage, 4).unlink()
    wanted.append(path("shear", 4, 1))
    # An ageing is newer than what was sheared from it.
    wanted += [path("shear", 5), path("shear", 5, 1)]
    os.utime(path("ageing", 5))
    # An expansion is by other code.
    wanted += [path("expansion", 6), path("ageing", 6), path("shear", 6), path("shear", 6, 1)]
    assert project.planned() == project.named(wanted)
    assert project.dry_run() == project.named(wanted)


@pytest.mark.parametrize("values", ["[0.1, 0.3, 0.5]", "[0.05, 0.1, 0.5]"])
def test_an_axis_that_grows_asks_for_its_new_runs_alone(tmp_path: Path, values: str) -> None:
    """Also where the first of the runs that share a packing is a new one."""
    project = Project(tmp_path, SMALL).make()
    project.source.write_text(SMALL.replace("[0.1, 0.5]", values))
    planned = project.planned()
    assert len(planned) == 7
    assert {stage for stage, _ in planned} == {"shear"}
    assert project.dry_run() == planned


def test_each_job_is_handed_the_parameters_of_its_run(tmp_path: Path) -> None:
    project = Project(tmp_path, SMALL)
    words = ("--cores", "1", "--dry-run", "--printshellcmds", "--config", "scenario=scale")
    said = project.call("snakemake", *words)
    jobs = re.findall(
        r"^Shell command: exec softslip (\w+) scale ([0-9a-f]{16}) --parameters '(.*?)' ",
        said,
        re.M,
    )
    assert {(stage, run) for stage, run, _ in jobs} == project.planned()
    for stage, run, text in jobs:
        assert stage_ids(Parameters.from_json(text))[stage] == run


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Project:
    return Project(tmp_path_factory.mktemp("large"), LARGE).make()


def fastest(work: Callable[[], object], times: int = 3) -> float:
    """Return the shortest of a few times that something takes: others use the machine too."""

    def once() -> float:
        began = time.perf_counter()
        work()
        return time.perf_counter() - began

    return min(once() for _ in range(times))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "limit"),
    [
        (("softslip", "plan", "scale"), 3.0),
        (("softslip", "status", "scale"), 3.0),
        (("snakemake", "--cores", "1", "--dry-run", "--config", "scenario=scale"), 15.0),
    ],
    ids=["plan", "status", "dry run"],
)
def test_thousands_of_results_are_looked_at_in_seconds(
    large: Project, words: Iterable[str], limit: float
) -> None:
    taken = fastest(lambda: large.call(*words))
    print(f"{' '.join(words)}: {taken:.1f} s")
    assert taken < limit, f"{' '.join(words)} took {taken:.1f} s"


@pytest.mark.slow
def test_a_large_scenario_is_reused_as_a_whole(large: Project) -> None:
    assert large.planned() == set()
    assert large.dry_run() == set()
