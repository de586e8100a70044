"""The map of stability and the longest stable steps as Markdown tables, from datasets alone."""

import re

import xarray as xr

from softslip.studies.markdown import LEFT, RIGHT, markdown_table

VERDICTS = ("correct", "stopped", "wrong")
"""What becomes of a cell."""


def wrong_cells(stability: xr.Dataset) -> list[str]:
    """Return the cells of a map that ended without an error, but wrong, each in a line."""
    wrong = stability.isel(cell=stability["verdict"].values == "wrong")
    rows = zip(*(wrong[key].values for key in ("group", "label", "scheme", "message")), strict=True)
    return [f"{group} {label} ({scheme}): {message}" for group, label, scheme, message in rows]


def verdicts_table(stability: xr.Dataset) -> str:
    """Return what became of the cells along each axis of the map.

    Parameters
    ----------
    stability
        Of `studies.stability.gather`.
    """
    verdicts = stability["verdict"].values
    counts = [f"{int((verdicts == each).sum())} {each}" for each in VERDICTS]
    head = ("Axis", "Scheme", "Correct", "Stopped, and how", "Wrong")
    rows = []
    pairs = list(zip(stability["group"].values, stability["scheme"].values, strict=True))
    for group, scheme in dict.fromkeys(pairs):
        part = stability.isel(cell=[pair == (group, scheme) for pair in pairs])
        cells = [_labels(part, each) for each in VERDICTS]
        cells[1] = _stops(part)
        rows.append([str(group).replace("_", " "), str(scheme), *cells])
    return f"{len(verdicts)} cells: {', '.join(counts)}.\n\n{markdown_table(head, rows)}\n"


def _labels(part: xr.Dataset, verdict: str) -> str:
    return ", ".join(map(_plain, part["label"].values[part["verdict"].values == verdict]))


def _plain(label: object) -> str:
    """Return a label that can stand in a list."""
    return str(label).replace(", ", " ")


def _stops(part: xr.Dataset) -> str:
    """Return the stopped cells, those with the same kind and field of error together."""
    stopped = part.isel(cell=part["verdict"].values == "stopped")
    found: dict[str, list[str]] = {}
    for label, message in zip(stopped["label"].values, stopped["message"].values, strict=True):
        found.setdefault(_cause(str(message)), []).append(_plain(label))
    return "; ".join(f"{', '.join(labels)}: {cause}" for cause, labels in found.items())


def _cause(message: str) -> str:
    """Return the kind of an error and the field that it names."""
    kind, _, rest = message.partition(": ")
    field = re.match(r"([\w.]+)(\[\d+\] at step |: )", rest)
    return f"{kind}, `{field[1]}`" if field else kind


def limits_table(limits: xr.Dataset) -> str:
    """Return the longest stable steps of both integrators, measured over theory.

    Parameters
    ----------
    limits
        Of `studies.stability.measure_limits`.
    """
    head = ("Solver", "ε/dx", "Δs/dx", "β", "K_w", "Spectral radius", "Δt of `euler`", "Over 2/ρ")
    rows = []
    for number in range(limits.sizes["setting"]):
        one = limits.isel(setting=number)
        keys = ("regularisation", "node_spacing", "roughness", "stiffness")
        limit, theory = float(one["euler_limit"]), float(one["euler_theory"])
        numbers = [*(float(one[key]) for key in keys), float(one["spectral_radius"]), limit]
        cells = [f"{value:.3g}" for value in numbers]
        rows.append([f"`{one['mobility'].item()}`", *cells, f"{limit / theory:.3f}"])
    euler = markdown_table(head, rows, [LEFT] + [RIGHT] * (len(head) - 1))
    stages = ["Stages of `rkc2`", *(str(int(s)) for s in limits["stages"].values)]
    ratios = (limits["rkc2_limit"] / limits["rkc2_theory"]).values
    longest = ["Longest step over theory", *(f"{ratio:.3f}" for ratio in ratios)]
    rkc2 = markdown_table(stages, [longest], [LEFT] + [RIGHT] * len(ratios))
    return f"{euler}\n\n{rkc2}\n"
