"""Where results come from: parents, code, software, machine, and when and how they were made."""

import hashlib
import json
import os
import platform
import socket
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import psutil
import xarray as xr

from softslip.files.storage import CONTENT_DIGEST, RECORD_DIGEST
from softslip.messages import Verbatim, brief
from softslip.provenance.environment import environment

ROOT = Path(__file__).parents[3]
"""The project's folder, where there is one around the package."""

UNKNOWN = "unknown"

_WATCHED = ("src", "workflow", "config", "Snakefile", "pyproject.toml", "requirements.lock")
"""What counts when it is asked whether the code is that of its commit."""

_TOLD = ("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE", "GLIBC_TUNABLES")
"""Variables that choose how linear algebra and the C library's functions are computed."""

PROVENANCE = (
    "fingerprint",
    "commit",
    "dirty",
    "lock_sha256",
    "environment",
    "host",
    "processor",
    "cores",
    "system",
    "threads",
    "restarts",
    "core_seconds",
    "started",
    "ended",
)
"""What every result says of how it was made, besides the digests of its parents' files."""


def parents_of(datasets: Iterable[xr.Dataset]) -> list[dict[str, str]]:
    """Return what a result was made from, in words that a rerun repeats."""
    keys = ("stage", "run", CONTENT_DIGEST)
    return [{key: str(each.attrs[key]) for key in keys} for each in datasets]


def _process_began() -> datetime:
    return datetime.fromtimestamp(psutil.Process().create_time(), UTC)


@dataclass(frozen=True)
class Job:
    """A command that makes results, for what they say of how they were made.

    Attributes
    ----------
    started
        When it began: by default, when this process did, whose processor time counts.
    """

    started: datetime = field(default_factory=_process_began)

    def labels(
        self, parents: Iterable[xr.Dataset] = (), *, fingerprint: str, **run: Any
    ) -> dict[str, str]:
        """Return the attributes of a dataset that say where it comes from, each as JSON."""
        read = list(parents)
        record = self.provenance(read, fingerprint=fingerprint, **run)
        return {
            "parents": json.dumps(parents_of(read)),
            "provenance": json.dumps(record, sort_keys=True),
        }

    def provenance(
        self,
        parents: Iterable[xr.Dataset] = (),
        *,
        fingerprint: str,
        seed: int | None = None,
        threads: int = 1,
        restarts: int = 0,
        core_seconds: float | None = None,
        **more: Any,
    ) -> dict[str, Any]:
        """Return all that differs between two runs of the same thing.

        Parameters
        ----------
        parents
            What the result was made from.
        fingerprint
            Of the code that made it.
        seed, threads, restarts
            Of the run; a seed of None is that of something without.
        core_seconds
            Processor time, of earlier attempts too; by default that of this process.
        more
            What else is worth noting, by its name.
        """
        spent = time.process_time() if core_seconds is None else core_seconds
        found: dict[str, Any] = {
            "parent_records": [str(each.attrs[RECORD_DIGEST]) for each in parents],
            "fingerprint": fingerprint,
            "started": _stamp(self.started),
            "ended": _stamp(datetime.now(UTC)),
            "core_seconds": round(spent, 3),
            "restarts": restarts,
            "threads": threads,
            **code(),
            **machine(),
            **more,
        }
        return found if seed is None else found | {"seed": seed}


def read_provenance(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the `Job.provenance` among a dataset's attributes, empty where there is none."""
    found: dict[str, Any] = json.loads(str(attributes.get("provenance", "{}")))
    return found


@cache
def code() -> Mapping[str, Any]:
    """Return the commit, whether the code differs from it, the lock's digest and the software."""
    lock = ROOT / "requirements.lock"
    commit, dirty = _commit()
    return {
        "commit": commit,
        "dirty": dirty,
        "lock_sha256": hashlib.sha256(lock.read_bytes()).hexdigest() if lock.exists() else UNKNOWN,
        "environment": environment(),
    }


@cache
def machine() -> Mapping[str, Any]:
    """Return the host, its processor and system; no path and no user's name."""
    return {
        "host": socket.gethostname(),
        "processor": _processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
    }


def _processor() -> str:
    """Return the processor's model, and what libraries were told to take it for.

    Like another processor, that changes the last digits of results.
    """
    told = [f"{name}={brief(Verbatim(os.environ[name]))}" for name in _TOLD if name in os.environ]
    return f"{_model()} ({', '.join(told)})" if told else _model()


def _model() -> str:
    """Return the processor's model, which Python itself does not know on Linux."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor() or UNKNOWN
    models = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(models, platform.machine())


def _commit() -> tuple[str, bool | None]:
    """Return the project's commit and whether the code differs from it.

    Outside a checkout the commit is `UNKNOWN`; where git cannot tell it, a line on standard error
    says why.
    """
    if not (ROOT / ".git").exists():
        return UNKNOWN, None
    try:
        # Of a damaged checkout git would describe the one around it.
        top, commit = _git("rev-parse", "--show-toplevel", "HEAD").splitlines()
        if Path(top).resolve() != ROOT.resolve():
            raise ValueError(f"git takes {top} for the checkout")
        changed = _git("status", "--porcelain", "--untracked-files=no", "--", *_WATCHED)
    except (OSError, ValueError, subprocess.SubprocessError) as error:
        reason = " ".join(str(getattr(error, "stderr", None) or error).split())
        print(f"warning: results will not name their commit: {reason}", file=sys.stderr)
        return UNKNOWN, None
    return commit, bool(changed)


def _git(*arguments: str) -> str:
    """Return what git says of the project's own checkout, whoever owns it, without changing it."""
    # Hooks and rebases set GIT_DIR and others, which would make git look at another repository.
    own = {key: value for key, value in os.environ.items() if not key.startswith("GIT_")}
    settings = ("-c", f"safe.directory={ROOT.resolve()}", "-c", "core.fsmonitor=false")
    command = ["git", "--no-optional-locks", *settings, "-C", str(ROOT), *arguments]
    return subprocess.run(
        command, env=own, capture_output=True, text=True, check=True, timeout=30
    ).stdout.strip()


def _stamp(moment: datetime) -> str:
    return f"{moment:%Y-%m-%dT%H:%M:%S.%fZ}"
