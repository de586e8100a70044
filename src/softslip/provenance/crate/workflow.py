"""The plan in a research object: the workflow, its parameters, its steps and their tools."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from importlib.metadata import PackageNotFoundError, metadata
from typing import Any

import softslip
from softslip.config.fields import all_fields, extra
from softslip.config.parameters import Parameters
from softslip.provenance.attribution import UNKNOWN
from softslip.provenance.crate.contents import Result
from softslip.provenance.crate.graph import LOCK, MAIN, Graph, one_or_all, unless_none, value_id
from softslip.provenance.crate.steps import STEPS

KINDS = {bool: "Boolean", int: "Integer", float: "Float", str: "Text"}
"""What a parameter is, in the words of schema.org."""


def add_workflow(graph: Graph) -> None:
    """Add the workflow itself."""
    (main,) = (each for each in graph.contents.others if each.name == MAIN)
    about = metadata("softslip")
    entity = graph.crate.add_workflow(
        dest_path=main.name,
        main=True,
        lang="snakemake",
        lang_version=graph.engine_version,
        properties={
            "@type": ["File", "SoftwareSourceCode", "ComputationalWorkflow", "HowTo"],
            "name": "softslip",
            "description": f"{about['Summary']}. The files of the workflow are those of when "
            "the crate was put together; each tool says at which commit it ran.",
            "version": softslip.__version__,
            "encodingFormat": "text/plain",
            "contentSize": str(main.size),
            "sha256": main.sha256,
            "creator": graph.entity("#authors", "Organization", name=about["Author"]),
            "license": graph.licence(),
            **_homepage(),
        },
    )
    if any(each.name == LOCK for each in graph.contents.others):
        entity["buildInstructions"] = {"@id": LOCK}


def add_parameters(graph: Graph) -> None:
    """Add the workflow's inputs, its outputs, and the values of the scenario's parameters."""
    inputs = [
        _parameter(graph, "#input/scenario", "scenario", "The scenario's file or name.", "File")
    ]
    for path, values in graph.varied.items():
        field = all_fields(Parameters)[path]
        unit = extra(field, "unit")
        inputs.append(
            _parameter(graph, f"#input/{path}", path, str(field.description), _kind(values[0]))
        )
        for place, value in enumerate(values):
            graph.entity(
                value_id(path, place),
                "PropertyValue",
                name=path,
                value=one_or_all(list(value)) if isinstance(value, tuple) else value,
                exampleOfWork=inputs[-1],
                **({} if unit in (None, "1") else {"unitText": unit}),
            )
    outputs = [
        _parameter(graph, f"#output/{rule}", rule, f"Results of the step {rule}.", "File")
        for rule in graph.rules
        if STEPS[rule].is_output
    ]
    main = graph.crate.mainEntity
    ends = [
        _connection(graph, f"#{rule}/output", f"#output/{rule}")
        for rule in graph.rules
        if STEPS[rule].is_output
    ]
    main["input"] = inputs
    for key, value in (unless_none("output", outputs) | unless_none("connection", ends)).items():
        main[key] = value


def _parameter(graph: Graph, identifier: str, name: str, what: str, kind: str) -> dict[str, str]:
    return graph.entity(
        identifier, "FormalParameter", name=name, description=what, additionalType=kind
    )


def _connection(graph: Graph, source: str, target: str) -> dict[str, str]:
    return graph.entity(
        f"#connection/{source[1:]}/{target[1:]}",
        "ParameterConnection",
        sourceParameter={"@id": source},
        targetParameter={"@id": target},
    )


def add_step(graph: Graph, rule: str) -> None:
    """Add a step of the workflow, with the tools that did it and their parameters."""
    details = STEPS[rule]
    sources = [f"#{before}/output" for before in details.reads if before in graph.rules]
    links = [(source, f"#{rule}/parent") for source in sources]
    inputs = []
    if sources:
        what = f"Results of {' or '.join(details.reads)}."
        inputs.append(_parameter(graph, f"#{rule}/parent", "parent", what, "File"))
    if details.takes_scenario:
        what = "The scenario's file or name."
        inputs.append(_parameter(graph, f"#{rule}/scenario", "scenario", what, "File"))
        links.append(("#input/scenario", f"#{rule}/scenario"))
    output = _parameter(graph, f"#{rule}/output", "output", "Its result.", "File")
    ends = {"output": output} | unless_none("input", inputs)
    mine = [each for each in graph.contents.results if each.rule == rule]
    tools = {add_tool(graph, each, ends)["@id"]: None for each in mine}
    step = graph.entity(
        f"#{rule}",
        "HowToStep",
        name=rule,
        description=f"{details.purpose}.",
        position=str(list(STEPS).index(rule) + 1),
        workExample=one_or_all([{"@id": tool} for tool in tools]),
        **unless_none("connection", [_connection(graph, *link) for link in links]),
    )
    graph.crate.mainEntity.append_to("step", step, compact=True)
    for tool in tools:
        graph.crate.mainEntity.append_to("hasPart", {"@id": tool}, compact=True)


def add_tool(graph: Graph, result: Result, ends: Mapping[str, Any] | None = None) -> dict[str, str]:
    """Add the command that made a result, as its code and software were then."""
    origin = result.product.provenance
    keys = ("commit", "dirty", "fingerprint", "environment")
    details = {key: origin.get(key) for key in keys}
    digest = hashlib.sha256(json.dumps(details).encode()).hexdigest()[:12]
    commit, dirty = str(details["commit"]), "-dirty" if details["dirty"] else ""
    at = f"At commit {commit}{', with changes that are in no commit' if dirty else ''}"
    known = commit not in (UNKNOWN, "None")
    return graph.entity(
        f"#{result.rule}/tool-{digest}",
        "SoftwareApplication",
        name=f"softslip {STEPS[result.rule].command}",
        description=f"{at if known else 'At no known commit'}; the fingerprint of its code is "
        f"{details['fingerprint']}.",
        softwareVersion=f"{commit}{dirty}" if known else str(details["fingerprint"]),
        softwareRequirements=one_or_all(_software(graph, str(details["environment"]))),
        **(ends or {}),
        **_homepage(),
    )


def _software(graph: Graph, environment: str) -> list[dict[str, str]]:
    """Add Python and the libraries that an environment names."""
    found = []
    for named in environment.split(", "):
        name, _, version = named.partition(" ")
        if name == "python":
            release = version.replace(".", "")
            address = f"https://www.python.org/downloads/release/python-{release}/"
            known = {"url": address}
        else:
            address, known = f"pkg:pypi/{name}@{version}", _homepage(name)
        found.append(
            graph.entity(
                address, "SoftwareApplication", name=name, softwareVersion=version, **known
            )
        )
    return found


def add_engine(graph: Graph) -> dict[str, str]:
    """Add Snakemake, and return a reference to it."""
    version = graph.engine_version
    return graph.entity(
        f"pkg:pypi/snakemake{f'@{version}' if version else ''}",
        "SoftwareApplication",
        name="Snakemake",
        url="https://snakemake.readthedocs.io",
        **({"softwareVersion": version} if version else {}),
    )


def _kind(value: Any) -> str:
    return KINDS[type(value[0] if isinstance(value, tuple) else value)]


def _homepage(package: str = "softslip") -> dict[str, str]:
    """Return the address of a software, where its package is here and names one."""
    try:
        details = metadata(package)
    except PackageNotFoundError:
        return {}
    named: Iterable[str] = details.get_all("Project-URL") or ()
    addresses = [each.split(", ", 1)[1] for each in named]
    first = next(iter([*(details.get_all("Home-page") or ()), *addresses]), None)
    return {"url": first} if first else {}
