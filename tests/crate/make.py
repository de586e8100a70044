"""Make research objects of a small scenario for `make crate-check`: whole, partial, named."""

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.append(str(HERE.parent / "support"))

from projects import copy_project  # noqa: E402

NAMED = ["--agent", "Josiah Carberry", "--orcid", "0000-0002-1825-0097", "--hosts"]
"""The fictitious person that ORCID itself gives as an example."""


def call(project: Path, *words: str) -> None:
    """Call a module of this Python in a copy of the project."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    command = [sys.executable, "-m", *words]
    done = subprocess.run(
        command, cwd=project, env=os.environ | {"PATH": path}, capture_output=True, text=True
    )
    if done.returncode:
        raise SystemExit(f"{' '.join(words)}: status {done.returncode}\n{done.stdout}{done.stderr}")


def main() -> None:
    """Run the scenario in a copy of the project, and pack it in three ways."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where the copy goes, and the research objects")
    parser.add_argument("--cores", default="1", help="for Snakemake")
    options = parser.parse_args()
    folder = options.folder.resolve()
    project = folder / "project"
    # Results stay: Snakemake makes anew what the code of today would make otherwise.
    for name in ("workflow", "config", "profiles"):
        shutil.rmtree(project / name, ignore_errors=True)
    copy_project(project)
    shutil.copy(HERE / "small.yaml", project / "config")
    for path in (*folder.glob("*.zip"), folder / "named"):
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    call(project, "snakemake", "--cores", options.cores, "--config", "scenario=small")
    pack = ("softslip", "crate", "small")
    call(project, *pack, "--zip", str(folder / "whole.zip"))
    call(project, *pack, "--output", str(folder / "named"), "--data", "link", *NAMED)
    less = folder / "less"
    shutil.rmtree(less, ignore_errors=True)
    shutil.copytree(project / "results" / "small", less)
    (less / "fits.nc").unlink()
    (less / "figures" / "fig5.png").unlink()
    call(project, *pack, "--results", str(less), "--partial", "--zip", str(folder / "partial.zip"))


if __name__ == "__main__":
    main()
