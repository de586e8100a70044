"""From a figure, a dataset or a number back to all that it was made from."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from softslip.config.stages import STAGES
from softslip.errors import DatasetError
from softslip.files.layout import FIGURE
from softslip.files.products import DATASETS, FITS
from softslip.files.stamps import check_figure
from softslip.files.storage import read_dataset
from softslip.messages import file_text
from softslip.provenance.archive import FOUND, REPLACED, Archive
from softslip.provenance.product_labels import Parent, Product, read_product
from softslip.provenance.tracing.ancestry import Node, Trace
from softslip.provenance.tracing.contributions import RUN, Part, cells_of, fitted_parts, miscounted
from softslip.provenance.tracing.targets import Target, Values, find_values

LAST = STAGES[-1]
"""Stage of the runs that tables are gathered from."""


FIGURES_FOLDERS = ("figures", "snapshots")
"""Folders of figures, below one of results."""


def results_folder(path: Path) -> Path:
    """Return the folder of results that a file lies in, its own where there is none.

    It has runs, or figures in a folder of their own, as what is published of results.
    """
    for folder in path.absolute().parents:
        if any((folder / stage).is_dir() for stage in (LAST, STAGES[0])):
            # As it was given, so that what is shown is no longer than needed.
            near = [each for each in path.parents if each.absolute() == folder]
            return near[0] if near else folder
    folder = path.parent
    while folder.name in FIGURES_FOLDERS:
        folder = folder.parent
    return folder


def trace(target: Target, results: Path | None = None) -> Trace:
    """Follow a target back to all that it was made from.

    Of numbers only the runs are followed that they were computed from. Whether files still hold
    what their labels say is looked at only for the target and for the tables that tell which runs
    these are.

    Parameters
    ----------
    target
        A figure, a dataset, or values in a dataset.
    results
        Folder in which to look; that of the target by default.

    Raises
    ------
    ConfigError
        When there are no such values.
    DatasetError
        When the target's file is missing or damaged.
    """
    folder = results or results_folder(target.path)
    values = find_values(target) if target.variable else None
    walk = _Walk(Archive(folder))
    root = walk.begin(read_product(target.path) if values is None else values.product)
    parts = None
    if values is None:
        walk.check(root)
    else:
        parts = walk.parts(values, root)
    walk.follow(root, None if parts is None else {part.run for part in parts if not part.left_out})
    return Trace(
        target=target,
        folder=folder,
        values=values,
        parts=None if parts is None else tuple(parts),
        nodes=tuple(walk.nodes.values()),
        edges=tuple(walk.edges),
        problems=tuple(walk.problems),
    )


@dataclass
class _Walk:
    """A way back through the results in a folder; each file is read once."""

    archive: Archive
    nodes: dict[str, Node] = field(default_factory=dict)
    edges: dict[tuple[str, str], None] = field(default_factory=dict)
    problems: list[tuple[str, str]] = field(default_factory=list)

    def begin(self, product: Product) -> Node:
        """Return the node of the target's file."""
        return self._add(
            Node(product.content, product.stage, product.run, product.path, FOUND, product, False)
        )

    def _add(self, node: Node) -> Node:
        return self.nodes.setdefault(node.id, node)

    def check(self, node: Node) -> None:
        """Note it when the target's file has changed since it was written."""
        try:
            if node.stage == FIGURE:
                check_figure(node.path)
            else:
                read_dataset(node.path, stage=node.stage, run=node.run)
        except DatasetError as error:
            self.problems.append((node.id, str(error)))

    def parts(self, values: Values, root: Node) -> list[Part] | None:
        """Return what each run has in some values, None where that is not known."""
        dataset, variable, places = values.dataset, values.variable, values.places
        if RUN in dataset:
            return cells_of(dataset, variable, places)
        if root.stage != FITS:
            return None
        try:
            curve = self._curve(values.product, root)
            if curve is None:
                return None
            table = read_dataset(curve.path, stage=curve.stage, run=curve.run)
            found = fitted_parts(dataset, table, variable, places)
            wrong = miscounted(dataset, table, variable, places)
        except DatasetError as error:
            self.problems.append((root.id, str(error)))
            return None
        if wrong:
            self.problems.append((root.id, f"{file_text(root.path)}: {wrong}"))
        return found

    def _curve(self, product: Product, root: Node) -> Node | None:
        """Return the flow curve that laws were fitted to, None where it is not there."""
        for parent in product.parents:
            if parent.stage in DATASETS[FITS].parents:
                node = self._node(parent, root)
                return node if node.state == FOUND else None
        return None

    def follow(self, root: Node, runs: set[str] | None) -> None:
        """Go back from a node, of tables only to the runs that are asked for, or to all."""
        waiting, seen = [root], {root.id}
        while waiting:
            following: list[Node] = []
            for child in waiting:
                for parent in _asked(child, runs):
                    node = self._node(parent, child)
                    self.edges[child.id, node.id] = None
                    if node.id not in seen:
                        seen.add(node.id)
                        following.append(node)
            waiting = following
        followed = {node.run for node in self.nodes.values() if node.stage == LAST}
        for run in sorted((runs or set()) - followed):
            sentence = f"{LAST} {run}: is in the table, but not among what it was made from"
            self.problems.append((root.id, f"{sentence}; rerun its gathering"))

    def _node(self, parent: Parent, child: Node) -> Node:
        """Return the node of a parent, which is looked for the first time that it is met."""
        if parent.content in self.nodes:
            return self.nodes[parent.content]
        there = self.archive.locate(parent)
        remade = there.product is not None and parent.record not in ("", there.product.record)
        node = Node(
            parent.content, parent.stage, parent.run, there.path, there.state, there.product, remade
        )
        if there.problem:
            problem = there.problem + f"; rerun {child.label}" * (there.state == REPLACED)
            sentence = f"{child.label} was made from {parent.stage} {parent.run}, but {problem}"
            self.problems.append((node.id, sentence))
        return self._add(node)


def _asked(child: Node, runs: set[str] | None) -> Iterator[Parent]:
    """Yield what a node was made from, of runs that are gathered only those that are asked for."""
    for parent in () if child.product is None else child.product.parents:
        if runs is None or parent.stage != LAST or parent.run in runs:
            yield parent
