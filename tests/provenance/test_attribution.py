import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import xarray as xr

from softslip.files.storage import CONTENT_DIGEST, RECORD_DIGEST, digests
from softslip.provenance import attribution as provenance
from softslip.provenance.attribution import (
    UNKNOWN,
    Job,
    code,
    machine,
    parents_of,
    read_provenance,
)
from softslip.provenance.environment import environment


@pytest.fixture
def parent():
    bare = xr.Dataset({"x": ("t", [1.0, 2.0])}, attrs={"stage": "packing", "run": "a" * 16})
    return bare.assign_attrs(digests(bare))


def test_parents_are_named_with_what_they_held(parent):
    (found,) = parents_of([parent])
    assert found == {
        "stage": "packing",
        "run": "a" * 16,
        CONTENT_DIGEST: parent.attrs[CONTENT_DIGEST],
    }


def test_what_was_done_when_and_where_is_recorded(parent):
    labels = Job().labels(
        [parent], fingerprint="f" * 16, seed=3, threads=2, restarts=4, core_seconds=5.5
    )
    assert json.loads(labels["parents"]) == parents_of([parent])
    found = read_provenance(labels)
    assert found["parent_records"] == [parent.attrs[RECORD_DIGEST]]
    assert (found["fingerprint"], found["seed"], found["threads"]) == ("f" * 16, 3, 2)
    assert (found["restarts"], found["core_seconds"]) == (4, 5.5)
    assert found["started"] <= found["ended"]
    assert found["environment"] == environment()
    assert found["host"] == socket.gethostname()
    assert found["processor"]
    assert set(code()) | set(machine()) <= set(found)


@pytest.mark.parametrize("name", ["OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE", "GLIBC_TUNABLES"])
def test_what_libraries_take_the_processor_for_is_recorded(monkeypatch, name):
    """It changes last digits, so that a rerun without it may differ by them."""
    for each in provenance._TOLD:
        monkeypatch.delenv(each, raising=False)
    plain = provenance._processor()
    monkeypatch.setenv(name, "x=1\n")
    told = provenance._processor()
    assert told.startswith(plain)
    assert f"{name}=" in told
    assert told.isprintable()


def test_no_path_and_no_user_is_recorded():
    words = json.dumps(Job().provenance(fingerprint="f" * 16))
    home = str(Path.home())
    user = os.environ.get("USER", "")
    assert str(provenance.ROOT) not in words
    assert home == "/" or home not in words
    assert len(user) < 5 or user not in words


def test_a_dataset_without_any_has_none():
    assert read_provenance({}) == {}


COMMITTED = """
import json, sys
from pathlib import Path
from softslip.provenance import attribution as provenance
provenance.ROOT = Path(sys.argv[1])
print(json.dumps(dict(provenance.code())))
"""


def committed(folder, said="", **settings):
    """What a process of its own says of the code in a folder."""
    command = [sys.executable, "-c", COMMITTED, str(folder)]
    found = subprocess.run(
        command, env=os.environ | settings, capture_output=True, text=True, check=True
    )
    assert (said in found.stderr) if said else not found.stderr, found.stderr
    return json.loads(found.stdout)


def git(folder, *words):
    who = ("-c", "user.name=x", "-c", "user.email=x@example.org")
    done = subprocess.run(
        ["git", "-C", str(folder), *who, *words], capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def test_the_commit_and_what_differs_from_it(tmp_path):
    (tmp_path / "src").mkdir()
    source = tmp_path / "src" / "code.py"
    source.write_text("one = 1\n")
    assert committed(tmp_path)["commit"] == UNKNOWN
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", "src")
    git(tmp_path, "commit", "-qm", "first")
    found = committed(tmp_path)
    assert found["commit"] == git(tmp_path, "rev-parse", "HEAD")
    assert found["dirty"] is False
    assert found["lock_sha256"] == UNKNOWN
    (tmp_path / "notes.txt").write_text("not code")
    assert committed(tmp_path)["dirty"] is False
    source.write_text("one = 2\n")
    assert committed(tmp_path)["dirty"] is True


@pytest.fixture
def checkouts(tmp_path):
    """Two checkouts with a commit each, the second inside the first."""
    folders = [tmp_path / "outer", tmp_path / "outer" / "inner"]
    for folder in folders:
        folder.mkdir()
        git(folder, "init", "-q")
        (folder / "Snakefile").write_text(f"# {folder.name}\n")
        git(folder, "add", "Snakefile")
        git(folder, "commit", "-qm", folder.name)
    return folders


def test_the_variables_of_a_hook_do_not_lead_to_another_repository(checkouts):
    outer, inner = checkouts
    (inner / "Snakefile").write_text("# changed\n")
    found = committed(
        inner,
        GIT_DIR=str(outer / ".git"),
        GIT_WORK_TREE=str(outer),
        GIT_INDEX_FILE=str(outer / ".git" / "index"),
        GIT_PREFIX="src/",
    )
    assert found["commit"] == git(inner, "rev-parse", "HEAD") != git(outer, "rev-parse", "HEAD")
    assert found["dirty"] is True


def test_a_damaged_checkout_is_not_taken_for_the_one_around_it(checkouts):
    outer, inner = checkouts
    (inner / ".git" / "HEAD").unlink()
    found = committed(inner, said=f"will not name their commit: git takes {outer} for the checkout")
    assert (found["commit"], found["dirty"]) == (UNKNOWN, None)


@pytest.mark.skipif(os.getuid() != 0, reason="only root may give files away")
def test_a_checkout_of_another_user_is_described(checkouts):
    _, inner = checkouts
    commit = git(inner, "rev-parse", "HEAD")
    for path in (inner, *inner.rglob("*")):
        os.chown(path, 4321, 4321)
    found = committed(inner)
    assert (found["commit"], found["dirty"]) == (commit, False)


def test_why_git_does_not_name_the_commit_is_said(checkouts, tmp_path):
    _, inner = checkouts
    refusing = tmp_path / "bin" / "git"
    refusing.parent.mkdir()
    refusing.write_text("#!/bin/sh\necho 'fatal: detected dubious ownership' >&2\nexit 128\n")
    refusing.chmod(0o755)
    path = f"{refusing.parent}:{os.environ['PATH']}"
    found = committed(
        inner, said="warning: results will not name their commit: fatal: detected", PATH=path
    )
    assert (found["commit"], found["dirty"]) == (UNKNOWN, None)
