"""All that a target was made from, and how it hangs together."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Any

from softslip.config.stages import STAGES
from softslip.errors import DatasetError
from softslip.messages import file_text
from softslip.provenance.product_labels import Product
from softslip.provenance.tracing.contributions import Part
from softslip.provenance.tracing.origins import swept_values
from softslip.provenance.tracing.targets import Target, Values


@dataclass(frozen=True)
class Node:
    """Something that the target was made from, or the file of the target itself.

    Attributes
    ----------
    id
        Digest of the content that whoever was made from it states.
    stage, run
        Which it is.
    path
        Where it is, or where the workflow would put it.
    state
        See `provenance.archive.Whereabouts`.
    product
        What its file says, None unless it was found.
    remade
        Whether it was recomputed since, with the same content: its provenance is a later one.
    """

    id: str
    stage: str
    run: str
    path: Path
    state: str
    product: Product | None
    remade: bool

    @property
    def label(self) -> str:
        """What people call it."""
        return f"{self.stage} {self.run}" if self.product is None else self.product.label


@dataclass(frozen=True)
class Group:
    """Nodes of one stage at one distance from the target.

    Attributes
    ----------
    stage
        Their stage.
    nodes
        At least one.
    behind
        Number of the group that was made from this one, the farthest from the target; None for
        that of the target.
    """

    stage: str
    nodes: tuple[Node, ...]
    behind: int | None


@dataclass(frozen=True)
class Trace:
    """All that a target was made from.

    Attributes
    ----------
    target
        What was asked for.
    folder
        Where the results are.
    values
        Its numbers, None where a whole file was asked for.
    parts
        What each run has in these numbers; None where that is not known, or for a file.
    nodes
        The target's file first, then by distance from it.
    edges
        Identities of what was made and of what it was made from.
    problems
        What is missing or does not fit, by the node's identity, in sentences.
    """

    target: Target
    folder: Path
    values: Values | None
    parts: tuple[Part, ...] | None
    nodes: tuple[Node, ...]
    edges: tuple[tuple[str, str], ...]
    problems: tuple[tuple[str, str], ...]

    @property
    def products(self) -> list[Product]:
        """What was found."""
        return [node.product for node in self.nodes if node.product is not None]

    @cached_property
    def swept(self) -> Mapping[str, Mapping[str, Any]]:
        """What sets each node apart from others of its stage, by the node's identity."""
        found = [node for node in self.nodes if node.product is not None]
        coordinates = swept_values(self.products)
        at = {part.run: part.coordinates for part in self.parts or ()}
        lost = {node.id: at.get(node.run, {}) for node in self.nodes if node.stage == STAGES[-1]}
        return lost | {node.id: each for node, each in zip(found, coordinates, strict=True)}

    @cached_property
    def depths(self) -> Mapping[str, int]:
        """Longest way from the target to each node, by the node's identity.

        Raises
        ------
        DatasetError
            When something says that it was made from itself.
        """
        parents: dict[str, list[str]] = {node.id: [] for node in self.nodes}
        for child, parent in self.edges:
            parents[child].append(parent)
        depths = dict.fromkeys(parents, 0)
        try:
            order = list(TopologicalSorter(parents).static_order())
        except CycleError:
            raise DatasetError(
                f"{file_text(self.target)}: goes back to results that say that they were made from "
                "themselves; rerun them"
            ) from None
        for child in reversed(order):
            for parent in parents[child]:
                depths[parent] = max(depths[parent], depths[child] + 1)
        return depths

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """The nodes in groups, by their distance from the target.

        Raises
        ------
        DatasetError
            See `depths`.
        """
        members: dict[tuple[int, str], list[Node]] = {}
        for node in self.nodes:
            members.setdefault((self.depths[node.id], node.stage), []).append(node)
        keys = sorted(members)
        number = {node.id: place for place, key in enumerate(keys) for node in members[key]}
        behind: dict[int, int] = {}
        for child, parent in self.edges:
            behind[number[parent]] = max(behind.get(number[parent], 0), number[child])
        return tuple(
            Group(key[1], tuple(members[key]), behind.get(place)) for place, key in enumerate(keys)
        )
