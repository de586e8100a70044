"""`softslip trace`: from a figure, a dataset or a number back to the runs behind it."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from softslip.cli.common import FAILURE_EXIT, AsJson, Results, check_output, one_line_errors
from softslip.cli.naming import overview_file
from softslip.cli.trace_text import print_trace

if TYPE_CHECKING:
    from softslip.provenance.tracing.ancestry import Node, Trace

app = typer.Typer()

TargetText = Annotated[
    str,
    typer.Argument(
        metavar="TARGET",
        help="A scenario, a folder of results, a figure, a dataset, or a value such as "
        "results/demo/fits.nc:yield_stress[roughness=0].",
    ),
]
Every = Annotated[bool, typer.Option("--all", help="List each run, value and problem.")]
GraphFile = Annotated[
    Path | None,
    typer.Option(help="Draw what was made from what, as .png, .svg or .pdf.", readable=False),
]


@app.command(name="trace")
@one_line_errors
def trace_command(
    target: TargetText,
    results: Results = None,
    as_json: AsJson = False,
    every: Every = False,
    graph: GraphFile = None,
) -> None:
    """Say what a figure, a dataset or a value was made from, back to seeds, commits and hosts."""
    from softslip.provenance.tracing.targets import read_target
    from softslip.provenance.tracing.walk import trace

    if graph is not None:
        _check_graph(graph)
    found = trace(read_target(overview_file(target)), results)
    if as_json:
        print(json.dumps(_as_mapping(found)))
    else:
        print_trace(found, every)
    if graph is not None:
        _draw(found, graph)
    if found.problems:
        raise typer.Exit(FAILURE_EXIT)


def _check_graph(path: Path) -> None:
    """Refuse a file that no figure can be written to.

    Raises
    ------
    ConfigError
        Before anything is read.
    """
    from softslip.files.stamps import STILLS

    check_output(path, "graph", STILLS)


def _draw(found: "Trace", path: Path) -> None:
    """Draw what was made from what, and label the file with what it shows."""
    from softslip.analysis import figures
    from softslip.files.layout import FIGURE
    from softslip.files.storage import CONTENT_DIGEST
    from softslip.provenance.attribution import Job
    from softslip.provenance.fingerprints import fingerprint
    from softslip.provenance.tracing.diagrams import diagram

    job, root = Job(), found.nodes[0]
    drawn = diagram(found)
    figure = figures.lineage(drawn.boxes, drawn.arrows, drawn.headings, drawn.notes)
    labels = {
        "title": "lineage",
        "stage": FIGURE,
        "run": root.run,
        "parameters": {"target": str(found.target)},
        "parents": [{"stage": root.stage, "run": root.run, CONTENT_DIGEST: root.id}],
    }
    origin = job.provenance(fingerprint=fingerprint("draw"))
    record = "" if root.product is None else root.product.record
    figures.save_figure(figure, path, labels, origin | {"parent_records": [record]})


def _as_mapping(found: "Trace") -> dict[str, Any]:
    """Return a trace as JSON has it; what is not known is null."""
    return {
        "target": str(found.target),
        "results": str(found.folder),
        "value": _value_mapping(found),
        "nodes": [_node_mapping(found, node) for node in found.nodes],
        "edges": [{"from": child, "to": parent} for child, parent in found.edges],
        "problems": [{"node": node, "problem": sentence} for node, sentence in found.problems],
    }


def _node_mapping(found: "Trace", node: "Node") -> dict[str, Any]:
    product = node.product
    return {
        "id": node.id,
        "stage": node.stage,
        "run": node.run,
        "path": str(node.path),
        "state": node.state,
        "remade": node.remade,
        "record_sha256": None if product is None else product.record,
        "swept": dict(found.swept.get(node.id, {})),
        "provenance": None if product is None else dict(product.provenance),
    }


def _value_mapping(found: "Trace") -> dict[str, Any] | None:
    """Return the values, and the runs that they were computed from or that were left out."""
    values = found.values
    if values is None:
        return None
    cells = [
        {"coordinates": at, "value": value, "error": error} for at, value, error in values.cells()
    ]
    parts = None
    if found.parts is not None:
        parts = [
            {
                "run": part.run or None,
                "coordinates": dict(part.coordinates),
                "of": part.of or None,
                "left_out": part.left_out or None,
            }
            for part in found.parts
        ]
    single = cells[0] if len(cells) == 1 else {"value": None, "error": None}
    return {
        "path": str(values.product.path),
        "variable": values.variable,
        "long_name": values.meaning,
        "units": values.data.attrs.get("units"),
        "coordinates": values.coordinates,
        "value": single["value"],
        "error": single["error"],
        "cells": cells,
        "runs": parts,
    }
