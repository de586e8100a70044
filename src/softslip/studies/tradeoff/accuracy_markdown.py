"""The trade-off dataset as tables for people."""

from collections.abc import Iterator
from itertools import product

import numpy as np
import xarray as xr

from softslip.config.fidelity import LEVELS
from softslip.studies.markdown import SYMBOLS, markdown_table, percent
from softslip.studies.tradeoff.choices import choices, doubts

WANTED = (0.3, 0.2, 0.1, 0.05, 0.03, 0.02, 0.01, 0.005)
"""Errors for which the settings to choose are listed."""


def accuracy_tables(tradeoff: xr.Dataset) -> str:
    """Return the tables of errors and costs in Markdown, from the dataset alone.

    Parameters
    ----------
    tradeoff
        Of `studies.tradeoff.table.gather`.
    """
    parts = [_levels(tradeoff), _choices(tradeoff), _variants(tradeoff), _limits(tradeoff)]
    if "steady_mean" in tradeoff:
        parts += [_steady(tradeoff), _run_lengths(tradeoff)]
    return "\n\n".join(part for part in parts if part) + "\n"


def _number(value: float, digits: int = 2) -> str:
    return f"{value:.{digits}g}" if np.isfinite(value) else "–"


def _names(tradeoff: xr.Dataset) -> list[str]:
    return [SYMBOLS[str(name)] for name in tradeoff["quantity"].values]


def _rows_of(tradeoff: xr.Dataset, kind: str) -> list[xr.Dataset]:
    numbers = np.flatnonzero(tradeoff["kind"].values == kind)
    return [tradeoff.isel(member=number) for number in numbers]


def _errors(row: xr.Dataset, name: str = "error") -> list[str]:
    return [percent(float(value)) for value in row[name].values]


def _rank(row: xr.Dataset) -> int:
    """Return the place of a level among all, coarsest first."""
    return list(LEVELS).index(str(row["member"].values).removeprefix("level-"))


def _levels(tradeoff: xr.Dataset) -> str:
    """Return a table of the levels of fidelity, and of the finest members beside them."""
    rows = [
        [
            f"`{str(row['member'].values).removeprefix('level-')}`",
            _number(float(row["regularisation"])),
            _number(float(row["node_spacing"])),
            _number(float(row["tolerance"])),
            *_errors(row),
            percent(float(row["numerical_error"])),
            _number(float(row["cost_ratio"])),
            _number(float(row["cost"])),
        ]
        for row in (*sorted(_rows_of(tradeoff, "level"), key=_rank), *_rows_of(tradeoff, "finest"))
    ]
    header = [
        "settings",
        "ε/dx",
        "Δs/dx",
        "δ/σ_LJ",
        *_names(tradeoff),
        "numerical",
        "cost",
        "core-s",
    ]
    known = ", ".join(
        f"{name} {percent(float(value))}"
        for name, value in zip(_names(tradeoff), doubts(tradeoff), strict=True)
    )
    floor = percent(float(tradeoff["floor"].max()))
    return (
        "### Levels of fidelity\n\n"
        "Errors against the limit of no regularisation, ε → 0; *numerical* is the part that nodes, "
        "steps and scheme have in it, against the finest member of the same ε. Cost is over that "
        "of `standard`, and in core-seconds per time unit.\n\n"
        f"{markdown_table(header, rows)}\n\n"
        f"The limit itself is known to {known}. Trajectories that start a millionth of σ_LJ "
        f"apart differ by {floor} at most."
    )


def _choices(tradeoff: xr.Dataset) -> str:
    """Return a table of the cheapest settings for each wanted error."""
    rows, found = [], choices(tradeoff)
    for wanted in WANTED:
        best = next((row for row in found if row["error"] <= wanted), None)
        if best is None:
            rows.append([percent(wanted), "none measured", "", "", "", ""])
            continue
        hydrodynamics = best["settings"]["hydrodynamics"]
        length = hydrodynamics["regularisation"] or tradeoff.attrs["paper_regularisation"]
        rows.append(
            [
                percent(wanted),
                _number(float(length)),
                _number(hydrodynamics["node_spacing"]),
                _number(best["settings"]["time_stepping"]["tolerance"]),
                percent(best["error"]),
                _number(best["cost"]),
            ]
        )
    header = ["wanted error", "ε/dx", "Δs/dx", "δ/σ_LJ", "its error", "cost"]
    return (
        "### What to choose for a wanted accuracy\n\n"
        "The cheapest settings whose largest error of the three, with the doubt about the limit "
        "added, is at most what is wanted.\n\n" + markdown_table(header, rows)
    )


def _variants(tradeoff: xr.Dataset) -> str:
    """Return a table of what one change to a level does."""
    found = _rows_of(tradeoff, "variant")
    if not found:
        return ""
    rows = [
        [
            str(row["member"].values),
            str(row["effect"].values),
            f"`{row['level'].values}`",
            *_errors(row, "level_error"),
            *_errors(row),
            _number(float(row["area_deviation"])),
            _number(float(row["cost_ratio"])),
            str(row["status"].values).partition(";")[0],
        ]
        for row in found
    ]
    names = _names(tradeoff)
    header = [
        "variant",
        "what is varied",
        "level",
        *(f"change of {name}" for name in names),
        *(f"error of {name}" for name in names),
        "area",
        "cost",
        "status",
    ]
    return (
        "### One thing at a time\n\n"
        "Rms change from the level that is varied, and error against the limit. *area* is the "
        "largest relative change of a particle's area. In `single` the far mesh and its transform "
        "have 24 bits; all else has 53.\n\n" + markdown_table(header, rows)
    )


def _limits(tradeoff: xr.Dataset) -> str:
    """Return a table of the limit ε → 0 in each scene, and how far schemes are from it."""
    paper = float(tradeoff.attrs["paper_regularisation"])
    finest = _rows_of(tradeoff, "finest")
    meshes = [row for row in _rows_of(tradeoff, "variant") if "mesh" in str(row["member"].values)]
    shown = sorted(finest, key=lambda row: float(row["regularisation"])) + meshes
    rows = [[*place, *_limit_row(here, shown)] for place, here in _scenes(tradeoff)]
    labels = [
        f"ε = {float(row['regularisation']):.2g} dx"
        if str(row["kind"].values) == "finest"
        else str(row["member"].values)
        for row in shown
    ]
    header = ["quantity", "β", "σ", "limit ε → 0", "linear to", *labels]
    return (
        "### Without regularisation\n\n"
        "Means over the records that all members have, extrapolated to ε → 0, and how far the "
        "finest member of each ε and the meshes are from that, relative to the largest value at "
        f"the same stress. The paper's mesh of 1/8192 has ε = {paper:.2g} dx. *linear to*: rms "
        "distance of the members from a straight line in ε.\n\n" + markdown_table(header, rows)
    )


def _scenes(tradeoff: xr.Dataset, prefix: str = "") -> Iterator[tuple[list[str], xr.Dataset]]:
    """Yield quantity, roughness and stress as cells, and what the dataset has there."""
    places = (
        tradeoff[name].values for name in ("quantity", f"{prefix}roughness", f"{prefix}stress")
    )
    for quantity, roughness, stress in product(*places):
        at = {"quantity": quantity, f"{prefix}roughness": roughness, f"{prefix}stress": stress}
        yield [SYMBOLS[str(quantity)], f"{roughness:g}", f"{stress:g}"], tradeoff.sel(at)


def _limit_row(here: xr.Dataset, shown: list[xr.Dataset]) -> list[str]:
    limit, scale = float(here["limit"]), float(here["scale"])
    means = (float(here["mean"].sel(member=row["member"])) for row in shown)
    return [
        f"{limit:.4g} ± {_number(float(here['limit_uncertainty']), 1)}",
        percent(float(here["limit_residual"]) / scale),
        *(percent((mean - limit) / scale) for mean in means),
    ]


def _steady(tradeoff: xr.Dataset) -> str:
    """Return a table of steady averages over the regularisation length."""
    lengths = tradeoff["steady_regularisation"].values
    order = np.argsort(lengths)
    rows = [
        [
            *place,
            _with_error(here["steady_limit"], here["steady_limit_error"]),
            _number(float(here["steady_chi_square"])),
            *(
                _with_error(here["steady_mean"][n], here["steady_error"][n])
                + (" *" if here["steady_runs"][n] < here["packings"] else "")
                for n in order
            ),
            _number(float(here["seed_scatter"])),
            *_wide(here),
        ]
        for place, here in _scenes(tradeoff, "steady_")
    ]
    labels = [f"ε = {lengths[number]:.2g} dx" for number in order]
    header = ["quantity", "β", "σ", "limit ε → 0", "χ²", *labels, "between packings"]
    header += [
        f"twice the period, ε = {length:.2g} dx"
        for length in (tradeoff["wide_regularisation"].values if "wide_mean" in tradeoff else ())
    ]
    return (
        "### Steady averages\n\n"
        "Means over the packings with statistical errors, a straight line through them to ε → 0 "
        "(χ² per degree of freedom), and the standard deviation between packings. An asterisk "
        "marks averages of which some run was not steady: their error spans its drift.\n\n"
        + markdown_table(header, rows)
    )


def _wide(here: xr.Dataset) -> list[str]:
    """Return what channels of twice the period have, which all have smooth walls."""
    if "wide_mean" not in here:
        return []
    return [
        _with_error(here["wide_mean"][number], here["wide_error"][number])
        if here["steady_roughness"] == 0
        else "–"
        for number in range(here.sizes["wide_regularisation"])
    ]


def _with_error(value: xr.DataArray, error: xr.DataArray) -> str:
    return f"{_number(float(value), 3)} ± {_number(float(error), 1)}"


def _run_lengths(tradeoff: xr.Dataset) -> str:
    """Return a table of what shorter runs would have given."""
    rows = []
    for place, here in _scenes(tradeoff, "steady_"):
        scale = abs(float(here["steady_mean"].mean()))
        rows.append([*place, *(percent(float(value) / scale) for value in here["run_error"])])
    lengths = [f"{value:.3g}" for value in tradeoff["run_length"].values]
    return (
        "### Shorter runs\n\n"
        "Standard deviation of an average over a shorter time (in time units), relative to the "
        "mean.\n\n" + markdown_table(["quantity", "β", "σ", *lengths], rows)
    )
