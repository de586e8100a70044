"""Names that are meant to do harm are refused in one line, or taken for the plain names they are.

Everything is written below a temporary folder: what a broken guard lets through must do no harm.
"""

import multiprocessing
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from projects import copy_project
from typer.testing import CliRunner

from softslip.cli import app
from softslip.config.scenario import load_scenario
from softslip.files.storage import read_dataset

TINY = """\
description: A channel without particles, which is packed and grown at once.
base:
  channel: {length: 0.0625, height: 0.09375, outer_gap: 0.0078125}
  hydrodynamics: {resolution: 2048}
  suspension: {area_fraction: 0.0}
  recording: {bulk_margin: null}
"""

SHELL = ["$(touch pwned)", "`touch pwned`", "; touch pwned", "a && touch pwned", "| touch pwned"]
"""What a shell would run."""

SIGNS = ["a\nb", "tiny\n", "a b", "'", '"', "é", "~", "*", "{run}", "\x1b[31m", "\u202e", "🦆"]
"""What a shell or a terminal takes for something else."""

PATHS = ["", ".", "..", "../tiny", "tiny/", "./tiny", "config/tiny", "/tiny", "//"]
"""What leads elsewhere."""

LONG = ["x" * 300, "x" * 5000, "../" * 100 + "tiny"]

OPTIONS = ["-x", "--", "--nothing", "--output"]
"""What the command line takes for an option: it answers with its usage, in several lines."""

NAMES = [*SHELL, *SIGNS, *PATHS, *LONG]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the current folder, with one scenario in it and room above for what breaks out."""
    inside = tmp_path / "inside"
    (inside / "config").mkdir(parents=True)
    (inside / "config" / "tiny.yaml").write_text(TINY)
    monkeypatch.chdir(inside)
    return inside


@pytest.fixture
def packed(folder: Path) -> Path:
    """Return the packing of the scenario."""
    status, said = call("packing", "tiny", identity("packing"), "--output", "packed.nc")
    assert status == 0, said
    return folder / "packed.nc"


def identity(stage: str) -> str:
    return load_scenario("tiny").runs()[0].ids[stage]


def call(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, list(words))
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.output


def content(folder: Path) -> dict[str, bytes]:
    """Return every plain file by its name, also above the current folder."""
    above = folder.parent
    return {
        str(path.relative_to(above)): path.read_bytes()
        for path in sorted(above.rglob("*"))
        if path.is_file() and not path.is_symlink()
    }


def assert_refused(folder: Path, *words: str, statuses: tuple[int, ...] = (2,)) -> str:
    """Call a command and see that it says why not, in one line, and does nothing."""
    before = content(folder)
    status, said = call(*words)
    assert status in statuses, f"exit status {status}: {said!r}"
    assert said.endswith("\n"), repr(said)
    assert said.count("\n") == 1, f"more than one line: {said!r}"
    assert said.strip().isprintable(), ascii(said)
    assert len(said) < 700, f"{len(said)} characters"
    assert content(folder) == before, f"{set(content(folder)) ^ set(before)} came or went"
    return said


# --- scenarios and runs -----------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_a_scenario_of_a_hostile_name_is_refused(folder: Path, name: str) -> None:
    said = assert_refused(folder, "runs", name)
    assert re.search("is (not|neither) a scenario's name", said), said


@pytest.mark.parametrize("name", [*SHELL, *SIGNS, *LONG[:2], "", ".", "..", "tiny/", "--"])
def test_a_scenario_file_of_a_hostile_name_is_refused(folder: Path, name: str) -> None:
    shutil.copy("config/tiny.yaml", "plain.yaml")
    assert_refused(folder, "runs", "--", f"{name}.yaml")
    assert_refused(folder, "runs", f"no/such/{name}/folder/plain.yaml")


@pytest.mark.parametrize("name", [*SHELL, *SIGNS, "-x", "x" * 200])
def test_a_folder_of_any_name_may_hold_a_scenario(folder: Path, name: str) -> None:
    """Only the file's own name becomes a folder of results."""
    Path(name).mkdir()
    (Path(name) / "tiny.yaml").write_text(TINY)
    before = content(folder)
    status, said = call("runs", f"./{name}/tiny.yaml")
    assert status == 0, said
    assert identity("shear") in said
    assert content(folder) == before


@pytest.mark.parametrize("target", ["tiny.yaml", "nowhere", "/dev/zero", "/dev/stdin", "."])
def test_a_scenario_that_is_a_link_to_nothing_plain_is_refused(folder: Path, target: str) -> None:
    Path("tiny.yaml").symlink_to(target)
    assert_refused(folder, "runs", "tiny.yaml")


@pytest.mark.parametrize("name", [name for name in NAMES if name != "--"])
def test_a_run_of_a_hostile_name_is_refused(folder: Path, name: str) -> None:
    said = assert_refused(folder, "packing", "tiny", name, "--output", "out.nc")
    assert "is the beginning of 0 packing runs" in said


@pytest.mark.parametrize("name", OPTIONS)
def test_what_looks_like_an_option_is_no_name(folder: Path, name: str) -> None:
    before = content(folder)
    for words in (("runs", name), ("packing", "tiny", name, "--output", "out.nc")):
        status, said = call(*words)
        assert status == 2, said
        assert "Traceback" not in said
    assert content(folder) == before


@pytest.mark.parametrize("name", NAMES)
def test_a_table_figure_or_study_of_a_hostile_name_is_refused(folder: Path, name: str) -> None:
    assert_refused(folder, "gather", name, "tiny", "--output", "out.nc")
    assert_refused(folder, "draw", name, "in.nc", "--output", "out.png")
    assert_refused(folder, "numerics", "limits", "--study", name, "--output", "out.nc")


@pytest.mark.parametrize(
    "words", ["[red]x[/red]", "[/]", "[/nothing] x", "[bold", "[link=file:///x]y[/link]", ":duck:"]
)
def test_a_description_is_shown_as_it_stands(folder: Path, words: str) -> None:
    Path("config/odd.yaml").write_text(
        TINY.replace("A channel", f"'{words}").replace("at once.", "at once.'")
    )
    status, said = call("runs", "odd")
    assert status == 0, said
    assert words in said, said


# --- files to read ----------------------------------------------------------------------------

READERS = {
    "expansion": lambda name: ("expansion", "tiny", identity("expansion"), "--parent", name),
    "fit": lambda name: ("fit", "--", name),
    "compare": lambda name: ("compare", "--", name),
    "draw": lambda name: ("draw", "fig4", "--", name),
}
"""Commands that read a dataset, without their output."""


def reading(command: str, name: str) -> tuple[str, ...]:
    first, *rest = READERS[command](name)
    suffix = "png" if command == "draw" else "nc"
    return first, "--output", f"out.{suffix}", *rest


@pytest.mark.parametrize("command", READERS)
@pytest.mark.parametrize("name", [*NAMES, "-x", "http://127.0.0.1:9/x.nc", "x.nc#mode=nczarr,file"])
def test_a_dataset_of_a_hostile_name_is_not_there(folder: Path, command: str, name: str) -> None:
    said = assert_refused(folder, *reading(command, name), statuses=(1,))
    assert said.startswith("DatasetError: ")


@pytest.mark.parametrize("name", [*SHELL, *SIGNS, "-x"])
def test_a_dataset_of_any_name_is_read(packed: Path, name: str) -> None:
    packed.rename(name)
    status, said = call(*reading("expansion", name))
    assert status == 0, said
    read_dataset(Path("out.nc"), stage="expansion")
    assert not Path("pwned").exists()


def _fifo(path: Path) -> None:
    os.mkfifo(path)


def _link(target: str) -> Callable[[Path], None]:
    return lambda path: path.symlink_to(target)


SPECIAL: dict[str, Callable[[Path], None]] = {
    "folder": Path.mkdir,
    "fifo": _fifo,
    "itself": _link("special.nc"),
    "dangling": _link("nowhere"),
    "zero": _link("/dev/zero"),
    "text": _link("config/tiny.yaml"),
    "empty": Path.touch,
}


def _read(words: tuple[str, ...], pipe: "multiprocessing.connection.Connection") -> None:
    pipe.send(call(*words))


@pytest.mark.parametrize("name", SPECIAL)
def test_what_is_no_dataset_is_refused_and_not_waited_for(folder: Path, name: str) -> None:
    """In a process of its own: a library that waits in a call of the system hears no alarm."""
    SPECIAL[name](Path("special.nc"))
    before = content(folder)
    here, there = multiprocessing.Pipe()
    reader = multiprocessing.get_context("fork").Process(
        target=_read, args=(reading("expansion", "special.nc"), there)
    )
    reader.start()
    try:
        assert here.poll(20), "the command waits for ever"
        status, said = here.recv()
    finally:
        reader.kill()
        reader.join()
    assert status == 1, said
    assert said.count("\n") == 1, said
    assert "delete" not in said or name in ("text", "empty"), f"bad advice: {said}"
    assert content(folder) == before


# --- files to write ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*SHELL, *(sign for sign in SIGNS if sign.isprintable()), "-x"])
def test_an_output_of_any_plain_name_is_that_file(folder: Path, name: str) -> None:
    before = set(content(folder))
    status, said = call("packing", "tiny", identity("packing"), "--output", f"{name}.nc")
    assert status == 0, said
    written = {file for file in content(folder) if file.endswith(".nc")} - before
    assert written == {f"inside/{name}.nc"}


@pytest.mark.parametrize(
    "name",
    ["", ".", "..", "config", "config/", "a\nb.nc", "\x1b[31m.nc", "x" * 300 + ".nc", "taken/x.nc"],
)
def test_an_output_that_cannot_be_written_is_refused_before_any_work(
    folder: Path, name: str
) -> None:
    Path("taken").write_text("a file, and so no folder")
    assert_refused(folder, "packing", "tiny", identity("packing"), "--output", name)


@pytest.mark.parametrize("name", ["config/tiny.yaml", "../precious", "precious.txt", "special"])
def test_an_output_is_never_written_over_what_is_no_output(folder: Path, name: str) -> None:
    """A slip between two arguments must not cost a scenario, or a file of the system."""
    for precious in ("../precious", "precious.txt"):
        Path(precious).write_text("precious")
    _fifo(Path("special"))
    assert_refused(folder, "packing", "tiny", identity("packing"), "--output", name)
    assert Path(name).exists()


def test_an_output_that_is_a_link_leaves_what_it_leads_to(folder: Path) -> None:
    Path("precious.txt").write_text("precious")
    Path("out.nc").symlink_to("precious.txt")
    status, said = call("packing", "tiny", identity("packing"), "--output", "out.nc")
    assert status == 0, said
    assert Path("precious.txt").read_text() == "precious"
    assert not Path("out.nc").is_symlink()


# --- the workflow -----------------------------------------------------------------------------


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Return a copy of what the workflow is made of, without any results."""
    return copy_project(tmp_path)


def snakemake(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "snakemake", "--cores", "1", *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)


@pytest.mark.workflow
@pytest.mark.parametrize(
    "setting",
    [
        "scenario=$(touch pwned)",
        "scenario=../config/demo",
        "scenario=[demo, '; touch pwned']",
        "numerics=`touch pwned`",
        "numerics=../full",
        "stress=$(touch pwned)",
    ],
)
def test_a_hostile_setting_is_refused_before_any_work(project: Path, setting: str) -> None:
    result = snakemake(project, "--dry-run", "--config", setting)
    said = result.stdout + result.stderr
    assert result.returncode != 0, said
    assert "Traceback" not in said, said
    assert not list(project.rglob("pwned*"))
    assert not (project / "results").exists(), "work was started"


@pytest.mark.workflow
def test_a_rule_takes_a_scenario_in_a_hostile_folder_for_its_plain_name(project: Path) -> None:
    name = "a $(touch pwned) `touch pwned`; touch pwned 'b' \"c\" é"
    hostile = project / name
    hostile.mkdir()
    (hostile / "tiny.yaml").write_text(TINY)
    scenario = load_scenario(str(hostile / "tiny.yaml"))
    (run,) = scenario.stage_table("expansion")
    output = f"results/tiny/expansion/{run}.nc"
    result = snakemake(project, output, "--config", f"scenario={name}/tiny.yaml")
    assert result.returncode == 0, result.stdout + result.stderr
    read_dataset(project / output, stage="expansion", run=run)
    assert not list(project.rglob("pwned*"))
