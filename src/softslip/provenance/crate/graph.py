"""The graph of a research object while it grows, and what its entities share."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from importlib.metadata import metadata
from pathlib import PurePosixPath
from typing import Any

from rocrate.model import ContextEntity, File
from rocrate.rocrate import ROCrate

from softslip.config.fields import all_fields, value_at
from softslip.config.parameters import Parameters
from softslip.config.stages import STAGES
from softslip.provenance.crate.contents import Contents, CrateFile, Result
from softslip.provenance.crate.steps import STEPS

VERSION = "1.1"
"""Of RO-Crate: the one that the profiles build on."""

_RUN_TERMS = "https://w3id.org/ro/terms/workflow-run#"

TERMS: Mapping[str, str] = {
    **{
        name: _RUN_TERMS + name
        for name in (
            "ParameterConnection",
            "connection",
            "resourceUsage",
            "sha256",
            "sourceParameter",
            "targetParameter",
        )
    },
    "buildInstructions": "https://codemeta.github.io/terms/buildInstructions",
}
"""Terms that RO-Crate 1.1 does not know, and the addresses that the profiles give them.

They are in the metadata themselves, so that these can be read without fetching another file.
"""

ENCODINGS: Mapping[str, str] = {
    ".cff": "application/yaml",
    ".html": "text/html",
    ".md": "text/markdown",
    ".mp4": "video/mp4",
    ".nc": "application/x-netcdf",
    ".png": "image/png",
    ".rst": "text/x-rst",
    ".tsv": "text/tab-separated-values",
    ".yaml": "application/yaml",
}
"""Media types of files by their suffix; of any other it is plain text."""

LICENCES = "https://spdx.org/licenses/"
MAIN = "workflow/Snakefile"
LOCK = "requirements.lock"


@dataclass(frozen=True)
class Credits:
    """What people may add to the metadata.

    Attributes
    ----------
    agent, orcid
        Who ran the workflow, where that is to be said, and the person's ORCID.
    licence
        Address of the results' licence; that of the software where it is empty.
    hosts
        Whether the names of the machines are given.
    """

    agent: str = ""
    orcid: str = ""
    licence: str = ""
    hosts: bool = False


class Graph:
    """The graph of a research object while it grows.

    Attributes
    ----------
    crate
        The graph as the library has it.
    rules
        The steps of the workflow that have results.
    varied
        The values that each parameter takes in the runs.
    runs
        The runs of each stage by their identity.
    """

    def __init__(self, contents: Contents, credits: Credits) -> None:
        self.contents = contents
        self.credits = credits
        self.crate = ROCrate(version=VERSION)
        self.crate.metadata.extra_terms.update(TERMS)
        rules = {each.rule for each in contents.results}
        self.rules = [rule for rule in STEPS if rule in rules]
        self.varied = _varied(contents)
        self.runs = {stage: contents.scenario.stage_table(stage) for stage in STAGES}

    def entity(self, identifier: str, kind: str, **properties: Any) -> dict[str, str]:
        """Add an entity that is no file, unless it is there, and return a reference to it."""
        if identifier not in self.crate:
            details = {"@type": kind, **properties}
            self.crate.add(ContextEntity(self.crate, identifier, properties=details))
        return {"@id": identifier}

    def file(self, each: CrateFile, **properties: Any) -> dict[str, str]:
        """Add a file, and return a reference to it."""
        suffix = PurePosixPath(each.name).suffix
        details = {
            "name": PurePosixPath(each.name).name,
            "encodingFormat": ENCODINGS.get(suffix, "text/plain"),
            "contentSize": str(each.size),
            "sha256": each.sha256,
            **properties,
        }
        self.crate.add(File(self.crate, dest_path=each.name, properties=details))
        return {"@id": each.name}

    def agent(self) -> dict[str, str]:
        """Add who ran the workflow, and return a reference to that person."""
        identifier = self.credits.orcid or "#agent"
        return self.entity(identifier, "Person", name=self.credits.agent)

    def by_agent(self) -> dict[str, Any]:
        """Return what an action says of who did it, nothing where nobody is to be named."""
        return {"agent": self.agent()} if self.credits.agent else {}

    def licence(self, address: str = "") -> dict[str, str]:
        """Add a licence, by default that of the software, and return a reference to it."""
        if address:
            return self.entity(
                address, "CreativeWork", name=address, description="The licence of the results."
            )
        short = str(metadata("softslip")["License-Expression"])
        return self.entity(
            f"{LICENCES}{short}",
            "CreativeWork",
            name=short,
            description="The licence of softslip, in the file LICENSE.",
        )

    @cached_property
    def engine_version(self) -> str | None:
        """Version of Snakemake, where it is known: that of the lock that all results name."""
        locks = [each for each in self.contents.others if each.name == LOCK]
        noted = {each.product.provenance.get("lock_sha256") for each in self.contents.results}
        if not locks or noted != {locks[0].sha256} or isinstance(locks[0].source, bytes):
            return None
        found = re.search(r"^snakemake==(\S+)", locks[0].source.read_text("utf-8"), re.MULTILINE)
        return found and found[1]

    @cached_property
    def readers(self) -> Mapping[str, list[str]]:
        """The rules whose results were made from a file, by its name."""
        found: dict[str, list[str]] = {}
        for each in self.contents.results:
            for parent in self.contents.parents(each):
                rules = found.setdefault(parent.file.name, [])
                if each.rule not in rules:
                    rules.append(each.rule)
        return found


def _varied(contents: Contents) -> dict[str, list[Any]]:
    """Return the values that each parameter takes, in the order of the runs; unset ones none."""
    found: dict[str, list[Any]] = {}
    for run in contents.scenario.runs():
        for path in all_fields(Parameters):
            value = value_at(run.parameters, path)
            if value not in (None, ()):
                values = found.setdefault(path, [])
                if value not in values:
                    values.append(value)
    return found


def value_id(path: str, place: int) -> str:
    """Return the identifier of one of the values that a parameter takes."""
    return f"#value/{path}/{place}"


def action_id(result: Result) -> str:
    """Return the identifier of what made a result: another for every time that it is made."""
    product = result.product
    return f"#{result.rule}/{PurePosixPath(result.expected.name).stem}/{product.record[:16]}"


def one_or_all(values: Sequence[Any]) -> Any:
    """Return a list, or its only element: compacted JSON-LD has no lists of one."""
    return values[0] if len(values) == 1 else list(values)


def unless_none(key: str, values: Sequence[Any]) -> dict[str, Any]:
    """Return a property with its values, nothing where there are none."""
    return {key: one_or_all(values)} if values else {}


def time_of(result: Result, key: str) -> str:
    """Return when a job started or ended, to the millisecond, as the profiles want it."""
    moment = datetime.fromisoformat(str(result.product.provenance[key]))
    return moment.isoformat(timespec="milliseconds")
