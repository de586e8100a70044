"""How values, names and tables are written for people."""

import reprlib
from collections.abc import Iterable, Sequence

from pydantic import BaseModel


class Verbatim(str):
    """Text that an error message shows as it stands, without quotes."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Return the text itself."""
        return str(self)


NOTHING = Verbatim("")
"""What stands for the value in a message about a key that has none."""

_SHORT = reprlib.Repr()
_SHORT.maxlevel = 1
_SHORT.maxlist = _SHORT.maxtuple = _SHORT.maxset = _SHORT.maxdict = 4
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 60
_LONGEST, _LONGEST_NAME = 80, 200
_LONG_INTEGER = 1 << 256


def brief(value: object) -> Verbatim:
    """Return a value as an error message shows it: spelt as in YAML, and never long."""
    if value is None:
        return Verbatim("null")
    if isinstance(value, Verbatim):
        return _cut(printable(value))
    if isinstance(value, bool):
        return Verbatim(str(value).lower())
    if isinstance(value, int) and abs(value) > _LONG_INTEGER:
        # Python refuses to write out integers of thousands of digits.
        return Verbatim(f"an integer of {value.bit_length()} bits")
    if isinstance(value, BaseModel):
        return Verbatim(type(value).__name__)
    return _cut(_SHORT.repr(value))


def _cut(text: str) -> Verbatim:
    return Verbatim(text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}...")


def printable(text: str) -> str:
    """Return a text that a terminal can show: escaped where it is not plain."""
    return text if text.isprintable() else ascii(str(text))  # `Verbatim` would not be escaped.


def file_text(path: object) -> str:
    """Return a file's name as an error message shows it, without the middle of a very long one."""
    text = printable(str(path))
    return text if len(text) <= _LONGEST_NAME else f"{text[:50]}...{text[53 - _LONGEST_NAME :]}"


def key_text(key: object) -> str:
    """Return a key as an error message shows it, whatever it is."""
    return _cut(" ".join(printable(str(key)).split()))


def enumerated(names: Sequence[str], most: int) -> str:
    """Return the first of some names, and how many more there are."""
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")


def table_row(cells: Iterable[str]) -> str:
    """Return a line of a Markdown table; a bar within a cell stays in it."""
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def counted(count: int, noun: str) -> str:
    """Return a number of things, such as "1 run" or "3 runs"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def duration(seconds: float) -> str:
    """Return a time in the unit that suits it."""
    for unit, length in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.0f} s"
