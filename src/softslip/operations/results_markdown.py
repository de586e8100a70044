"""Tables on the results of a scenario in Markdown for a document, from their datasets alone."""

import hashlib
import json
from collections.abc import Mapping

import numpy as np
import xarray as xr
from rich.filesize import decimal

from softslip.analysis.fits.summary import fits_in_words
from softslip.config.scenario import Scenario
from softslip.messages import counted, duration
from softslip.operations.reproduction import OBSERVABLES, is_identical
from softslip.provenance.attribution import read_provenance
from softslip.solver.geometry import FloatArray
from softslip.studies.markdown import LEFT, RIGHT, SYMBOLS, markdown_table

CAUSES: Mapping[str, str] = {
    "error": "the accepted error",
    "film": "a film that closes",
    "motion": "the motion of the nodes",
    "record": "a time to be recorded",
    "longest": "the longest step",
    "stiffness": "stiffness",
}
"""What sets the length of a step, in words."""

HOUR = 3600.0

AGREEING = 0.01
"""Standard errors within which means are the same for anybody who uses them."""


def scope_text(scenario: Scenario, flow_curve: xr.Dataset, effort: xr.Dataset) -> str:
    """Return which runs a scenario asks for, how many are done, and by which code.

    Parameters
    ----------
    scenario
        What was asked for.
    flow_curve
        Of its runs.
    effort
        From `operations.effort`.
    """
    shear = effort.sel(stage="shear")
    planned, done, failed = (int(shear[each]) for each in ("runs", "runs_done", "runs_failed"))
    rows = [
        [f"`{axis.path}`", ", ".join(f"{value}" for value in axis.values)] for axis in scenario.axes
    ]
    record = read_provenance(flow_curve.attrs)
    said = f"{done} of {counted(planned, 'run')} done"
    if failed:
        said += f", {failed} failed"
    made = f"analysed at commit {record['commit'][:7]} on {record['ended'].split('T')[0]}"
    table = markdown_table(["Axis", "Values"], rows)
    return f"Scenario `{scenario.name}`: {said}; {made}.\n\n{table}"


def research_object_text(name: str, metadata: bytes) -> str:
    """Return how many files the research object of a scenario has, how large, and its digest.

    Parameters
    ----------
    name
        Of the scenario.
    metadata
        Its ``ro-crate-metadata.json``.
    """
    entities = json.loads(metadata)["@graph"]
    sizes = [int(each["contentSize"]) for each in entities if "contentSize" in each]
    digest = hashlib.sha256(metadata).hexdigest()
    return (
        f"Its runs and results are one research object of {counted(len(sizes), 'file')}, "
        f"{decimal(sum(sizes))}, which `softslip crate {name} --partial` makes of them. Its "
        f"`ro-crate-metadata.json` names each file with its digest, and has the SHA-256 `{digest}`."
    )


def laws_table(fits: xr.Dataset) -> str:
    """Return every fit as a row: its law, where it was made, parameters with errors, message.

    Parameters
    ----------
    fits
        From `analysis.fits.fit_laws`.
    """
    rows = [
        [fit.law, fit.place, "; ".join(f"`{value}`" for value in fit.values), fit.message]
        for fit in fits_in_words(fits)
    ]
    return markdown_table(["Law", "Where", "Parameters", "Fit"], rows)


def effort_table(effort: xr.Dataset) -> str:
    """Return what each stage took beside its estimate, and what set the length of time steps.

    Parameters
    ----------
    effort
        From `operations.effort`.
    """
    header = [
        "Stage", "Done", "Of", "Core-hours", "Estimated", "Ratio", "Single runs", "Resumed",
        "Ended early", "Failed",
    ]  # fmt: skip
    rows = [_effort_row(effort.sel(stage=stage)) for stage in effort["stage"].values]
    table = markdown_table(header, rows, [LEFT, *[RIGHT] * (len(header) - 1)])
    return f"{table}\n\n{_steps_text(effort.sel(stage='shear'))}"


def _effort_row(stage: xr.Dataset) -> list[str]:
    spent, estimated = float(stage["core_seconds"]), float(stage["estimated_core_seconds"])
    least, largest = float(stage["least_ratio"]), float(stage["largest_ratio"])
    done = int(stage["runs_done"])
    counts = [str(int(stage[name])) for name in ("restarts", "ended_early", "runs_failed")]
    return [
        str(stage["stage"].item()),
        str(done),
        str(int(stage["runs"])),
        f"{spent / HOUR:.2f}",
        f"{estimated / HOUR:.2f}",
        f"{spent / estimated:.2f}" if done else "–",
        f"{least:.2f} to {largest:.2f}" if done else "–",
        *counts,
    ]


def _steps_text(shear: xr.Dataset) -> str:
    """Return how long runs took, and what set the length of their steps."""
    done, steps = int(shear["runs_done"]), int(shear["steps"])
    if not (done and steps):
        return "No run is done."
    mean = duration(float(shear["core_seconds"]) / done)
    shares = sorted(
        (
            (float(shear["steps_set"].sel(cause=cause)) / steps, words)
            for cause, words in CAUSES.items()
        ),
        reverse=True,
    )
    told = ", ".join(f"{words} {share:.0%}" for share, words in shares if share >= 0.005)
    return (
        f"A run took {mean} of one core on average, {steps / done:.0f} steps and "
        f"{int(shear['evaluations']) / done:.0f} evaluations. What set the length of a step: "
        f"{told}."
    )


def reproduction_table(reproduction: xr.Dataset) -> str:
    """Return how runs that were made again compare with the published ones.

    Those that are further off than `AGREEING` have a row each.

    Parameters
    ----------
    reproduction
        From `operations.reproduction`.
    """
    off = np.stack([np.abs(reproduction[f"{name}_difference"].values) for name in OBSERVABLES])
    parted = ~(off <= AGREEING).all(axis=0)
    said = _reproduction_text(reproduction, off, int(parted.sum()))
    if not parted.any():
        return said
    swept = [
        str(name)
        for name, each in reproduction.coords.items()
        if name != "run" and each.dims == ("run",)
    ]
    header = [*swept]
    for name in OBSERVABLES:
        header += [f"{SYMBOLS[name]} published", "again", "difference [standard errors]"]
    rows = [
        _reproduction_row(reproduction.isel(run=place), swept) for place in np.flatnonzero(parted)
    ]
    return f"{said}\n\n{markdown_table(header, rows, [RIGHT] * len(header))}"


def _reproduction_row(run: xr.Dataset, swept: list[str]) -> list[str]:
    cells = [f"{run[name].item():g}" for name in swept]
    for name in OBSERVABLES:
        cells += [f"{float(run[f'{name}_{which}']):.4g}" for which in ("published", "again")]
        off = float(run[f"{name}_difference"])
        cells.append(f"{off:+.2f}" if np.isfinite(off) else "–")
    return cells


def _reproduction_text(reproduction: xr.Dataset, off: FloatArray, parted: int) -> str:
    """Return how many runs were made again, on which processors, and how far off they are."""
    count, same = reproduction.sizes["run"], int(is_identical(reproduction).sum())
    here, there = reproduction.attrs["published_on"], reproduction.attrs["again_on"]
    where = f"both on {here}" if here == there else f"published from {here}, again on {there}"
    known = off[np.isfinite(off)]
    said = (
        f"{counted(count, 'run')} made again, {where}: {same} with the same bits, "
        f"{count - parted} with means that agree to {AGREEING:g} standard errors."
    )
    if parted and len(known):
        rms, most, beyond = np.sqrt(np.mean(known**2)), known.max(), np.mean(known > 2)
        said += (
            f" Over the {len(known)} means of all runs the difference is {rms:.2f} standard errors "
            f"(root mean square), {most:.2f} at most, and more than two in {beyond:.0%}."
        )
    return said
