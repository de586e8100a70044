"""No command ends in a traceback, whatever it inherits and wherever it is called.

Every subcommand is called under generated environments, streams, folders and rights. What may be
inherited without harm changes nothing: the command succeeds, with the same content. Everything is
met by one command at least in each run of the tests, and by all the others with `-m slow`.
"""

import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module
from itertools import cycle
from pathlib import Path
from typing import get_type_hints

import pytest
import small_results
import typer
from forked import Forks
from hostile import (
    FILES,
    FOLDERS,
    NAMES,
    READ_AT_START,
    RIGHTS,
    STREAMS,
    VARIABLES,
    WITHOUT_PRIVILEGES,
    Said,
    called,
    environments,
)
from projects import copy_project

from softslip.cli import COMMANDS, GROUPS
from softslip.cli.inherited import FAMILIES, KEPT
from softslip.config.scenario import load_scenario
from softslip.provenance.product_labels import read_product

STATUSES = (0, 1, 2, 75)
"""Exit statuses that are documented."""

FILE = "results/small/{stage}/{run}.nc"

WORDS: Mapping[str, str] = {
    "init": "init out/fresh",
    "packing": "packing small {packing} --output out/packing.nc",
    "expansion": "expansion small {expansion} --parent {packing_file} --output out/expansion.nc",
    "ageing": "ageing small {ageing} --parent {expansion_file} --output out/ageing.nc",
    "shear": "shear small {shear} --parent {ageing_file} --output out/shear.nc",
    "gather": "gather flow_curve small --output out/flow_curve.nc",
    "fit": "fit results/small/flow_curve.nc --output out/fits.nc",
    "compare": "compare results/small --output out/comparison.nc",
    "draw": "draw fig4 results/small/profiles.nc --output out/fig4.png",
    "explorer": "explorer small --output out/explorer.html",
    "runs": "runs small",
    "schema": "schema",
    "status": "status small --json",
    "clean": "clean small",
    "plan": "plan small --json",
    "calibrate": "calibrate results",
    "query": "query small stress>0.3 --json",
    "export": "export results/small/figures/fig4.png",
    "trace": "trace results/small/figures/fig4.png --json",
    "verify": "verify small --json",
    "crate": "crate small --zip out/small.zip",
    "effort": "effort small",
    "publish": "publish small",
    "reproduce": "reproduce small",
    "validate": "validate couette --json",
    "bench": "bench run --particles 0 --fidelity standard --output out/bench.nc",
    "numerics": "numerics limits --study nowhere --output out/limits.nc",
}
"""Every subcommand, as small as it can be; some of them only far enough to be refused."""

REFUSED = ("bench", "calibrate", "numerics")
"""Those that take minutes when they are not refused."""

SAID = ("plan", "query", "export")
"""Those whose answer has no time and no name of a machine in it."""

WRITTEN = {
    "packing": FILE,
    "expansion": FILE,
    "ageing": FILE,
    "shear": FILE,
    "gather": "results/small/flow_curve.nc",
    "fit": "results/small/fits.nc",
    "compare": "results/small/comparison.nc",
    "draw": "results/small/figures/fig4.png",
}
"""What was made in a clean environment by those that write results."""


def test_every_subcommand_is_called() -> None:
    assert set(WORDS) == {name for commands in COMMANDS.values() for name in commands}
    assert set(GROUPS) <= set(WORDS)


def parameters(commands: typer.Typer) -> Iterator[tuple[str, object]]:
    """Yield the name and the annotation of each parameter of a module's commands."""
    for group in commands.registered_groups:
        assert group.typer_instance is not None
        yield from parameters(group.typer_instance)
    for command in commands.registered_commands:
        assert command.callback is not None
        yield from get_type_hints(command.callback, include_extras=True).items()


@pytest.mark.parametrize("module", COMMANDS)
def test_commands_say_themselves_which_file_may_not_be_read(module: str) -> None:
    """Else typer would, in other words, and refuse to replace a file that may not be read."""
    commands = import_module(f"softslip.cli.{module}").app
    paths = [each for each in parameters(commands) if "pathlib.Path" in str(each[1])]
    for name, annotation in paths:
        (told,) = (each for each in annotation.__metadata__ if hasattr(each, "readable"))
        assert not told.readable, name


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a project with results that were made in this environment, not to be changed."""
    made, place = small_results.made(), tmp_path_factory.mktemp("clean")
    for name, content in FILES.items():
        (place / name).write_bytes(content)
    project = place / "project"
    (project / "out").mkdir(parents=True)
    copy_project(project)
    shutil.copy(made / "small.yaml", project / "config")
    shutil.copytree(made / "results", project / "results" / "small")
    published = project / "results" / "published" / "small"
    published.mkdir(parents=True)
    shutil.copy(made / "results" / "flow_curve.nc", published)
    return project


@pytest.fixture
def project(clean: Path, tmp_path: Path) -> Iterator[Path]:
    """Return a copy of it that may be changed."""
    copy = tmp_path / "project"
    shutil.copytree(clean, copy)
    for name in FILES:
        shutil.copy(clean.parent / name, tmp_path)
    yield copy
    for folder, _, _ in os.walk(tmp_path):
        os.chmod(folder, 0o755)


UNREADABLE = ("not UTF-8", "backslash")
"""Names of folders in which the NetCDF library opens no file."""


def words(command: str, project: Path) -> list[str]:
    """Return a command's line."""
    ids = load_scenario(str(project / "config" / "small.yaml")).runs()[0].ids
    files = {f"{stage}_file": FILE.format(stage=stage, run=run) for stage, run in ids.items()}
    return [word.format(**ids, **files) for word in WORDS[command].split(" ")]


@pytest.fixture(scope="module")
def answers(clean: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return what some commands say in a clean environment."""
    return {command: called(clean, words(command, clean)).output for command in SAID}


def assert_clear(said: Said, where: str, errors_are_seen: bool = True) -> None:
    """Make sure that a command has ended well or said why not."""
    both = said.output + said.errors
    assert said.status in STATUSES, f"{where}: exit status {said.status}: {both[-3000:]}"
    assert "Traceback" not in both, f"{where}: {both[-3000:]}"
    if said.status and errors_are_seen:
        # What these find is their answer, unless they are refused.
        found = both if where.startswith(("verify ", "trace ")) else said.errors
        assert found.strip(), f"{where}: no word on standard error"


def assert_same(
    command: str, said: Said, project: Path, clean: Path, answers: Mapping[str, str], where: str
) -> None:
    """Make sure that a command did what it does in a clean environment."""
    assert (said.status != 0) == (command in REFUSED), f"{where}: {said.errors[-3000:]}"
    if command in SAID:
        assert said.output == answers[command], where
    if command in WRITTEN:
        ids = load_scenario(str(clean / "config" / "small.yaml")).runs()[0].ids
        before = clean / WRITTEN[command].format(stage=command, run=ids.get(command, ""))
        (after,) = (project / "out").glob("*.*")
        assert read_product(after).content == read_product(before).content, where
    if command == "verify":
        report = json.loads(said.output)
        assert {each["verdict"] for each in report["files"]} == {"sound"}, where


def resolved(variables: Mapping[str, str | None], project: Path) -> dict[str, str | None]:
    """Return variables, with the folder that the files that they name are in."""
    here = str(project.parent)
    return {
        name: value if value is None else value.replace("{here}", here)
        for name, value in variables.items()
    }


@pytest.fixture(scope="module")
def forks() -> Iterator[Forks]:
    """Return what runs commands in forks."""
    served = Forks()
    yield served
    served.close()


@pytest.fixture(scope="module")
def forks_without_privileges() -> Iterator[Forks]:
    """Return what runs commands in forks, as a user to whom rights apply."""
    served = Forks(WITHOUT_PRIVILEGES if ROOT else None)
    yield served
    served.close()


ENVIRONMENTS = list(environments())

SHORT = ("runs", "status", "clean", "query", "plan")
"""Commands that take a second."""


def every_pair(kinds: Iterable[str], shift: int = 0) -> list[object]:
    """Return each kind with each command; one with each kind is no slow test."""
    return [
        pytest.param(
            kind, command, marks=() if command == SHORT[place % len(SHORT)] else pytest.mark.slow
        )
        for place, kind in enumerate(kinds, start=shift)
        for command in WORDS
    ]


@pytest.mark.parametrize(("number", "command"), every_pair(map(str, range(len(ENVIRONMENTS))), 3))
def test_no_command_depends_on_what_it_inherits(
    project: Path, clean: Path, answers: dict[str, str], number: str, command: str
) -> None:
    variables = resolved(ENVIRONMENTS[int(number)], project)
    said = called(project, words(command, project), variables)
    assert_clear(said, f"{command} in environment {number}")
    assert_same(command, said, project, clean, answers, f"{command} in environment {number}")


def not_withheld() -> Iterator[tuple[str, str | None, str]]:
    """Yield each variable that libraries see, with each of its values and one of the commands.

    All of them were tried together with every command; alone none is hidden by another.
    """
    seen = [name for name in VARIABLES if name in KEPT or not name.startswith(FAMILIES)]
    pairs = [(name, value) for name in seen for value in VARIABLES[name]]
    for (name, value), command in zip(pairs, cycle(WORDS), strict=False):
        yield name, value, command


@pytest.mark.slow
@pytest.mark.parametrize(("variable", "value", "command"), list(not_withheld()))
def test_no_command_depends_on_a_single_variable(
    project: Path,
    clean: Path,
    answers: dict[str, str],
    variable: str,
    value: str | None,
    command: str,
) -> None:
    said = called(project, words(command, project), resolved({variable: value}, project))
    where = f"{command} with {variable}={value}"
    assert_clear(said, where)
    assert_same(command, said, project, clean, answers, where)


@pytest.mark.parametrize(("state", "command"), every_pair(FOLDERS))
def test_no_folder_makes_a_traceback(
    forks: Forks, project: Path, clean: Path, state: str, command: str
) -> None:
    FOLDERS[state](project)
    line = words(command, clean)
    said = called(project, line) if state in READ_AT_START else Said(*forks.call(project, line))
    assert_clear(said, f"{command} where {state}")


@pytest.mark.parametrize(("name", "command"), every_pair(NAMES))
def test_no_name_of_a_folder_matters(
    forks: Forks, project: Path, clean: Path, answers: dict[str, str], name: str, command: str
) -> None:
    place = os.path.join(os.fsencode(project.parent), NAMES[name])
    os.rename(project, place)
    said = Said(*forks.call(place, words(command, clean)))
    os.rename(place, project)
    assert_clear(said, f"{command} in {name}")
    if name in UNREADABLE and said.status and command not in REFUSED:
        told = said.errors or said.output
        assert "rename that folder" in told, f"{command} in {name}: {told}"
    else:
        assert_same(command, said, project, clean, answers, f"{command} in {name}")


@pytest.mark.parametrize(("stream", "command"), every_pair(STREAMS))
def test_no_stream_makes_a_traceback(project: Path, clean: Path, stream: str, command: str) -> None:
    said = called(project, words(command, clean), stream=STREAMS[stream])
    seen = "2>" not in STREAMS[stream] and stream != "nobody reads"
    assert_clear(said, f"{command} where {stream}", seen)


ROOT = os.geteuid() == 0


@pytest.mark.skipif(ROOT and not shutil.which("setpriv"), reason="root may do everything")
@pytest.mark.parametrize(("right", "command"), every_pair(RIGHTS))
def test_missing_rights_are_told(
    forks_without_privileges: Forks, project: Path, clean: Path, right: str, command: str
) -> None:
    line = words(command, clean)
    RIGHTS[right](project)
    said = Said(*forks_without_privileges.call(project, line))
    assert_clear(said, f"{command} where {right}")
    if said.status and command not in REFUSED:
        # And not, say, that files are missing.
        assert "Permission denied" in said.output + said.errors, said.output + said.errors


def test_a_folder_that_is_gone_is_told(project: Path, clean: Path) -> None:
    for command in ("runs", "status", "packing"):
        gone = project / "gone"
        gone.mkdir()
        said = called(gone, words(command, clean), stream='rmdir "$PWD"; "$@"')
        assert_clear(said, f"{command} in no folder")
        assert said.status != 0
