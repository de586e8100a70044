"""What something was made from, as boxes in columns with arrows between them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch, PathPatch
from matplotlib.path import Path
from numpy.typing import NDArray

from softslip.analysis.figures.drawing import COLOURS, styled

FloatArray = NDArray[np.float64]

MOST_TALL = 14
"""Most boxes in a column whose text has two lines."""

TITLE, DETAIL, NOTE = 8.0, 6.8, 7.5
"""Sizes of the texts of a box and of that below the figure [point]."""

PITCH = {True: 0.46, False: 0.24}
"""Distance of the boxes of a column from each other, with two lines of text or one [inch]."""

HEIGHT = {True: 0.37, False: 0.19}
"""Height of a box [inch]."""

PAD, GAP, MARGIN, HEAD, LINE = 0.07, 0.5, 0.12, 0.45, 0.15
"""Space beside a box's text, between columns, around all, above, and for a line below [inch]."""

SWEEPS = 4
"""How often boxes are put in the order of their neighbours to have fewer arrows cross."""

TROUBLE = COLOURS[1]
"""Colour of what is missing or not what it was."""


@dataclass(frozen=True)
class DiagramBox:
    """Something that was made, or several alike.

    Attributes
    ----------
    column
        Counted from the left; arrows go to the right.
    title, detail
        Its text, and smaller text below or beside it.
    order
        What boxes of a column are sorted by.
    trouble
        What is wrong with it; empty where nothing is.
    several
        Whether it stands for more than one.
    """

    column: int
    title: str
    detail: str = ""
    order: tuple[Any, ...] = ()
    trouble: str = ""
    several: bool = False


Slot = tuple[int, int]
"""The number of a box and -1, or that of a long arrow and the column that it passes."""


@styled
def lineage(
    boxes: Sequence[DiagramBox],
    arrows: Iterable[tuple[int, int]],
    headings: Sequence[str],
    notes: Sequence[str] = (),
) -> Figure:
    """Draw what was made from what, from left to right.

    Boxes are put in an order in which few arrows cross, and arrows that pass a column have a place
    in it, so that they hide no box. Dashed vermilion boxes are missing or not what they were.

    Parameters
    ----------
    boxes
        At least one; a column is as wide as its longest text.
    arrows
        Numbers of a box and of what was made from it, which stands further to the right.
    headings
        One for each column, of one or more lines.
    notes
        Lines below.
    """
    columns, links = _ordered(boxes, list(arrows))
    tall = [len(column) <= MOST_TALL for column in columns]
    figure = Figure()
    canvas = FigureCanvasAgg(figure)
    widths = [
        max(_width(canvas, boxes, column, two), *(_extent(canvas, line, TITLE) for line in lines))
        for column, two, lines in zip(columns, tall, map(str.splitlines, headings), strict=True)
    ]
    rights = MARGIN + np.cumsum(widths) + GAP * np.arange(len(widths))
    pitches = [PITCH[two] for two in tall]
    heights = _heights(columns, links, pitches)
    low = min(float(at.min()) - pitch / 2 for at, pitch in zip(heights, pitches, strict=True))
    high = max(float(at.max()) + pitch / 2 for at, pitch in zip(heights, pitches, strict=True))
    foot = LINE * len(notes) + MARGIN
    size = (float(rights[-1]) + MARGIN, high - low + HEAD + foot)
    figure.set_size_inches(*size)
    # In inches, so that texts and boxes fit whatever the size.
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, size[0]), ylim=(low - foot, high + HEAD))
    axes.axis("off")
    ends = {
        slot: (float(right - width), float(right), float(height))
        for column, right, width, at in zip(columns, rights, widths, heights, strict=True)
        for slot, height in zip(column, at, strict=True)
    }
    for way in links:
        _draw_arrow(axes, [ends[slot] for slot in way], way)
    for slot, (left, right, height) in ends.items():
        if slot[1] < 0:
            two = tall[boxes[slot[0]].column]
            _draw_box(axes, boxes[slot[0]], left, right, height, two)
    for words, right, width in zip(headings, rights, widths, strict=True):
        place = (float(right - width / 2), high + HEAD - MARGIN)
        axes.text(*place, words, ha="center", va="top", fontsize=TITLE, color="0.25")
    for line, said in enumerate(reversed(notes)):
        axes.text(MARGIN, low - foot + 0.08 + LINE * line, said, fontsize=NOTE, color="0.35")
    return figure


def _ordered(
    boxes: Sequence[DiagramBox], arrows: Sequence[tuple[int, int]]
) -> tuple[list[list[Slot]], list[list[Slot]]]:
    """Return the slots of each column in an order with few crossings, and those of each arrow."""
    last = max(box.column for box in boxes)
    columns: list[list[Slot]] = [[] for _ in range(last + 1)]
    for number in sorted(range(len(boxes)), key=lambda each: (boxes[each].order, each)):
        columns[boxes[number].column].append((number, -1))
    ways: list[list[Slot]] = []
    for number, (start, end) in enumerate(arrows):
        passed = range(boxes[start].column + 1, boxes[end].column)
        between = [(number, column) for column in passed]
        for slot in between:
            columns[slot[1]].append(slot)
        ways.append([(start, -1), *between, (end, -1)])
    links = [pair for way in ways for pair in pairwise(way)]
    best = columns = _swept(columns, links, 0)
    for sweep in range(1, SWEEPS):
        columns = _swept(columns, links, sweep)
        if _crossings(columns, links) < _crossings(best, links):
            best = columns
    return best, ways


def _swept(
    columns: list[list[Slot]], links: list[tuple[Slot, Slot]], sweep: int
) -> list[list[Slot]]:
    """Put each column in the order of its neighbours on the left, in odd sweeps on the right."""
    forward = sweep % 2 == 0
    beside: dict[Slot, list[Slot]] = {}
    for start, end in links:
        here, there = (end, start) if forward else (start, end)
        beside.setdefault(here, []).append(there)
    found = list(columns)
    places: dict[Slot, float] = {}
    for number in range(len(found)) if forward else reversed(range(len(found))):
        count = max(len(found[number]), 1)
        own = {slot: (place + 0.5) / count for place, slot in enumerate(found[number])}
        wanted = {
            slot: float(np.mean([places[each] for each in beside[slot]]))
            if slot in beside
            else own[slot]
            for slot in found[number]
        }
        found[number] = sorted(found[number], key=lambda slot: wanted[slot])
        places |= {slot: (place + 0.5) / count for place, slot in enumerate(found[number])}
    return found


def _crossings(columns: list[list[Slot]], links: list[tuple[Slot, Slot]]) -> int:
    """Count the pairs of arrows that cross between two columns."""
    where = {
        slot: (number, place)
        for number, column in enumerate(columns)
        for place, slot in enumerate(column)
    }
    spans = [(*where[start], where[end][1]) for start, end in links]
    return sum(
        one[0] == other[0] and (one[1] - other[1]) * (one[2] - other[2]) < 0
        for number, one in enumerate(spans)
        for other in spans[:number]
    )


def _heights(
    columns: list[list[Slot]], ways: list[list[Slot]], pitches: list[float]
) -> list[FloatArray]:
    """Return the heights of each column's slots, near those of their neighbours [inch]."""
    beside: dict[Slot, list[Slot]] = {}
    for way in ways:
        for start, end in pairwise(way):
            beside.setdefault(start, []).append(end)
            beside.setdefault(end, []).append(start)
    longest = max(range(len(columns)), key=lambda each: len(columns[each]) * pitches[each])
    placed: dict[Slot, float] = {}
    found: dict[int, FloatArray] = {}
    outwards = [longest, *range(longest + 1, len(columns)), *reversed(range(longest))]
    for number in outwards:
        pitch = pitches[number]
        # Downwards, as the first is on top.
        rows = -pitch * (np.arange(len(columns[number])) - (len(columns[number]) - 1) / 2)
        wanted = [
            float(np.mean(known)) if known else float(row)
            for row, slot in zip(rows, columns[number], strict=True)
            for known in [[placed[each] for each in beside.get(slot, ()) if each in placed]]
        ]
        found[number] = -_apart(-np.array(wanted), pitch)
        placed |= dict(zip(columns[number], found[number].tolist(), strict=True))
    return [found[number] for number in range(len(columns))]


def _apart(wanted: FloatArray, pitch: float) -> FloatArray:
    """Return ascending positions at least a pitch apart, nearest to those wanted (least squares).

    Less a pitch for each place they have only to ascend, so that neighbours that do not are given
    their mean until all do (pool adjacent violators).
    """
    offset = pitch * np.arange(len(wanted))
    pools: list[tuple[float, int]] = []
    for value in wanted - offset:
        pools.append((float(value), 1))
        while len(pools) > 1 and pools[-2][0] > pools[-1][0]:
            (upper, many), (lower, few) = pools.pop(), pools.pop()
            pools.append(((upper * many + lower * few) / (many + few), many + few))
    means, counts = zip(*pools, strict=True)
    return np.asarray(np.repeat(means, counts) + offset, dtype=np.float64)


def _width(
    canvas: FigureCanvasAgg, boxes: Sequence[DiagramBox], column: Sequence[Slot], tall: bool
) -> float:
    """Return the width of a column's boxes [inch]."""
    there = [boxes[slot[0]] for slot in column if slot[1] < 0]
    return max((_texts(canvas, box, tall) for box in there), default=0.0) + 2 * PAD


def _texts(canvas: FigureCanvasAgg, box: DiagramBox, tall: bool) -> float:
    title, detail = _extent(canvas, box.title, TITLE), _extent(canvas, box.detail, DETAIL)
    return max(title, detail) if tall else title + (detail and detail + 2 * PAD)


def _extent(canvas: FigureCanvasAgg, words: str, size: float) -> float:
    """Return the width of a text [inch]."""
    text = canvas.figure.text(0, 0, words, fontsize=size)
    width = text.get_window_extent().width / canvas.figure.dpi
    text.remove()
    return float(width)


def _draw_arrow(
    axes: Axes, ends: Sequence[tuple[float, float, float]], way: Sequence[Slot]
) -> None:
    """Draw an arrow from the right of its first slot through others to the left of its last."""
    points: list[tuple[float, float]] = [(ends[0][1], ends[0][2])]
    codes = [Path.MOVETO]
    for number, (left, right, height) in enumerate(ends[1:], start=1):
        before = points[-1]
        half = 0.5 * (left - before[0])
        points += [(before[0] + half, before[1]), (left - half, height), (left, height)]
        codes += [Path.CURVE4] * 3
        if number < len(way) - 1:
            points.append((right, height))
            codes.append(Path.LINETO)
    look = {"edgecolor": "0.55", "linewidth": 0.6, "zorder": 1}
    axes.add_patch(PathPatch(Path(points, codes), facecolor="none", **look))
    tip = points[-1]
    head = FancyArrowPatch(
        (tip[0] - 0.05, tip[1]), tip, arrowstyle="-|>", mutation_scale=5, shrinkA=0, shrinkB=0
    )
    head.set(facecolor="0.55", edgecolor="0.55", linewidth=0.6, zorder=1)
    axes.add_patch(head)


def _draw_box(
    axes: Axes, box: DiagramBox, left: float, right: float, middle: float, tall: bool
) -> None:
    """Draw a box with its texts, with others behind it where it stands for several."""
    height = HEIGHT[tall]
    edge = TROUBLE if box.trouble else "0.35"
    for shift in (0.05, 0.025, 0.0) if box.several else (0.0,):
        patch = FancyBboxPatch(
            (left + shift, middle - height / 2 + shift),
            right - left,
            height,
            boxstyle="round,pad=0,rounding_size=0.04",
            facecolor="white",
            edgecolor=edge,
            linewidth=0.8,
            linestyle=(0, (3, 2)) if box.trouble else "-",
            zorder=2,
        )
        axes.add_patch(patch)
    lift = 0.085 if tall and box.detail else 0.0
    look: dict[str, Any] = {"va": "center_baseline", "zorder": 3}
    axes.text(left + PAD, middle + lift, box.title, fontsize=TITLE, **look)
    colour = TROUBLE if box.trouble else "0.4"
    if tall:
        axes.text(left + PAD, middle - lift, box.detail, fontsize=DETAIL, color=colour, **look)
    else:
        axes.text(
            right - PAD, middle, box.detail, fontsize=DETAIL, color=colour, ha="right", **look
        )
