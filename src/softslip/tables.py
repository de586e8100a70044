"""Tables in Markdown."""

from collections.abc import Iterable


def table_row(cells: Iterable[str]) -> str:
    """Return a line of a Markdown table; a bar within a cell stays in it."""
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
