import os
import re
from pathlib import Path

import pytest
from projects import ROOT
from ruamel.yaml import YAML

import softslip
from softslip.errors import ConfigError, StorageError
from softslip.operations import project_folder
from softslip.operations.project_folder import (
    ENVIRONMENT,
    MANUAL,
    PARTS,
    project_files,
    write_project,
)


def content(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_the_files_are_those_of_the_checkout_but_for_the_environment(tmp_path: Path) -> None:
    count = write_project(tmp_path / "mine")
    written = content(tmp_path / "mine")
    assert count == len(written)
    assert {name.partition("/")[0] for name in written} == set(PARTS)
    del written[ENVIRONMENT], written[MANUAL]
    assert written == {name: (ROOT / name).read_bytes() for name in written}
    for name in ("workflow/Snakefile", "config/demo.yaml", "profiles/default/config.yaml"):
        assert name in written


def test_what_can_be_run_can_be_run_from_there(tmp_path: Path) -> None:
    write_project(tmp_path / "mine")
    files = [path for path in (tmp_path / "mine").rglob("*") if path.is_file()]
    scripts = [path.name for path in files if path.stat().st_mode & 0o111]
    assert scripts == ["sacct"]


def test_the_environment_of_the_rules_is_this_release_alone(tmp_path: Path) -> None:
    environment = YAML(typ="safe", pure=True).load(project_files()[ENVIRONMENT])
    asked = YAML(typ="safe", pure=True).load((ROOT / ENVIRONMENT).read_bytes())
    *own, pip = environment["dependencies"]
    assert own == asked["dependencies"][:-1]
    assert pip == {"pip": [f"softslip=={softslip.__version__}"]}


def test_no_link_leads_out_of_the_folder() -> None:
    files = project_files()
    before, after = (ROOT / MANUAL).read_text("utf-8"), files[MANUAL].decode()
    assert "](../docs/accuracy.md)" in before
    assert "docs/accuracy.md of the repository" in after
    links = [link for name in files for link in re.findall(r"\]\(([^)#]+)", files[name].decode())]
    assert not [link for link in links if not link.startswith("http")]
    assert len(after.splitlines()) == len(before.splitlines())


def test_an_interrupted_call_is_completed_and_a_second_one_changes_nothing(tmp_path: Path) -> None:
    write_project(tmp_path)
    whole = content(tmp_path)
    (tmp_path / "mine.txt").write_text("stays")
    (tmp_path / "workflow" / "Snakefile").unlink()
    before = os.stat(tmp_path / "config" / "demo.yaml").st_mtime_ns
    write_project(tmp_path)
    assert content(tmp_path) == whole | {"mine.txt": b"stays"}
    assert os.stat(tmp_path / "config" / "demo.yaml").st_mtime_ns == before


def test_a_file_that_was_edited_is_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "config").mkdir()
    (tmp_path / "config" / "demo.yaml").write_text("mine")
    before = content(tmp_path)
    with pytest.raises(ConfigError, match=r"other files of these names: config/demo.yaml; move"):
        write_project(tmp_path)
    assert content(tmp_path) == before


@pytest.mark.parametrize("place", ["file", "file/below", "link", "a\nb"])
def test_what_is_no_folder_is_refused(tmp_path: Path, place: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "link").symlink_to("nowhere")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(ConfigError, match="give one such as my_suspension"):
        write_project(tmp_path / place)
    assert sorted(tmp_path.rglob("*")) == before


def test_an_installation_without_the_files_says_what_it_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(project_folder, "ROOT", tmp_path)
    with pytest.raises(
        StorageError, match=r"has no Snakefile, .*; install softslip from its wheel"
    ):
        write_project(tmp_path / "mine")
    assert not (tmp_path / "mine").exists()
