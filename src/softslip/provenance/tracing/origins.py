"""Where many results come from at once: seeds, commits, hosts, dates and effort, put together."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from softslip.config.fields import all_fields
from softslip.config.parameters import Parameters
from softslip.config.sweep import label_of
from softslip.provenance.attribution import UNKNOWN
from softslip.provenance.product_labels import Product
from softslip.provenance.trees import value_in

_PARAMETERS = all_fields(Parameters)

CHANGED = "*"
"""Mark of a commit whose code had been changed without committing."""

COMMIT_DIGITS = 7
"""Digits of a commit that are shown."""


@dataclass(frozen=True)
class JointProvenance:
    """What the provenance of some results says, each thing once and in order.

    Attributes
    ----------
    count
        Number of results.
    seeds
        Of those that have one.
    commits
        With `CHANGED` after those whose code had been changed.
    hosts, environments, fingerprints
        Machines, versions of software, digests of the code.
    core_seconds, restarts
        Of all together.
    started, ended
        The first beginning and the last end, in UTC as ISO 8601; empty where they were not noted.
    """

    count: int
    seeds: tuple[int, ...]
    commits: tuple[str, ...]
    hosts: tuple[str, ...]
    environments: tuple[str, ...]
    fingerprints: tuple[str, ...]
    core_seconds: float
    restarts: int
    started: str
    ended: str


def joint_provenance(products: Iterable[Product]) -> JointProvenance:
    """Put together where some results come from; a result is given once."""
    known = [product.provenance for product in products]

    def every(key: str) -> tuple[str, ...]:
        return tuple(sorted({str(each.get(key, UNKNOWN)) for each in known}))

    return JointProvenance(
        count=len(known),
        seeds=tuple(sorted({int(each["seed"]) for each in known if "seed" in each})),
        commits=tuple(sorted({_commit(each) for each in known})),
        hosts=every("host"),
        environments=every("environment"),
        fingerprints=every("fingerprint"),
        core_seconds=sum(float(each.get("core_seconds", 0.0)) for each in known),
        restarts=sum(int(each.get("restarts", 0)) for each in known),
        started=min((str(each["started"]) for each in known if "started" in each), default=""),
        ended=max((str(each["ended"]) for each in known if "ended" in each), default=""),
    )


def _commit(provenance: Mapping[str, Any]) -> str:
    commit = str(provenance.get("commit", UNKNOWN))
    short = commit if commit == UNKNOWN else commit[:COMMIT_DIGITS]
    return short + CHANGED * bool(provenance.get("dirty"))


def swept_values(products: Sequence[Product]) -> list[dict[str, Any]]:
    """Return what sets each of some runs of a scenario apart, under the names of the dimensions.

    These are the swept parameters where a dataset among them lists its scenario's axes, and
    otherwise those in which the runs of a stage differ. A stage has only those that it depends on.
    """
    axes = list(dict.fromkeys(path for each in products for path in _axes(each)))
    varying = {} if axes else _varying(products)
    named = {*axes, *(path for paths in varying.values() for path in paths)}
    # Results of an earlier release may have parameters that are not known any more.
    labels = {path: path.rpartition(".")[2] for path in named - _PARAMETERS.keys()}
    labels |= {path: label_of(path) for path in named & _PARAMETERS.keys()}
    return [
        {
            labels[path]: found
            for path in (axes or varying[product.stage])
            if (found := _value(product.parameters, path)) is not None
        }
        for product in products
    ]


def _axes(product: Product) -> list[str]:
    axes = product.parameters.get("axes")
    return list(axes) if isinstance(axes, dict) else []


def _varying(products: Sequence[Product]) -> dict[str, list[str]]:
    """Return the paths of the parameters in which the results of each stage differ."""
    values: dict[str, dict[str, set[str]]] = {}
    for product in products:
        seen = values.setdefault(product.stage, {})
        for path in _PARAMETERS:
            seen.setdefault(path, set()).add(repr(_value(product.parameters, path)))
    return {
        stage: [path for path, found in seen.items() if len(found) > 1]
        for stage, seen in values.items()
    }


def _value(tree: Mapping[str, Any], path: str) -> Any:
    """Return the number or word at a path, None where there is none."""
    value = value_in(tree, path)
    return value if isinstance(value, int | float | str) else None
