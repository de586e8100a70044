"""How `softslip trace` says what something was made from: a summary, a tree, and the problems."""

import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.text import Text
from rich.tree import Tree

from softslip.config.stages import STAGES
from softslip.messages import counted, file_text

if TYPE_CHECKING:
    from softslip.provenance.tracing.ancestry import Group, Node, Trace
    from softslip.provenance.tracing.contributions import Part
    from softslip.provenance.tracing.origins import JointProvenance

UNBROKEN = 10_000
"""Width of what is not shown on a terminal: lines that are not broken can be searched."""

MOST_LINES = 8
"""Most problems, and most values, that are listed without --all."""


def print_trace(found: "Trace", every: bool) -> None:
    """Print the summary, the tree and the problems."""
    console = Console(width=None if sys.stdout.isatty() else UNBROKEN, highlight=False)
    for words in (*_subject(found, every), *_summary(found)):
        console.print(Text(words))
    console.print(_tree(found, every))
    if found.problems:
        console.print(Text(f"{counted(len(found.problems), 'problem')}:"))
        for sentence in _first([sentence for _, sentence in found.problems], every):
            console.print(Text(f"- {sentence}"))


def _first(sentences: Sequence[str], every: bool) -> list[str]:
    """Return some sentences, and how many more there are."""
    if every or len(sentences) <= MOST_LINES:
        return list(sentences)
    return [
        *sentences[:MOST_LINES],
        f"and {len(sentences) - MOST_LINES} more; list them with --all",
    ]


def _subject(found: "Trace", every: bool) -> Iterator[str]:
    """Yield what the target is, and its values."""
    from softslip.provenance.tracing.contributions import fit_message
    from softslip.provenance.tracing.targets import measured
    from softslip.provenance.tracing.wording import with_error

    root, values = found.nodes[0], found.values
    if values is None:
        yield f"{root.label}, {file_text(root.path)}"
        return
    yield f"{values.name} = {measured(values)}"
    yield f"{values.meaning}, {file_text(values.product.path)}"
    if message := fit_message(values):
        yield message
    if values.asked != values.product.path:
        yield f"{values.variable} is not in {file_text(values.asked)}, but in what was made from it"
    cells = list(values.cells())
    if every and len(cells) > 1:
        for at, value, error in cells:
            yield f"  {_at(at)}: {with_error(value, error)} {values.units}".rstrip()


def _at(coordinates: Any) -> str:
    from softslip.provenance.tracing.wording import shown

    return ", ".join(f"{name} {shown(value)}" for name, value in coordinates.items())


def _summary(found: "Trace") -> Iterator[str]:
    """Yield how many runs there are behind the target, and where all of it was made."""
    from softslip.provenance.tracing.origins import CHANGED, joint_provenance

    origin = joint_provenance(found.products)
    yield f"from {_sources(found)}{_seeds(origin)}"
    yield from _left_out(found)
    yield "; ".join(_facts(origin))
    if len(origin.environments) == 1:
        yield origin.environments[0]
    else:
        yield f"{len(origin.environments)} different sets of software"
    if any(commit.endswith(CHANGED) for commit in origin.commits):
        yield f"{CHANGED} with uncommitted changes"


def _sources(found: "Trace") -> str:
    """Return how many runs there are, and what of them was used where it is not the same."""
    from softslip.provenance.tracing.walk import LAST

    runs = sum(node.stage == LAST for node in found.nodes)
    known = runs or found.parts is not None
    basis = counted(runs, f"{LAST} run") if known else counted(len(found.nodes) - 1, "file")
    used: dict[str, set[str]] = {}
    for part in found.parts or ():
        if part.of and not part.left_out:
            used.setdefault(part.of, set()).add(part.run)
    if used:
        basis += f" ({', '.join(f'{name} of {len(each)}' for name, each in used.items())})"
    return basis


def _left_out(found: "Trace") -> Iterator[str]:
    """Yield how many runs of a table have not entered, by reason."""
    reasons = Counter((part.of, part.left_out) for part in found.parts or () if part.left_out)
    if reasons:
        parts = [
            f"{count} {name} {why}".replace("  ", " ") for (name, why), count in reasons.items()
        ]
        yield f"left out: {', '.join(parts)}"


def _seeds(origin: "JointProvenance") -> str:
    """Return the seeds, with unbroken rows as ranges."""
    rows: list[list[int]] = []
    for seed in origin.seeds:
        if rows and seed == rows[-1][1] + 1:
            rows[-1][1] = seed
        else:
            rows.append([seed, seed])
    ranges = ", ".join(f"{low}" if low == high else f"{low}-{high}" for low, high in rows)
    return f", {'seeds' if len(origin.seeds) > 1 else 'seed'} {ranges}" if ranges else ""


def _facts(origin: "JointProvenance") -> Iterator[str]:
    """Yield commits, hosts, effort, restarts and dates."""
    from softslip.provenance.tracing.wording import listed

    yield f"{'commits' if len(origin.commits) > 1 else 'commit'} {listed(origin.commits)}"
    yield f"{'hosts' if len(origin.hosts) > 1 else 'host'} {listed(origin.hosts)}"
    yield from _work(origin)


def _work(origin: "JointProvenance") -> Iterator[str]:
    """Yield effort, restarts and dates."""
    from softslip.provenance.tracing.wording import effort

    yield effort(origin.core_seconds)
    if origin.restarts:
        yield counted(origin.restarts, "restart")
    times = [each[:16].replace("T", " ") for each in (origin.started, origin.ended) if each]
    if times:
        yield f"{' to '.join(dict.fromkeys(times))} UTC"


def _own_facts(found: "Trace", nodes: Sequence["Node"]) -> str:
    """Return what is not the same for all: code, effort, and commits and hosts if they differ."""
    from softslip.provenance.tracing.origins import joint_provenance
    from softslip.provenance.tracing.wording import listed

    whole = joint_provenance(found.products)
    own = joint_provenance(node.product for node in nodes if node.product is not None)
    parts = [listed(own.commits)] if len(whole.commits) > 1 else []
    parts += [listed(own.hosts)] if len(whole.hosts) > 1 else []
    return "; ".join([*parts, f"code {listed(own.fingerprints)}", *_work(own)])


def _tree(found: "Trace", every: bool) -> Tree:
    """Return the groups, each behind the one that was made from it."""
    from softslip.provenance.tracing.walk import LAST

    branches: list[Tree] = []
    for group in found.groups:
        words = Text(_headline(found, group))
        branch = Tree(words) if group.behind is None else branches[group.behind].add(words)
        branches.append(branch)
        if every and len(group.nodes) > 1:
            for row in _aligned([_cells(found, node) for node in group.nodes]):
                branch.add(Text(row))
    runs = next((group for group in found.groups if group.stage == LAST), None)
    left = [part for part in found.parts or () if part.left_out]
    if left:
        # Beside the runs that entered, or below the target where none has.
        place = 0 if runs is None or runs.behind is None else runs.behind
        branch = branches[place].add(Text(f"{counted(len(left), 'cell')} left out"))
        for row in _first([_reason(part) for part in left], every):
            branch.add(Text(row))
    return branches[0]


def _reason(part: "Part") -> str:
    """Return where a cell is, which run it is of, and why it was left out."""
    remarks = " ".join(filter(None, (part.of, part.left_out)))
    return "  ".join(filter(None, (_at(part.coordinates), part.run, remarks)))


def _headline(found: "Trace", group: "Group") -> str:
    """Return a group in one line."""
    from softslip.provenance.archive import FOUND
    from softslip.provenance.tracing.wording import listed

    count, first = len(group.nodes), group.nodes[0]
    if count == 1:
        return "  ".join(filter(None, _cells(found, first)))
    swept = [found.swept.get(node.id, {}) for node in group.nodes]
    labels = dict.fromkeys(label for each in swept for label in each)
    parts = [
        f"{label} {listed(each[label] for each in swept if label in each)}" for label in labels
    ]
    states = Counter(node.state for node in group.nodes if node.state != FOUND)
    parts += [f"{number} {state}" for state, number in sorted(states.items())]
    if any(node.product is not None for node in group.nodes):
        parts.append(_own_facts(found, group.nodes))
    return f"{count} {group.stage}{' runs' if group.stage in STAGES else ''}: {'; '.join(parts)}"


def _cells(found: "Trace", node: "Node") -> list[str]:
    """Return what there is to say of one node."""
    swept = _at(found.swept.get(node.id, {}))
    if node.product is None:
        return [node.label, swept, node.state]
    remark = "; recomputed since, with the same content" if node.remade else ""
    return [node.label, swept, f"{_own_facts(found, [node])}{remark}"]


def _aligned(rows: list[list[str]]) -> list[str]:
    """Return rows of cells as lines with columns."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
