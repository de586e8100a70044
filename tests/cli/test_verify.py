"""What people and programs are told of results that are verified."""

import functools
import json
import os
from pathlib import Path
from typing import Any

import pytest
import small_results
from small_results import attribute, edit, edited_json, redigest, results
from typer.testing import CliRunner, Result

import softslip.provenance.verification
from softslip.cli.verify import app

__all__ = ["results"]


@pytest.fixture(autouse=True)
def in_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make products again in this process, which has imported everything."""
    here = functools.partial(softslip.provenance.verification.reexecute, runner=small_results.call)
    monkeypatch.setattr(softslip.provenance.verification, "reexecute", here)


def call(results: Path, *words: str) -> Result:
    every = [small_results.source(results), "--results", str(results), *words]
    return CliRunner().invoke(app, every, catch_exceptions=False)


def told(results: Path, *words: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(call(results, "--json", *words).stdout)
    return found


def rows(text: str) -> list[list[str]]:
    lines = [line for line in text.splitlines() if line.startswith("│")]
    return [[cell.strip() for cell in line.split("│")[1:-1]] for line in lines]


def damage(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def test_sound_results_end_in_one_line_and_status_0(results: Path) -> None:
    result = call(results)
    assert result.exit_code == 0
    assert result.stdout.splitlines() == [
        f"{small_results.count()} files, 0 with problems, 0 missing, 0 not of this scenario, "
        "0 made by other code than there is now"
    ]


def test_sound_files_are_listed_when_asked_for(results: Path) -> None:
    listed = rows(call(results, "--all").stdout)
    assert len(listed) == small_results.count()
    assert {row[1] for row in listed} == {"sound"}
    assert listed[0][0].startswith("packing/")


def test_problems_come_first_and_end_in_status_1(results: Path) -> None:
    path = results / "profiles.nc"
    damage(path)
    result = call(results)
    assert result.exit_code == 1
    (row, *_) = rows(result.stdout)
    assert row[:2] == ["profiles.nc", "problem"]
    assert row[2].startswith("has been altered since it was written")
    assert f"{small_results.count()} files, 1 with problems" in result.stdout
    assert rows(call(results, "--all").stdout)[0][0] == "profiles.nc"


def test_what_is_missing_is_named_and_only_a_problem_when_asked(results: Path) -> None:
    (results / "figures" / "fig8.png").unlink()
    result = call(results)
    assert result.exit_code == 0
    assert "missing: figures/fig8.png" in result.stdout
    assert call(results, "--complete").exit_code == 1


def test_many_missing_products_are_counted(results: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(app, [small_results.source(results), "--results", str(tmp_path)])
    assert result.exit_code == 0
    assert f"missing: {small_results.count() - 10} more; --all names them" in result.stdout
    assert f"0 files, 0 with problems, {small_results.count()} missing" in result.stdout


def test_the_report_is_the_same_each_time_but_for_its_times(results: Path, tmp_path: Path) -> None:
    damage(results / "profiles.nc")
    reports = []
    for name in ("first.json", "second.json"):
        result = call(results, "--report", str(tmp_path / name), "--sample", "2", "--seed", "5")
        assert result.exit_code == 1
        reports.append(json.loads((tmp_path / name).read_text()))
        assert set(reports[-1].pop("times")) == {"started", "seconds"}
    assert reports[0] == reports[1]
    found = told(results, "--sample", "2", "--seed", "5")
    found.pop("times")
    assert found == reports[0]
    assert found["verdict"] == "problem"
    assert found["seed"] == 5


def test_the_report_says_all_that_was_found(results: Path) -> None:
    damage(results / "profiles.nc")
    found = told(results)
    assert {"softslip", "environment", "fingerprints"} == set(found["verified_with"])
    files = {each["file"]: each for each in found["files"]}
    assert len(files) == small_results.count()
    bad, good = files["profiles.nc"], files["creep.nc"]
    assert (bad["digests"], bad["verdict"], bad["content_sha256"]) == ("altered", "problem", None)
    assert len(bad["problems"]) == 1
    assert (good["digests"], good["verdict"], good["problems"]) == ("right", "sound", [])
    assert (good["of_this_scenario"], good["by_this_code"]) == (True, True)
    assert good["content_sha256"] == attribute(results / "creep.nc", "content_sha256")
    assert good["made_by"]["commit"]


def test_a_sample_is_announced_with_its_seed_and_time(results: Path) -> None:
    result = call(results, "--sample", "2", "--seed", "11")
    assert result.exit_code == 0
    assert "recomputing 2 results, chosen with --seed 11; estimated" in result.stderr
    listed = rows(result.stdout)
    assert [row[1:3] for row in listed] == [["sound", "equal (whole)"]] * 2
    assert result.stdout.endswith("2 recomputed\n")


def test_a_seed_that_was_not_given_can_be_used_again(results: Path) -> None:
    first = told(results, "--sample", "2")
    second = told(results, "--sample", "2", "--seed", str(first["seed"]))
    assert first["recomputed"] == second["recomputed"]
    assert first["seed"] != told(results, "--sample", "1")["seed"]


def test_a_forged_figure_is_found_out_by_making_it_again(results: Path) -> None:
    path = results / "figures" / "fig8.png"
    small_results.forge_figure(path, {}, lambda pixels: pixels[::-1].copy())
    assert call(results).exit_code == 0
    result = call(results, "--full")
    assert result.exit_code == 1
    (row, *_) = rows(result.stdout)
    assert row[:3] == ["figures/fig8.png", "problem", "differs (whole)"]
    assert "pixels" in row[3]
    assert f"{small_results.count()} recomputed" in result.stdout


def test_the_report_states_quantities_tolerances_and_reasons(results: Path) -> None:
    fits = results / "fits.nc"
    (results / "figures" / "fig5.png").unlink()
    provenance = edited_json(attribute(fits, "provenance"), processor="another one")
    edit(fits, {"provenance": provenance, "summary": "A forged one"})
    redigest(fits)
    found = told(results, "--full")
    (again,) = (each for each in found["recomputed"] if each["file"] == "fits.nc")
    assert (again["verdict"], again["made_differently"]) == ("differs", ["processor"])
    assert again["quantities"][0] == {
        "name": "summary (attribute)",
        "difference": None,
        "tolerance": 0.0,
        "reason": again["quantities"][0]["reason"],
        "fits": False,
    }
    assert all(each["fits"] and each["reason"] for each in again["quantities"][1:])
    assert len(again["quantities"]) > 10


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--sample", "2", "--full"], "sample: 2 is given with --full"),
        (["--stretch"], "stretch: True is given alone"),
        (["--seed", "2"], "seed: 2 is given without --sample"),
        (["--report", "report.txt"], "report: 'report.txt' does not end in .json"),
    ],
)
def test_options_that_contradict_one_another_are_refused(
    results: Path, words: list[str], reason: str
) -> None:
    result = call(results, *words)
    assert result.exit_code == 2
    assert reason in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_a_folder_that_is_not_there_is_refused_in_one_line(results: Path, tmp_path: Path) -> None:
    nowhere = str(tmp_path / "nowhere")
    result = CliRunner().invoke(app, [small_results.source(results), "--results", nowhere])
    assert result.exit_code == 1
    assert result.stderr.startswith(f"DatasetError: {nowhere}: is no folder")


@pytest.mark.parametrize("closed", ["shear", ".", "figures"])
def test_a_folder_that_may_not_be_read_is_a_problem_and_nothing_in_it_is_missing(
    results: Path, monkeypatch: pytest.MonkeyPatch, closed: str
) -> None:
    folder, original = results / closed, os.scandir

    def refusing(path: Any) -> Any:
        if Path(path) == folder:
            raise PermissionError(13, "Permission denied", str(path))
        return original(path)

    monkeypatch.setattr(os, "scandir", refusing)
    result = call(results)
    assert result.exit_code == 1
    assert [closed, "problem"] in [row[:2] for row in rows(result.stdout)]
    assert "cannot be read (Permission denied)" in result.stdout
    assert "1 with problems, 0 missing" in result.stdout.splitlines()[-1]


def test_results_inside_a_folder_of_another_user_are_refused_in_one_line(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refusing(path: Path) -> bool:
        raise PermissionError(13, "Permission denied", str(path))

    with monkeypatch.context() as closed:
        closed.setattr(Path, "is_dir", refusing)
        result = call(results)
    assert result.exit_code == 1
    assert result.stderr == f"DatasetError: {results}: cannot be read (Permission denied)\n"
