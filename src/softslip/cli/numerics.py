"""`softslip numerics`: the jobs of a study of the numerics, and what is published of it."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
import xarray as xr

from softslip.cli.common import Output, one_line_errors
from softslip.errors import ConfigError
from softslip.storage import read_dataset, write_dataset

if TYPE_CHECKING:
    from softslip.numerics import Study

app = typer.Typer(
    no_args_is_help=True,
    help="Validate, trade speed for accuracy, and stretch the scheme, as a study asks for.",
)

StudyName = Annotated[
    str, typer.Option("--study", help="Name of a file in config/numerics/, without .yaml.")
]
Name = Annotated[str, typer.Argument(metavar="NAME", help="Which one, see the study.")]
Data = Annotated[list[Path], typer.Argument(help="Datasets to gather.")]
Scene = Annotated[Path, typer.Option(help="Dataset that `numerics scene` wrote.")]


def _tell(line: str) -> None:
    """Show a phase of a measurement on standard error."""
    print(f"numerics: {line}", file=sys.stderr, flush=True)


def _study(name: str) -> "Study":
    """Return a study; the solver, which studies know, is imported by those who want one."""
    from softslip.numerics import load_study

    return load_study(name)


def _write(dataset: xr.Dataset, output: Path, kind: str, study: "Study", name: str) -> None:
    title = f"{kind} of the numerics: {name}"
    labelled = dataset.assign_attrs(study=study.name)
    write_dataset(labelled, output, stage=kind, run=name, title=title)


def _one_of(name: str, names: list[str], what: str) -> str:
    if name not in names:
        raise ConfigError("name", name, f"is no {what}", f"use one of {', '.join(names)}")
    return name


@app.command()
@one_line_errors
def validation(name: Name, output: Output, study: StudyName = "full") -> None:
    """Solve a case with a known solution for all values that the study lists."""
    from softslip.validation import CASES
    from softslip.validation.sweeps import sweep

    given = _study(study)
    wanted = given.validation[_one_of(name, list(given.validation), f"validation of {study}")]
    case = CASES[_one_of(wanted.case, list(CASES), "case")]
    _write(sweep(case, wanted.axes, tell=_tell), output, "validation", given, name)


@app.command()
@one_line_errors
def stability(name: Name, output: Output, study: StudyName = "full") -> None:
    """Run all cells along one axis of the map of stability."""
    from softslip.stability import GROUPS, measure_group

    given = _study(study)
    group = _one_of(name, list(GROUPS), "axis of the map")
    _write(measure_group(group, given.stability, _tell), output, "stability", given, name)


@app.command()
@one_line_errors
def limits(output: Output, study: StudyName = "full") -> None:
    """Measure the longest stable steps of both integrators, next to theory."""
    from softslip.stability import measure_limits

    given = _study(study)
    _write(measure_limits(given.stability, _tell), output, "limits", given, "limits")


@app.command(name="map")
@one_line_errors
def stability_map(data: Data, output: Output, study: StudyName = "full") -> None:
    """Gather the axes of the map, and name the cells that are wrong."""
    from softslip.stability import gather
    from softslip.stability.markdown import wrong_cells

    given = _study(study)
    gathered = gather([read_dataset(path, stage="stability") for path in data])
    _write(gathered, output, "stability_map", given, "map")
    for cell in wrong_cells(gathered):
        print(f"wrong: {cell}", file=sys.stderr)


@app.command()
@one_line_errors
def scene(output: Output, study: StudyName = "full") -> None:
    """Make the sheared packings that all members of the trade-off start from."""
    from softslip.tradeoff.scene import prepare

    given = _study(study)
    _write(prepare(given.tradeoff, _tell), output, "scene", given, "scene")


@app.command()
@one_line_errors
def member(name: Name, scene: Scene, output: Output, study: StudyName = "full") -> None:
    """Measure one member of the trade-off: its flow, and its cost beside the reference."""
    from softslip.tradeoff.measure import measure_member
    from softslip.tradeoff.members import members_of

    given = _study(study)
    members = members_of(given.tradeoff)
    wanted = members[_one_of(name, list(members), f"member of {study}")]
    start = read_dataset(scene, stage="scene")
    _write(measure_member(start, wanted, given.tradeoff, _tell), output, "member", given, name)


@app.command()
@one_line_errors
def steady(name: Name, output: Output, study: StudyName = "full") -> None:
    """Run one packing for long, at all regularisation lengths of the plan."""
    from softslip.tradeoff.steady import cases_of, measure_steady

    given = _study(study)
    cases = cases_of(given.tradeoff)
    wanted = cases[_one_of(name, list(cases), f"long run of {study}")]
    _write(measure_steady(wanted, given.tradeoff, _tell), output, "steady", given, name)


@app.command()
@one_line_errors
def tradeoff(data: Data, output: Output, study: StudyName = "full") -> None:
    """Gather members and long runs into the trade-off dataset."""
    from softslip.tradeoff.table import gather

    given = _study(study)
    read = [xr.load_dataset(path, engine="netcdf4") for path in data]
    members = [dataset for dataset in read if dataset.attrs.get("stage") == "member"]
    runs = [dataset for dataset in read if dataset.attrs.get("stage") == "steady"]
    _write(gather(members, runs), output, "tradeoff", given, "tradeoff")


@app.command()
@one_line_errors
def elements(output: Output, study: StudyName = "full") -> None:
    """Measure what each element of a scene costs, and what is saved without it."""
    from softslip.bench import as_dataset, bench_elements

    given = _study(study)
    result = bench_elements(**given.elements, tell=_tell)
    _write(as_dataset(result), output, "elements", given, "elements")


@app.command()
@one_line_errors
def publish(
    results: Annotated[Path, typer.Argument(help="Folder of a finished study.")] = Path(
        "results/numerics/full"
    ),
) -> None:
    """Copy a study's datasets and figures to results/published/numerics, and write the tables.

    Written anew are the generated blocks of docs/accuracy.md, and the settings that the key
    `accuracy` chooses from.
    """
    from softslip.numerics.publish import publish as publish_study

    for path in publish_study(results):
        print(path)
