"""Every command that the documents print is run, and every link that they have leads somewhere."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from markdown_it import MarkdownIt
from markdown_it.token import Token
from projects import ROOT, TINY, copy_project

from softslip import cli
from softslip.config.scenario import load_scenario

pytestmark = pytest.mark.workflow

DOCUMENTS = sorted(
    [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), ROOT / "config" / "README.md"]
)

DEMO = (
    TINY.replace("[0.25]", "[0.1, 0.2, 0.3, 0.4, 0.5]")
    + """\
axes:
  wall.roughness: [0.0]
  rheometer.stress: [0.3]
"""
)
"""What takes the place of the demo: documents name its runs and values."""

PROGRAMS = {
    "softslip": [sys.executable, "-m", "softslip"],
    "snakemake": [sys.executable, "-m", "snakemake"],
    "pytest": [sys.executable, "-m", "pytest"],
    "make": ["make"],
}

WORDS = {
    "NAME": "demo",
    "SCENARIO": "demo",
    "RUN": load_scenario(str(ROOT / "config" / "desk.yaml")).runs()[0].ids["shear"],
    "PATH": str(ROOT),
}
"""What stands for a word of the reader's own."""

WITHOUT_RUNS = re.compile(
    r"^(softslip (?!plan|validate).*)\b(desk|paper_yielding|paper|results/python)\b"
)
"""Commands on results that are not made here: the demo takes their place."""

TOO_SMALL = {"softslip export demo --rheometer": "not steady"}
"""Commands that this demo is too short for, by their beginnings, and how they say so."""

LONG = re.compile(r"snakemake.* (numerics|bench)\b|scenario=(desk|paper)\b")
"""Commands of Snakemake that take more than minutes: the plan is made."""

SOLVED = re.compile(r"softslip validate \w")
"""Commands that solve a flow."""

NAMED = re.compile(r"softslip( \w+( --[a-z-]+)?)?$|softslip (numerics|bench) \w+$")
"""Names of commands, in a text on something else."""


def tokens_of(document: Path) -> Iterator[Token]:
    """Yield all pieces of a document."""
    for block in MarkdownIt().enable("table").parse(document.read_text("utf-8")):
        yield block
        yield from block.children or ()


def commands_of(document: Path) -> Iterator[str]:
    """Yield the commands that a document prints, in its text or in lines of their own."""
    for token in tokens_of(document):
        if token.type in ("code_inline", "code_block", "fence"):
            for line in re.sub(r"\\\n\s*", "", token.content).splitlines():
                command = line.split(" #")[0].strip()
                if re.match(rf"({'|'.join(PROGRAMS)})( |$)", command):
                    yield command


COMMANDS = sorted({command for document in DOCUMENTS for command in commands_of(document)})


def said_by(words: list[str], folder: Path, status: int = 0) -> str:
    """Run a command in a folder, to an exit status, and return what it said."""
    done = subprocess.run(
        [*PROGRAMS[words[0]], *words[1:]],
        cwd=folder,
        capture_output=True,
        text=True,
        env={**os.environ, "COLUMNS": "200"},
    )
    assert done.returncode == status, f"{words}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def is_run(command: str) -> bool:
    """Tell whether a command is run as a fast test."""
    of_results = command.startswith(("softslip", "snakemake"))
    return of_results and not NAMED.match(command) and not SOLVED.match(command)


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the project with all results of a small demo."""
    folder = copy_project(tmp_path_factory.mktemp("documents") / "copy")
    (folder / "config" / "demo.yaml").write_text(DEMO)
    (folder / "docs").mkdir()
    shutil.copy(ROOT / "docs" / "results.md", folder / "docs")
    said_by(["snakemake", "--cores", "2"], folder)
    published = folder / "results" / "published" / "demo"
    published.mkdir(parents=True, exist_ok=True)
    shutil.copy(folder / "results" / "demo" / "flow_curve.nc", published)
    return folder


def put_in(command: str) -> list[str]:
    """Return the words of a command, with one of ours for each of the reader's own."""
    own = re.compile(rf"\b({'|'.join(WORDS)})\b(?!=)")
    command = WITHOUT_RUNS.sub(r"\1demo", command)
    return shlex.split(own.sub(lambda found: WORDS[found[0]], command))


@pytest.mark.parametrize(
    "command", [each for each in COMMANDS if NAMED.match(each) and " " in each]
)
def test_a_command_that_is_named_is_there(command: str) -> None:
    assert command.split()[1] in {name for names in cli.COMMANDS.values() for name in names}


@pytest.mark.parametrize(
    "command", {tuple(put_in(each)): each for each in COMMANDS if is_run(each)}.values()
)
def test_a_command_works_as_it_is_printed(demo: Path, command: str) -> None:
    words = put_in(command)
    if words[0] == "snakemake":
        words[1:1] = ["--dry-run"] if LONG.search(command) else []
    refused = [reason for start, reason in TOO_SMALL.items() if command.startswith(start)]
    said = said_by(words, demo, 1 if refused else 0)
    assert all(reason in said for reason in refused)


def test_python_works_as_the_readme_prints_it(demo: Path) -> None:
    blocks = [each.content for each in tokens_of(ROOT / "README.md") if each.info == "python"]
    # Between bumps, eight particles find no room.
    code = "\n".join(blocks).replace("roughness=0.59", "roughness=0.0")
    assert "ss.shear" in code
    said = subprocess.run(
        [sys.executable, "-c", code],
        cwd=demo,
        capture_output=True,
        text=True,
        env={**os.environ, "MPLBACKEND": "agg"},
        check=False,
    )
    assert said.returncode == 0, said.stderr


@pytest.mark.parametrize(
    "command", [each for each in COMMANDS if each.startswith(("make", "pytest"))]
)
def test_what_is_printed_for_the_project_itself_is_there(command: str) -> None:
    words = put_in(command)
    said_by([*words, "--dry-run" if words[0] == "make" else "--collect-only"], ROOT)


@pytest.mark.slow
@pytest.mark.parametrize("command", [each for each in COMMANDS if SOLVED.match(each)])
def test_what_is_solved_works_as_it_is_printed(demo: Path, command: str) -> None:
    said_by(put_in(command), demo)


def anchors_of(document: Path) -> set[str]:
    """Return the anchors of a document's headings, as GitHub makes them."""
    pieces = list(tokens_of(document))
    headings = [pieces[k + 1] for k, piece in enumerate(pieces) if piece.type == "heading_open"]
    return {
        re.sub(r"[^\w\- ]", "", heading.content.lower()).replace(" ", "-") for heading in headings
    }


def links_of(document: Path) -> Iterator[str]:
    """Yield where a document's links and pictures lead to."""
    for token in tokens_of(document):
        if token.type in ("link_open", "image"):
            yield str(token.attrs["href" if token.type == "link_open" else "src"])
        elif token.type in ("html_block", "html_inline"):
            yield from re.findall(r'(?:src|href)="([^"]+)"', token.content)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda each: each.name)
def test_every_link_leads_somewhere(document: Path) -> None:
    for link in links_of(document):
        if "://" in link:
            continue
        path, _, anchor = link.partition("#")
        target = document.parent / path if path else document
        assert target.exists(), f"{document.name}: {link} leads nowhere"
        if anchor:
            assert anchor in anchors_of(target), f"{document.name}: {link} names no heading"
