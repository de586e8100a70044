"""Markdown tables, as the documents hold them."""

from collections.abc import Iterable, Sequence

import numpy as np

from softslip.messages import table_row

LEFT, RIGHT = "---", "---:"
"""How a column is aligned."""

SYMBOLS = {
    "slip_velocity": "V_s",
    "shear_rate_wall": "γ̇_wall",
    "shear_rate_bulk": "γ̇_bulk",
}
"""How quantities are written."""


def markdown_table(
    header: Sequence[str],
    rows: Iterable[Iterable[str]],
    alignment: Sequence[str] | None = None,
) -> str:
    """Return a table with a head, without a newline at its end.

    Parameters
    ----------
    header, rows
        Cells.
    alignment
        `LEFT` or `RIGHT` of each column; all are left by default.
    """
    rule = [LEFT] * len(header) if alignment is None else alignment
    return "\n".join(map(table_row, (header, rule, *rows)))


def percent(value: float) -> str:
    """Return a share in per cent with two digits, or a dash."""
    if not np.isfinite(value):
        return "–"
    return f"{100 * value:.2g} %" if abs(value) < 0.995 else f"{100 * value:.0f} %"
