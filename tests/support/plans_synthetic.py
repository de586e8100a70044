"""Results that were never computed, for plans: datasets that only say where they come from."""

import json
from pathlib import Path

import netCDF4

from softslip.provenance.fingerprints import fingerprint

SECONDS = 100.0
"""Processor time that each dataset says it took."""


def leave(
    results: Path,
    stage: str,
    run: str,
    *,
    code: str | None = None,
    seconds: float = SECONDS,
    content: str | None = None,
    parent: str | None = None,
) -> Path:
    """Leave a dataset with nothing but labels, by the present code unless another is named.

    Where a content is given, it and that of the parent are in place of their digests.
    """
    path = results / stage / f"{run}.nc"
    path.parent.mkdir(parents=True, exist_ok=True)
    words = {"fingerprint": code or fingerprint(stage), "core_seconds": seconds}
    with netCDF4.Dataset(path, "w") as file:
        file.setncatts({"stage": stage, "run": run, "provenance": json.dumps(words)})
        if content is not None:
            file.content_sha256 = content
            file.parents = json.dumps([{"content_sha256": parent}] if parent else [])
    return path
