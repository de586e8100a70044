"""A trace as boxes and arrows, with runs put together where there are too many to be read."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from softslip.analysis.figures.drawing import named
from softslip.analysis.figures.lineage import DiagramBox
from softslip.config.stages import STAGES
from softslip.provenance.archive import FOUND
from softslip.provenance.tracing.ancestry import Node, Trace
from softslip.provenance.tracing.origins import CHANGED, joint_provenance
from softslip.provenance.tracing.targets import measured
from softslip.provenance.tracing.wording import effort, listed

MOST_BOXES = 60
"""Most boxes of a diagram whose runs are all drawn."""

ID_DIGITS = 8
"""Digits of a run's identity that are shown."""

Kind = tuple[int, str, str]
"""Depth, stage and state: what can be drawn as one."""


@dataclass(frozen=True)
class Diagram:
    """What `analysis.figures.lineage` draws; see there."""

    boxes: list[DiagramBox]
    arrows: list[tuple[int, int]]
    headings: list[str]
    notes: list[str]


def diagram(trace: Trace) -> Diagram:
    """Return a trace as boxes, arrows and words.

    The largest groups of one stage are drawn as one box each, so that there are no more than
    `MOST_BOXES` where that can be.
    """
    bundled = _bundled(trace)
    last = max(trace.depths.values()) + (trace.values is not None)
    drawn: dict[Any, list[Node]] = {}
    key_of: dict[str, Any] = {}
    for node in trace.nodes:
        kind = _kind(trace, node)
        key_of[node.id] = kind if kind in bundled else node.id
        drawn.setdefault(key_of[node.id], []).append(node)
    numbers = {key: number for number, key in enumerate(drawn)}
    boxes = [_box(trace, nodes, last) for nodes in drawn.values()]
    pairs = [(numbers[key_of[parent]], numbers[key_of[child]]) for child, parent in trace.edges]
    arrows = list(dict.fromkeys(pairs))
    if trace.values is not None:
        arrows.append((numbers[key_of[trace.nodes[0].id]], len(boxes)))
        boxes.append(DiagramBox(last, trace.values.name, measured(trace.values)))
    headings = [_heading(trace, last - column) for column in range(last + 1)]
    return Diagram(boxes, arrows, headings, _notes(trace))


def _heading(trace: Trace, behind: int) -> str:
    """Return what is in a column, counted from the right, and its effort."""
    depth = behind - (trace.values is not None)
    nodes = [node for node in trace.nodes if trace.depths[node.id] == depth]
    if not nodes:
        return "value"
    counts = Counter(node.stage for node in nodes)
    counted = [f"{count} × {stage}" if count > 1 else stage for stage, count in counts.items()]
    spent = joint_provenance(
        node.product for node in nodes if node.product is not None
    ).core_seconds
    return f"{', '.join(counted)}\n{effort(spent)}"


def _notes(trace: Trace) -> list[str]:
    """Return where all of it was made."""
    origin = joint_provenance(trace.products)
    dirty = any(commit.endswith(CHANGED) for commit in origin.commits)
    said = [
        _named("commit", origin.commits),
        f"{CHANGED} with uncommitted changes" * dirty,
        _named("host", origin.hosts),
    ]
    days = " to ".join(dict.fromkeys((origin.started[:10], origin.ended[:10])))
    return [str(trace.target), "; ".join(filter(None, [*said, days]))]


def _named(what: str, values: tuple[str, ...]) -> str:
    return f"{what}{'s' * (len(values) > 1)} {listed(values)}" if values else ""


def _kind(trace: Trace, node: Node) -> Kind:
    return trace.depths[node.id], node.stage, node.state


def _bundled(trace: Trace) -> set[Kind]:
    """Return which kinds are drawn as one box, so that there are few enough.

    Kinds of the same number are alike: what is one to one in the results is so in the diagram.
    """
    counts = Counter(_kind(trace, node) for node in trace.nodes)
    for fewest in sorted(set(counts.values()), reverse=True):
        bundled = {kind for kind, count in counts.items() if count > fewest}
        if sum(1 if kind in bundled else count for kind, count in counts.items()) <= MOST_BOXES:
            return bundled
    return set(counts)


def _box(trace: Trace, nodes: list[Node], last: int) -> DiagramBox:
    first, swept = nodes[0], [trace.swept.get(node.id, {}) for node in nodes]
    column = last - trace.depths[first.id] - (trace.values is not None)
    trouble = "" if first.state == FOUND else first.state
    if len(nodes) > 1:
        title, detail = f"{len(nodes)} runs", ", ".join(_ranges(swept))
        order: tuple[Any, ...] = ()
    elif first.stage in STAGES:
        values = [named(label, value) for label, value in swept[0].items()]
        title = ", ".join(values) or first.run[:ID_DIGITS]
        detail = f"{first.run[:ID_DIGITS]}  {_commits(trace, nodes)}"
        order = tuple(swept[0].values())
    else:
        title = first.product.title if first.product and first.product.is_figure else first.stage
        detail, order = f"{first.run}  {_commits(trace, nodes)}", (first.run,)
        if first.product is not None and not first.product.is_figure:
            title = first.path.name
    return DiagramBox(
        column=column,
        title=title,
        detail=(trouble or detail).strip(),
        order=(bool(trouble), *_sortable(order)),
        trouble=trouble,
        several=len(nodes) > 1,
    )


def _sortable(order: Iterable[Any]) -> tuple[Any, ...]:
    """Return values that can be compared, numbers before words."""
    return tuple((isinstance(each, str), each) for each in order)


def _commits(trace: Trace, nodes: list[Node]) -> str:
    """Return what code made some nodes, nothing where the same made all."""
    if len(joint_provenance(trace.products).commits) == 1:
        return ""
    products = [node.product for node in nodes if node.product is not None]
    return ", ".join(joint_provenance(products).commits)


def _ranges(swept: list[Mapping[str, Any]]) -> list[str]:
    """Return the range of each swept value over several runs."""
    labels = dict.fromkeys(label for each in swept for label in each)
    return [
        named(label, listed(each[label] for each in swept if label in each)) for label in labels
    ]
