"""What was done, in a research object: the making of each result, and the run of the workflow."""

from typing import Any

from softslip.config.fields import value_at
from softslip.config.stages import STAGES, stage_paths
from softslip.messages import counted
from softslip.provenance.crate.contents import Result
from softslip.provenance.crate.graph import (
    MAIN,
    Graph,
    action_id,
    one_or_all,
    time_of,
    unless_none,
    value_id,
)
from softslip.provenance.crate.steps import STEPS
from softslip.provenance.crate.workflow import add_engine, add_tool

RUN = "#workflow-run"
DONE, FAILED = "http://schema.org/CompletedActionStatus", "http://schema.org/FailedActionStatus"
SECOND = "https://qudt.org/vocab/unit/SEC"


def add_result(graph: Graph, result: Result) -> None:
    """Add a result, what made it, and what Snakemake noted of that."""
    graph.file(
        result.file,
        name=result.product.label,
        description=f"{result.product.title}, run {result.product.run}",
        dateCreated=time_of(result, "ended"),
        identifier=graph.entity(
            f"#content_sha256/{result.product.content}",
            "PropertyValue",
            name="content digest",
            propertyID="content_sha256",
            value=result.product.content,
            description="SHA-256 of all that a rerun repeats, see "
            "softslip.files.storage.digests and softslip.files.stamps.content_digest.",
        ),
        exampleOfWork=one_or_all(_examples(graph, result)),
    )
    action = _add_action(graph, result)
    if result.benchmark:
        graph.file(result.benchmark, name=f"benchmark of {result.product.label}", about=action)


def _examples(graph: Graph, result: Result) -> list[dict[str, str]]:
    """Return the parameters that a result was a value of."""
    names = [f"#{result.rule}/output"]
    if STEPS[result.rule].is_output:
        names.append(f"#output/{result.rule}")
    names += [f"#{rule}/parent" for rule in graph.readers.get(result.file.name, [])]
    return [{"@id": name} for name in names]


def _add_action(graph: Graph, result: Result) -> dict[str, str]:
    identifier = action_id(result)
    spent = result.product.provenance.get("core_seconds")
    usage = {}
    if spent is not None:
        usage["resourceUsage"] = graph.entity(
            f"{identifier}/core-seconds",
            "PropertyValue",
            name="core_seconds",
            description="Earlier attempts, from whose checkpoints it resumed, count too.",
            propertyID=graph.entity(
                "#core_seconds",
                "DefinedTerm",
                name="core_seconds",
                description="Processor time that a job took, on all cores together.",
            ),
            unitCode=SECOND,
            value=str(spent),
        )
    read = [{"@id": each.file.name} for each in graph.contents.parents(result)]
    if STEPS[result.rule].takes_scenario:
        read.append({"@id": graph.contents.scenario_file.name})
    read += _varied_values(graph, result)
    return graph.entity(
        identifier,
        "CreateAction",
        name=f"Making of {result.product.label}",
        description=_circumstances(graph, result),
        instrument=add_tool(graph, result),
        **unless_none("object", read),
        result={"@id": result.file.name},
        startTime=time_of(result, "started"),
        endTime=time_of(result, "ended"),
        actionStatus=DONE,
        **graph.by_agent(),
        **usage,
    )


def _circumstances(graph: Graph, result: Result) -> str:
    """Return the settings of a job and the machine that it was done on."""
    origin = result.product.provenance
    parts = [
        f"softslip {STEPS[result.rule].command}",
        _counted(origin.get("threads"), "thread"),
        _counted(origin.get("restarts"), "restart"),
        f"seed {origin['seed']}" if "seed" in origin else "",
        str(origin.get("processor", "")),
        _counted(origin.get("cores"), "core"),
        str(origin.get("system", "")),
        f"host {origin['host']}" if graph.credits.hosts and "host" in origin else "",
    ]
    return ", ".join(filter(None, parts))


def _varied_values(graph: Graph, result: Result) -> list[dict[str, str]]:
    """Return the values of a run's parameters that are not the same in all runs."""
    if result.rule not in STAGES:
        return []
    row = graph.runs[result.rule][result.product.run]
    depends = set(stage_paths(result.rule))
    found = []
    for path, values in graph.varied.items():
        value = value_at(row.parameters, path)
        if path in depends and len(values) > 1 and value in values:
            found.append({"@id": value_id(path, values.index(value))})
    return found


def add_run(graph: Graph) -> None:
    """Add the run of the workflow, and what is known of the engine's part in it."""
    results = graph.contents.results
    values = [
        {"@id": value_id(path, place)}
        for path, values in graph.varied.items()
        for place in range(len(values))
    ]
    settings = [
        {"@id": each.name} for each in graph.contents.others if each.name.startswith("profiles/")
    ]
    made = [{"@id": each.file.name} for each in results if STEPS[each.rule].is_output]
    gaps = graph.contents.gaps
    run = graph.entity(
        RUN,
        "CreateAction",
        name=f"Run of the workflow for the scenario {graph.contents.scenario.name}",
        description="From the start of the first job to the end of the last, in one call of "
        "the workflow or in several.",
        instrument={"@id": MAIN},
        object=[{"@id": graph.contents.scenario_file.name}, *values, *settings],
        **unless_none("result", made),
        startTime=min(time_of(each, "started") for each in results),
        endTime=max(time_of(each, "ended") for each in results),
        **({"actionStatus": FAILED, "error": gaps} if gaps else {"actionStatus": DONE}),
        **graph.by_agent(),
    )
    # A job of Snakemake's leaves its benchmark; without one a command was called by hand.
    jobs = [_job(graph, each) for each in results if each.benchmark]
    if jobs:
        graph.entity(
            "#engine-run",
            "OrganizeAction",
            name="Run of Snakemake",
            instrument=add_engine(graph),
            object=one_or_all(jobs),
            result=run,
            **graph.by_agent(),
        )


def _job(graph: Graph, result: Result) -> dict[str, str]:
    action = action_id(result)
    return graph.entity(
        f"{action}/job",
        "ControlAction",
        name=f"Job for {result.product.label}",
        instrument={"@id": f"#{result.rule}"},
        object={"@id": action},
    )


def _counted(count: Any, what: str) -> str:
    return "" if count is None else counted(count, what)
