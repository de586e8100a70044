"""Markdown tables, as the documents hold them."""

from collections.abc import Iterable, Sequence

from softslip.messages import table_row

LEFT, RIGHT = "---", "---:"
"""How a column is aligned."""


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
