"""Settings of the documentation's site, which `make docs` builds with Sphinx."""

import itertools
import re
from pathlib import Path
from typing import Any

import latex2mathml.converter
import typer
from docutils.nodes import SkipNode
from pygments.lexers.special import TextLexer
from typer.cli import get_docs_for_click

from softslip.cli import COMMANDS, command_named

DOCS = Path(__file__).parent
PROJECT = (DOCS.parent / "pyproject.toml").read_text(encoding="utf-8")

project = "softslip"
author = copyright = "the softslip developers"
release = re.search(r'^version = "([^"]+)"', PROJECT, re.MULTILINE)[1]

extensions = ["myst_parser", "autoapi.extension", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "softslip"
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

autoapi_dirs = ["../src/softslip"]
autoapi_root = "reference/api"
autoapi_options = ["members", "show-module-summary"]
autoapi_add_toctree_entry = False
napoleon_google_docstring = False
# Names in single backticks are those of modules and functions, from within the package.
default_role = "literal"
suppress_warnings = [
    # Constants that modules import from each other.
    "autoapi.python_import_resolution",
    # Attributes of the same name in several classes, where a parameter's name is no link anyway.
    "ref.python",
]


INCLUDED = {
    "../config/README.md": "reference/scenarios.md",
    "../ARCHITECTURE.md": "reference/architecture.md",
    "../CONTRIBUTING.md": "reference/contributing.md",
}
"""Documents outside this folder, and the pages that include them."""


def _follow_included(app: Any, page: str, text: list[str]) -> None:
    """Have links to a document outside this folder lead to the page that includes it."""
    for document, target in INCLUDED.items():
        text[0] = text[0].replace(f"]({document}", f"]({target}")


def _write_commands(*_: Any) -> None:
    """Write the page of all commands from the command line itself."""
    parts = ["# Commands\n"]
    for command in (name for names in COMMANDS.values() for name in names):
        found = command_named(command)
        context = typer.Context(found, info_name=command)
        parts.append(get_docs_for_click(obj=found, ctx=context, indent=1, call_prefix="softslip"))
    (DOCS / "reference" / "commands.md").write_text("\n".join(parts), encoding="utf-8")


def _as_restructured_text(
    app: Any, kind: str, name: str, item: Any, options: Any, lines: list[str]
) -> None:
    """Change a docstring, which is plain text, so that Sphinx shows what its reader sees.

    Indented lines are equations and tables, to be kept as they stand; bars are absolute values, and
    a letter in parentheses names a panel.
    """
    found: list[str] = []
    verbatim = False
    for line in lines:
        indented = line.startswith("    ")
        if indented and not verbatim and _ends_in_text(found):
            found += ["::", ""]
            verbatim = True
        verbatim = verbatim and (indented or not line)
        plain = re.sub(r"^\((?=\w\))", r"\(", line.replace("|", r"\|"))
        found.append(line if verbatim else plain)
    lines[:] = found


def _ends_in_text(lines: list[str]) -> bool:
    """Tell whether some lines end in a paragraph of text and a blank line.

    Sections of NumPy's format have an underlined heading and no blank line before what they list.
    """
    if len(lines) < 2 or lines[-1]:
        return False
    paragraph = list(itertools.takewhile(bool, reversed(lines[:-1])))
    return not any(line.startswith(("    ", "--")) for line in paragraph)


def _put_mathml(writer: Any, node: Any) -> None:
    """Write a formula as MathML, which browsers show without a script from elsewhere."""
    display = "block" if node.tagname == "math_block" else "inline"
    writer.body.append(latex2mathml.converter.convert(node.astext(), display=display))
    raise SkipNode


def setup(app: Any) -> None:
    """Have the page of commands written before pages are read, and docstrings before Napoleon."""
    app.connect("builder-inited", _write_commands)
    app.connect("source-read", _follow_included)
    app.connect("autodoc-process-docstring", _as_restructured_text, priority=100)
    app.add_html_math_renderer("mathml", (_put_mathml, None), (_put_mathml, None))
    app.add_lexer("mermaid", TextLexer)
