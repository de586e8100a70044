"""The table of what the elements of a scene cost, in Markdown, from its dataset alone."""

import xarray as xr

from softslip.studies.markdown import LEFT, RIGHT, markdown_table

COLUMNS = (
    "Element",
    "With it",
    "Without it",
    "Core-seconds per time unit",
    "Evaluations per time unit",
    "Nodes",
    "Near pairs",
    "Contact pairs",
    "Saved",
    "Saved per evaluation",
    "Switched off",
)
"""Heads of the table of a scene's elements; figures change from with to without."""

_FIGURES = ("seconds", "evaluations", "nodes", "pairs", "contacts")


def elements_table(dataset: xr.Dataset) -> str:
    """Return what each element of a scene costs, and what is switched off without it.

    Parameters
    ----------
    dataset
        What `studies.bench.as_dataset` made of `studies.bench.bench_elements`.

    Returns
    -------
    str
        One line that says what was measured, and a Markdown table with a row for each element.
    """
    count, duration = int(dataset["particles"]), float(dataset["duration"])
    fidelity = dataset.attrs["fidelity"]
    alignment = [LEFT] * 3 + [RIGHT] * (len(COLUMNS) - 4) + [LEFT]
    rows = []
    for name in dataset["element"].values:
        row = dataset.sel(element=name)
        words = {key: str(row[key].values) for key in ("scene_with", "scene_without")}
        figures = [
            f"{_short(row[f'{key}_with'])} → {_short(row[f'{key}_without'])}" for key in _FIGURES
        ]
        saved = [f"{float(row[key]):.1%}" for key in ("saved_share", "saved_per_evaluation")]
        off = str(row["switched_off"].values)
        rows.append([str(name), *words.values(), *figures, *saved, off])
    measured = f"{count} particles at fidelity {fidelity}, over {duration:g} time units:"
    return f"{measured}\n\n{markdown_table(COLUMNS, rows, alignment)}\n"


def _short(figure: xr.DataArray) -> str:
    """Return a number as a whole one where it counts, and with three digits otherwise."""
    value = float(figure)
    return f"{value:.0f}" if value.is_integer() else f"{value:.3g}"
