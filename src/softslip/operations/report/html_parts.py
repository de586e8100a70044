"""Parts of pages for a browser: text, tables, symbols, and a whole page in one file."""

import html
import re
from collections.abc import Iterable, Sequence

from markdown_it import MarkdownIt

STYLE = """\
body { font: 15px/1.5 system-ui, sans-serif; color: #1e293b; background: #fff; margin: 1.5rem;
  max-width: 75rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.2rem; margin-top: 2rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13px; margin: 1rem 0; }
th, td { border-bottom: 1px solid #cbd5e1; padding: 0.3rem 0.6rem; text-align: left;
  vertical-align: top; }
th { background: #f1f5f9; }
code { background: #f1f5f9; padding: 0 0.2rem; }
video { max-width: 100%; max-height: 85vh; }
"""

LETTERS = {"sigma": "σ", "beta": "β", "delta": "δ", "Delta": "Δ", "phi": "φ"}
"""Letters that symbols spell out, as TeX does."""

_FORMULA = re.compile(r"\$([^$]+)\$")
_LETTER = re.compile(r"\\([A-Za-z]+) ?")
_INDEX = re.compile(r"([_^])(?:\{([^{}]*)\}|(.))")


def page(title: str, body: str) -> bytes:
    """Return a whole page that loads nothing from anywhere else.

    Parameters
    ----------
    title
        Plain text; also the heading.
    body
        HTML below it.
    """
    head = f'<meta charset="utf-8"><title>{html.escape(title)}</title><style>\n{STYLE}</style>'
    heading = f"<h1>{html.escape(title)}</h1>"
    page = f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>\n{heading}\n{body}\n'
    return f"{page}</body></html>\n".encode()


def paragraph(text: str) -> str:
    """Return plain text as a paragraph."""
    return f"<p>{html.escape(text)}</p>"


def heading(text: str) -> str:
    """Return plain text as the heading of a section."""
    return f"<h2>{html.escape(text)}</h2>"


def item_list(items: Iterable[str]) -> str:
    """Return a list of plain texts."""
    return "<ul>" + "".join(f"<li>{html.escape(item)}</li>" for item in items) + "</ul>"


def html_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of plain texts, in which symbols between dollar signs are set as such.

    Parameters
    ----------
    head
        Of the columns; nothing for a table without.
    rows
        Cells.
    """
    names = "".join(f"<th>{_cell(name)}</th>" for name in head)
    top = f"<thead><tr>{names}</tr></thead>" if head else ""
    body = "".join(f"<tr>{''.join(f'<td>{_cell(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return f'<div class="wide"><table>{top}<tbody>{body}</tbody></table></div>'


def from_markdown(text: str) -> str:
    """Return Markdown with tables as HTML."""
    rendered = str(MarkdownIt("commonmark", {"html": False}).enable("table").render(text))
    return rendered.replace("<table>", '<div class="wide"><table>').replace(
        "</table>", "</table></div>"
    )


def _cell(text: str) -> str:
    return _FORMULA.sub(lambda found: _symbol(found[1]), html.escape(text))


def _symbol(formula: str) -> str:
    """Return a symbol in TeX as HTML.

    Raises
    ------
    KeyError
        When it has a letter that `LETTERS` has not.
    """
    letters = _LETTER.sub(lambda found: LETTERS[found[1]], formula)
    return f"<i>{_INDEX.sub(_index, letters)}</i>"


def _index(found: re.Match[str]) -> str:
    tag = "sub" if found[1] == "_" else "sup"
    return f"<{tag}>{found[2] if found[2] is not None else found[3]}</{tag}>"
