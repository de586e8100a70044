"""Results are named alike on the command line: by scenario, by folder, or by a file in it."""

import shutil
from pathlib import Path

import lineage_synthetic
import pytest
from chain import SCENARIO
from typer.testing import CliRunner, Result

from softslip.cli import app
from softslip.cli.naming import results_folder

SPELLINGS = ("demo", "results/demo", "results/demo/flow_curve.nc")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("named")
    lineage_synthetic.some(folder / "results" / "demo")
    (folder / "config").mkdir()
    (folder / "config" / "demo.yaml").write_text(SCENARIO)
    return folder


@pytest.fixture(autouse=True)
def inside(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)


def call(*words: object) -> Result:
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert isinstance(result.exception, SystemExit | None), result.exc_info
    return result


@pytest.mark.parametrize("spelling", SPELLINGS)
@pytest.mark.parametrize(
    "command",
    [
        ("status", "--json"),
        ("plan", "--json"),
        ("clean", "--dry-run"),
        ("runs",),
        ("verify", "--all"),
        ("export",),
        ("trace",),
    ],
)
def test_every_spelling_says_the_same(command: tuple[str, ...], spelling: str) -> None:
    name, *options = command
    target = spelling
    expected = call(name, "demo", *options)
    if name in ("export", "trace") and spelling.endswith(".nc"):
        # A file is traced and exported as it is; a scenario by its figure.
        target = "results/demo/figures/fig5.png"
    said = call(name, target, *options)
    assert expected.exit_code in (0, 1)
    assert "Error" not in expected.stderr
    assert (said.exit_code, said.stdout) == (expected.exit_code, expected.stdout)


@pytest.mark.parametrize("words", [("gather", "flow_curve"), ("crate",)])
def test_every_spelling_looks_for_the_same_runs(words: tuple[str, ...], tmp_path: Path) -> None:
    said = [call(*words, name, "--output", tmp_path / "out.nc") for name in SPELLINGS]
    assert len({(each.exit_code, each.output) for each in said}) == 1, said
    assert "is not" not in said[0].output.partition(";")[0]


def test_a_file_is_asked_as_its_folder() -> None:
    folder, file = (call("query", name, "stress > 0.4") for name in SPELLINGS[1:])
    assert folder.exit_code == 0, folder.output
    assert folder.stdout == file.stdout
    assert "runs" in folder.stdout


@pytest.mark.parametrize("spelling", SPELLINGS)
@pytest.mark.parametrize(("words", "name"), [(("fit",), "a.nc"), (("draw", "fig5"), "a.png")])
def test_every_spelling_is_read(
    words: tuple[str, ...], name: str, spelling: str, tmp_path: Path
) -> None:
    both = words[0] == "draw" and spelling.endswith(".nc")
    given = [spelling, "results/demo/fits.nc"] if both else [spelling]
    said = call(*words, *given, "--output", tmp_path / name)
    assert said.exit_code == 0, said.output
    assert (tmp_path / name).exists()


def test_a_renamed_folder_is_of_the_scenario_that_its_tables_name(tmp_path: Path) -> None:
    sent = Path(shutil.copytree("results/demo", tmp_path / "sent"))
    said = call("runs", sent)
    assert said.exit_code == 0, said.output
    assert said.stdout == call("runs", "demo").stdout


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (
            ("verify", "results/none"),
            ("results/none", "nor a folder or file that exists", "results/demo"),
        ),
        (("status", "config"), ("config/config.yaml", "--results config")),
        (("status", "results/demo", "--results", "results/demo"), ("is given with a folder",)),
        (("trace", "config"), ("figures/fig5.png", "flow_curve.nc", "snakemake")),
        (("export", "config"), ("figures/fig5.png", "flow_curve.nc", "snakemake")),
        (("draw", "snapshot", "demo", "--output", "x.png"), ("demo",)),
    ],
)
def test_what_names_no_results_is_refused_in_one_line(
    words: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    refused = call(*words)
    assert refused.exit_code in (1, 2)
    assert (refused.stdout, refused.stderr.count("\n")) == ("", 1), refused.output
    assert all(part in refused.stderr for part in parts), refused.stderr


def test_files_lie_in_their_results_folder() -> None:
    for name in ("", "fits.nc", "figures/fig5.png", "figures", "shear"):
        assert results_folder(Path("results/demo") / name) == Path("results/demo")
