"""The metadata of a research object: who made which file of which, when and with what.

The crate follows RO-Crate 1.1, Workflow RO-Crate 1.0 and, of Workflow Run RO-Crate 0.5, the
profiles Process Run, Workflow Run and Provenance Run: the plan is a workflow with steps, tools and
their parameters, and what was done is an action for the workflow and one for each result.
"""

import html
from collections.abc import Mapping

from rocrate.model.preview import Preview
from rocrate.rocrate import ROCrate

from softslip.provenance.crate.actions import add_result, add_run
from softslip.provenance.crate.contents import Contents, CrateFile, crate_file
from softslip.provenance.crate.graph import LOCK, MAIN, Credits, Graph, one_or_all, time_of
from softslip.provenance.crate.steps import STEPS
from softslip.provenance.crate.workflow import add_parameters, add_step, add_workflow

PROFILES: Mapping[str, tuple[str, str]] = {
    "https://w3id.org/ro/wfrun/process/0.5": ("Process Run Crate", "0.5"),
    "https://w3id.org/ro/wfrun/workflow/0.5": ("Workflow Run Crate", "0.5"),
    "https://w3id.org/ro/wfrun/provenance/0.5": ("Provenance Run Crate", "0.5"),
    "https://w3id.org/workflowhub/workflow-ro-crate/1.0": ("Workflow RO-Crate", "1.0"),
}
"""Profiles that the whole keeps to, and their names and versions."""

METADATA = "ro-crate-metadata.json"
"""File that says what is in a research object."""

LOCK_FORMAT = "https://pip.pypa.io/en/stable/reference/requirements-file-format/"


def files_of(contents: Contents, credits: Credits) -> list[CrateFile]:
    """Return all files of a research object, its metadata and preview first.

    The same contents and credits give the same bytes.
    """
    readme = crate_file("README.md", _readme(contents).encode())
    crate = _described(contents, credits, readme)
    described = b"".join(chunk for _, chunk in crate.metadata.stream())
    results = [part for each in contents.results for part in (each.file, each.benchmark) if part]
    return [
        crate_file(METADATA, described + b"\n"),
        crate_file(Preview.BASENAME, _preview(crate).encode()),
        readme,
        contents.scenario_file,
        *contents.others,
        *results,
    ]


def _readme(contents: Contents) -> str:
    name = contents.scenario.name
    paragraphs = (
        f"# Results of the scenario {name}",
        contents.scenario.description,
        "These results are missing:" if contents.missing else "",
        "\n".join(f"- `{each}`" for each in contents.missing),
        "This is a research object (RO-Crate). `ro-crate-metadata.json` says of each file what it "
        "was made from, when, and with what; `ro-crate-preview.html` lists them all.",
        f"- `results/{name}/`: a dataset for each run and stage, tables, fits and figures. Each of "
        "them says in itself, too, where it comes from, with the name of the machine.\n"
        f"- `config/{name}.yaml`: the scenario; `config/defaults.yaml`: what holds where it is "
        "silent.\n"
        "- `Snakefile`, `workflow/`, `profiles/`: the workflow, as it was when this was put "
        "together.",
        "To rerun it, take softslip at the commit that the metadata name, put the scenario "
        "into its folder `config/`, and",
        f"    make env\n    .venv/bin/snakemake --cores 2 --config scenario={name}",
    )
    return "\n\n".join(filter(None, paragraphs)) + "\n"


def _preview(crate: ROCrate) -> str:
    """Return the library's page about the crate.

    Its template takes text for HTML, and an entity for text.
    """
    root = crate.root_dataset
    kept = {key: root.properties()[key] for key in ("name", "description", "license")}
    for key in kept:
        root[key] = html.escape(root["license"]["name"] if key == "license" else root[key])
    page: str = Preview(crate).generate_html()
    for key, value in kept.items():
        root[key] = value
    return page.rstrip() + "\n"


def _described(contents: Contents, credits: Credits, readme: CrateFile) -> ROCrate:
    """Return the crate with all its entities."""
    graph = Graph(contents, credits)
    graph.crate.add(Preview(graph.crate))
    _describe_root(graph)
    _add_project(graph, readme)
    add_parameters(graph)
    for rule in graph.rules:
        add_step(graph, rule)
    for result in contents.results:
        add_result(graph, result)
    add_run(graph)
    graph.crate.root_dataset["mentions"] = [
        {"@id": each.id}
        for each in graph.crate.contextual_entities
        if str(each.type).endswith("Action")
    ]
    return graph.crate


def _describe_root(graph: Graph) -> None:
    scenario, root = graph.contents.scenario, graph.crate.root_dataset
    sentences = (
        scenario.description,
        "Made by softslip: simulations of wall slip and bulk yielding in dense suspensions of "
        "soft particles.",
        graph.contents.gaps,
    )
    root["name"] = f"Results of the scenario {scenario.name}"
    root["description"] = " ".join(filter(None, sentences))
    root["datePublished"] = max(time_of(each, "ended") for each in graph.contents.results)
    root["license"] = graph.licence(graph.credits.licence)
    root["conformsTo"] = [
        graph.entity(address, "CreativeWork", name=name, version=version)
        for address, (name, version) in PROFILES.items()
    ]
    if graph.credits.agent:
        root["author"] = graph.agent()


def _add_project(graph: Graph, readme: CrateFile) -> None:
    """Add the workflow and all other files that no action made."""
    add_workflow(graph)
    graph.file(readme, name="README", about={"@id": "./"})
    graph.file(
        graph.contents.scenario_file,
        name="scenario",
        description=graph.contents.scenario.description,
        exampleOfWork=one_or_all(
            [
                {"@id": "#input/scenario"},
                *({"@id": f"#{r}/scenario"} for r in graph.rules if STEPS[r].takes_scenario),
            ]
        ),
    )
    for each in graph.contents.others:
        if each.name == LOCK:
            _add_lock(graph, each)
        elif each.name != MAIN:
            graph.file(each)


def _add_lock(graph: Graph, lock: CrateFile) -> None:
    differ = sum(
        each.product.provenance.get("lock_sha256") != lock.sha256 for each in graph.contents.results
    )
    total = len(graph.contents.results)
    graph.file(
        lock,
        description="The versions of all packages, for pip."
        + (f" {differ} of {total} results were made with another list." if differ else ""),
        conformsTo=graph.entity(
            LOCK_FORMAT, "CreativeWork", name="Requirements file format of pip"
        ),
    )
