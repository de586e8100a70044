"""Write the pictures and the list of modules of ARCHITECTURE.md from the code itself.

`make architecture` runs it; a test fails while the page lags behind.
"""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import grimp

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "ARCHITECTURE.md"
PACKAGE = ROOT / "src" / "softslip"

GROUND = ("errors", "messages")
"""Modules below all rooms, which arrows would only hide the others."""


def first_sentence(path: Path) -> str:
    """Return what a module says that it is."""
    text = ast.get_docstring(ast.parse(path.read_text("utf-8"))) or ""
    return " ".join(text.split("\n\n")[0].split()).rstrip(".")


def rooms() -> tuple[str, ...]:
    """Return the packages at the top, in the order of their layers."""
    layers = re.search(r"^layers = \[(.*?)^\]", (ROOT / "pyproject.toml").read_text(), re.M | re.S)
    assert layers, "pyproject.toml states no layers"
    return tuple(
        name for name in re.findall(r"\w+", layers[1]) if (PACKAGE / name / "__init__.py").exists()
    )


def imports(names: tuple[str, ...]) -> Mapping[str, set[str]]:
    """Return which other rooms each room imports."""
    graph = grimp.build_graph("softslip", cache_dir=None)
    found: dict[str, set[str]] = {name: set() for name in names}
    for module in graph.modules:
        for other in graph.find_modules_directly_imported_by(module):
            here, there = (*module.split("."), "")[1], (*other.split("."), "")[1]
            if here in found and there in found and here != there:
                found[here].add(there)
    return found


def reachable(graph: Mapping[str, set[str]], start: str) -> set[str]:
    """Return all rooms that a room imports, directly or through others."""
    found: set[str] = set()
    waiting = {start}
    while waiting:
        waiting |= graph[waiting.pop()] - found
        found |= waiting
    return found


def room_picture() -> Iterator[str]:
    """Yield a Mermaid diagram of the rooms, without the arrows that others imply."""
    graph = imports(rooms())
    yield "```mermaid"
    yield "flowchart TB"
    for name in graph:
        says = re.split(r"[.:] ", first_sentence(PACKAGE / name / "__init__.py"))[0]
        yield f'    {name}["<b>{name}</b><br>{says}"]'
    for name, others in graph.items():
        implied = set().union(*(reachable(graph, other) for other in others))
        yield from (f"    {name} --> {other}" for other in sorted(others - implied))
    yield "```"


def data_picture() -> Iterator[str]:
    """Yield a Mermaid diagram of the rules that results pass through, as Snakemake has it."""
    command = [sys.executable, "-m", "snakemake", "--rulegraph", "mermaid-js"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    names = dict(re.findall(r"(id\d+)\[(\w+)\]", run.stdout))
    yield "```mermaid"
    yield "flowchart LR"
    for start, end in sorted(re.findall(r"(id\d+) --> (id\d+)", run.stdout)):
        if names[end] != "default":
            yield f"    {names[start]} --> {names[end]}"
    yield "```"


def module_list() -> Iterator[str]:
    """Yield a table of every module of each room with what it says that it is."""
    for name in (*rooms(), *GROUND):
        yield f"### `{name}`"
        yield ""
        yield "| Module | What it is |"
        yield "| --- | --- |"
        top = PACKAGE / name
        files = sorted(top.rglob("*.py")) if top.is_dir() else [top.with_suffix(".py")]
        for file in files:
            label = file.relative_to(PACKAGE).with_suffix("").as_posix().removeprefix(f"{name}/")
            label = label.removesuffix("/__init__") if label != "__init__" else name
            yield f"| `{label}` | {first_sentence(file)} |"
        yield ""


BLOCKS = {"rooms": room_picture, "data": data_picture, "modules": module_list}
"""What is written between the marks of the page."""


def written(page: str) -> str:
    """Return the page with its blocks as the code is now."""
    for name, block in BLOCKS.items():
        start, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        before, _, rest = page.partition(start)
        _, _, after = rest.partition(end)
        page = before + start + "\n".join(block()).rstrip() + "\n" + end + after
    return page


if __name__ == "__main__":
    PAGE.write_text(written(PAGE.read_text("utf-8")), "utf-8")
