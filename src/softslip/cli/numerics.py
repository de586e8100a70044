"""`softslip numerics`: the jobs of a study of the numerics, and what is published of it."""

import json
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
import xarray as xr

from softslip.cli.common import Output, one_line_errors
from softslip.errors import ConfigError
from softslip.files.storage import read_dataset, write_dataset
from softslip.provenance.attribution import Job
from softslip.provenance.fingerprints import fingerprint
from softslip.provenance.product_labels import read_product

if TYPE_CHECKING:
    from softslip.studies.study import Study

app = typer.Typer(
    no_args_is_help=True,
    help="Validate, trade speed for accuracy, and stretch the scheme, as a study asks for.",
)

StudyName = Annotated[
    str, typer.Option("--study", help="Name of a file in config/numerics/, without .yaml.")
]
Cores = Annotated[int, typer.Option(min=1, help="Processes that share the work.")]
Name = Annotated[str, typer.Argument(metavar="NAME", help="Which one, see the study.")]
Data = Annotated[list[Path], typer.Argument(help="Datasets to gather.", readable=False)]
Scene = Annotated[Path, typer.Option(help="Dataset that `numerics scene` wrote.", readable=False)]


def _tell(line: str) -> None:
    """Show a phase of a measurement on standard error."""
    print(f"numerics: {line}", file=sys.stderr, flush=True)


MADE_BY = {
    "validation": "validation",
    "stability": "stability",
    "stability_map": "stability",
    "limits": "stability",
    "scene": "tradeoff",
    "member": "tradeoff",
    "steady": "tradeoff",
    "tradeoff": "tradeoff",
    "elements": "bench",
    "coverage": "coverage",
}
"""Kinds of datasets, and the code that makes them; see `provenance.fingerprints.ENTRIES`."""


@dataclass(frozen=True)
class _StudyPart:
    """A part of a study that is being worked on."""

    study: "Study"

    def write(
        self,
        dataset: xr.Dataset,
        output: Path,
        kind: str,
        name: str,
        parents: Iterable[xr.Dataset] = (),
    ) -> None:
        """Write a dataset with what produced it."""
        origin = Job().labels(parents, fingerprint=fingerprint(MADE_BY[kind]))
        parameters = dataset.attrs.get("parameters", self._parameters(kind, name))
        labelled = dataset.assign_attrs(study=self.study.name, parameters=parameters, **origin)
        write_dataset(
            labelled, output, stage=kind, run=name, title=f"{kind} of the numerics: {name}"
        )

    def _parameters(self, kind: str, name: str) -> str:
        """Return the part of the study that a dataset depends on, as JSON."""
        if kind == "validation":
            chosen = self.study.validation[name]
            return json.dumps({"case": chosen.case, "axes": dict(chosen.axes)})
        if kind == "elements":
            return json.dumps(dict(self.study.elements))
        if kind == "coverage":
            return json.dumps({"draws": self.study.draws})
        designs = {"stability": self.study.stability, "tradeoff": self.study.tradeoff}
        return json.dumps(designs[MADE_BY[kind]].model_dump(mode="json"))


def _job(name: str) -> _StudyPart:
    """Begin a part of a study; the solver, which studies know, is imported by those who want it."""
    from softslip.studies.study import load_study

    return _StudyPart(load_study(name))


def _one_of(name: str, names: list[str], what: str) -> str:
    if name not in names:
        raise ConfigError("name", name, f"is no {what}", f"use one of {', '.join(names)}")
    return name


@app.command()
@one_line_errors
def validation(name: Name, output: Output, study: StudyName = "full") -> None:
    """Solve a case with a known solution for all values that the study lists."""
    from softslip.studies.validation import CASES
    from softslip.studies.validation.sweeps import sweep

    job = _job(study)
    chosen = job.study.validation[
        _one_of(name, list(job.study.validation), f"validation of {study}")
    ]
    case = CASES[_one_of(chosen.case, list(CASES), "case")]
    job.write(sweep(case, chosen.axes, tell=_tell), output, "validation", name)


@app.command()
@one_line_errors
def stability(name: Name, output: Output, study: StudyName = "full") -> None:
    """Run all cells along one axis of the map of stability."""
    from softslip.studies.stability import GROUPS, measure_group

    job = _job(study)
    group = _one_of(name, list(GROUPS), "axis of the map")
    job.write(measure_group(group, job.study.stability, _tell), output, "stability", name)


@app.command()
@one_line_errors
def limits(output: Output, study: StudyName = "full") -> None:
    """Measure the longest stable steps of both integrators, next to theory."""
    from softslip.studies.stability import measure_limits

    job = _job(study)
    job.write(measure_limits(job.study.stability, _tell), output, "limits", "limits")


@app.command(name="map")
@one_line_errors
def stability_map(data: Data, output: Output, study: StudyName = "full") -> None:
    """Gather the axes of the map, and name the cells that are wrong."""
    from softslip.studies.stability import gather
    from softslip.studies.stability.map_markdown import wrong_cells

    job = _job(study)
    groups = [read_dataset(path, stage="stability") for path in data]
    gathered = gather(groups)
    job.write(gathered, output, "stability_map", "map", groups)
    for cell in wrong_cells(gathered):
        print(f"wrong: {cell}", file=sys.stderr)


@app.command()
@one_line_errors
def scene(output: Output, study: StudyName = "full") -> None:
    """Make the sheared packings that all members of the trade-off start from."""
    from softslip.studies.tradeoff.tradeoff_scenes import prepare

    job = _job(study)
    job.write(prepare(job.study.tradeoff, _tell), output, "scene", "scene")


@app.command()
@one_line_errors
def member(name: Name, scene: Scene, output: Output, study: StudyName = "full") -> None:
    """Measure one member of the trade-off: its flow, and its cost beside the reference."""
    from softslip.studies.tradeoff.member_dataset import measure_member
    from softslip.studies.tradeoff.members import members_of

    job = _job(study)
    members = members_of(job.study.tradeoff)
    chosen = members[_one_of(name, list(members), f"member of {study}")]
    start = read_dataset(scene, stage="scene")
    job.write(
        measure_member(start, chosen, job.study.tradeoff, _tell), output, "member", name, [start]
    )


@app.command()
@one_line_errors
def steady(name: Name, output: Output, study: StudyName = "full") -> None:
    """Run one packing for long, at all regularisation lengths of the study."""
    from softslip.studies.tradeoff.long_runs import measure_steady, sheared_packings

    job = _job(study)
    cases = sheared_packings(job.study.tradeoff)
    chosen = cases[_one_of(name, list(cases), f"long run of {study}")]
    job.write(measure_steady(chosen, job.study.tradeoff, _tell), output, "steady", name)


@app.command()
@one_line_errors
def tradeoff(data: Data, output: Output, study: StudyName = "full") -> None:
    """Gather members and long runs into the trade-off dataset."""
    from softslip.studies.tradeoff.table import gather

    job = _job(study)
    kinds = [_one_of(read_product(path).stage, ["member", "steady"], "part") for path in data]
    read = [read_dataset(path, stage=kind) for path, kind in zip(data, kinds, strict=True)]
    members, runs = (
        [part for part in read if part.attrs["stage"] == kind] for kind in ("member", "steady")
    )
    job.write(gather(members, runs), output, "tradeoff", "tradeoff", read)


@app.command()
@one_line_errors
def elements(output: Output, study: StudyName = "full") -> None:
    """Measure what each element of a scene costs, and what is saved without it."""
    from softslip.studies.bench import as_dataset, bench_elements

    job = _job(study)
    result = bench_elements(**job.study.elements, tell=_tell)
    job.write(as_dataset(result), output, "elements", "elements")


@app.command()
@one_line_errors
def coverage(output: Output, study: StudyName = "full", cores: Cores = 1) -> None:
    """Measure on made-up data how often verdicts err, and how often intervals hold the truth."""
    from softslip.studies.coverage import measure_coverage

    job = _job(study)
    measured = measure_coverage(job.study.draws, _tell, cores)
    job.write(measured, output, "coverage", "coverage")


@app.command()
@one_line_errors
def publish(
    results: Annotated[
        Path, typer.Argument(help="Folder of a finished study.", readable=False)
    ] = Path("results/numerics/full"),
) -> None:
    """Copy a study's datasets and figures to results/published/numerics, and write the tables.

    The tables in the generated blocks of docs/accuracy.md are replaced, and so are the settings
    that the key `accuracy` chooses from.
    """
    from softslip.studies.publish import NUMERICS

    for path in NUMERICS.write(results):
        print(path)
