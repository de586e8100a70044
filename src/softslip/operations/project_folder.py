"""A folder in which the workflow runs: its rules, scenarios and settings, copied into it."""

import os
import re
from collections.abc import Mapping
from pathlib import Path

import softslip
from softslip.errors import ConfigError, StorageError
from softslip.files.storage import replacing
from softslip.messages import brief, enumerated, file_text
from softslip.provenance.attribution import ROOT

WITHIN_PACKAGE = Path(__file__).parents[1] / "project"
"""Where an installed package has the files; pyproject.toml puts them there."""

PARTS = ("Snakefile", "workflow", "config", "profiles")
"""What the workflow is made of, at the top of a checkout and of what is written."""

ENVIRONMENT = "workflow/envs/softslip.yaml"
"""The environment of the rules, which a checkout installs from its own sources."""

MANUAL = "config/README.md"
"""What is said of scenarios; only a checkout has the documents that it links to."""

_LINK = re.compile(rb"\[([^\]]+)\]\(\.\./[^)]*\)")

SCRIPT = b"#!"
"""What a file begins with that can be run."""

MOST_NAMED = 3
"""Files that an error names."""


def write_project(folder: Path) -> int:
    """Write the workflow, its scenarios and its settings into a folder.

    A file that is there already and is the same stays, so that a call that was interrupted can be
    repeated.

    Parameters
    ----------
    folder
        Made where it is missing; other files in it are left alone.

    Returns
    -------
        How many files the workflow has.

    Raises
    ------
    ConfigError
        When it is not a folder, or has another file of the same name; then nothing is written.
    StorageError
        When this installation has no copies of the files, or one cannot be written.
    """
    _refuse_no_folder(folder)
    files = project_files()
    others = [name for name, content in files.items() if _is_other(folder / name, content)]
    if others:
        raise ConfigError(
            "folder",
            brief(str(folder)),
            f"has other files of these names: {enumerated(others, MOST_NAMED)}",
            "move them away, or give another folder",
        )
    for name, content in files.items():
        if not (folder / name).exists():
            with replacing(folder / name) as temporary:
                temporary.write_bytes(content)
                if content.startswith(SCRIPT):
                    temporary.chmod(temporary.stat().st_mode | 0o111)
    return len(files)


def project_files() -> Mapping[str, bytes]:
    """Return the content of each file by its path in the folder, with slashes.

    They are those of the installed package, or of the checkout that it is imported from. The
    environment of the rules names this release in place of a checkout's sources, and links to
    documents that are not copied are plain text.

    Raises
    ------
    StorageError
        When there are none.
    """
    source = WITHIN_PACKAGE if WITHIN_PACKAGE.is_dir() else ROOT
    missing = [part for part in PARTS if not (source / part).exists()]
    if missing:
        raise StorageError(
            f"{file_text(source)}: has no {', '.join(missing)}; install softslip from its wheel, "
            "or from a clone of its repository"
        )
    inside = (path for part in PARTS for path in sorted((source / part).rglob("*")))
    paths = [path for path in (source / PARTS[0], *inside) if path.is_file()]
    files = {path.relative_to(source).as_posix(): path for path in paths}
    kept = {name: path.read_bytes() for name, path in files.items() if not _is_hidden(name)}
    manual = _LINK.sub(rb"\1 of the repository", kept[MANUAL])
    return kept | {ENVIRONMENT: _of_release(kept[ENVIRONMENT]), MANUAL: manual}


def _of_release(environment: bytes) -> bytes:
    """Return the environment with this release in place of what lies in a checkout."""
    lines = environment.decode().splitlines()
    kept = [line for line in lines if "../.." not in line and not line.startswith("#")]
    return "\n".join([*kept, f"      - softslip=={softslip.__version__}", ""]).encode()


def _is_hidden(name: str) -> bool:
    return any(part.startswith((".", "__")) for part in name.split("/"))


def _is_other(path: Path, content: bytes) -> bool:
    """Whether something is there that is not the file with this content."""
    if not os.path.lexists(path):
        return False
    return not path.is_file() or path.read_bytes() != content


def _refuse_no_folder(folder: Path) -> None:
    places = (folder.absolute(), *folder.absolute().parents)
    inside = next(place for place in places if os.path.lexists(place))
    limits = {
        "is not plain text": not str(folder).isprintable(),
        "is no folder, or lies in something that is none": not inside.is_dir(),
    }
    for limit, broken in limits.items():
        if broken:
            raise ConfigError("folder", brief(str(folder)), limit, "give one such as my_suspension")
