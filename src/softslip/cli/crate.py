"""`softslip crate`: a scenario's results as a research object."""

import re
from pathlib import Path
from typing import Annotated

import typer
from rich.filesize import decimal

from softslip.cli.common import Results, one_line_errors
from softslip.cli.naming import ResultsName, scenario_of
from softslip.errors import ConfigError
from softslip.messages import brief

app = typer.Typer()

Folder = Annotated[
    Path | None,
    typer.Option(
        "--output", help="Folder to write; results/NAME.crate by default.", readable=False
    ),
]
Archive = Annotated[
    Path | None,
    typer.Option("--zip", help="ZIP archive to write, instead of a folder or too.", readable=False),
]
Data = Annotated[str, typer.Option(help="How files get into the folder: copy, or link (hard).")]
Partial = Annotated[bool, typer.Option("--partial", help="Results may be missing.")]
Agent = Annotated[str, typer.Option(help="Who ran the workflow; nobody is named by default.")]
Orcid = Annotated[str, typer.Option(help="That person's ORCID iD.")]
Licence = Annotated[
    str, typer.Option("--license", help="Address of the results' licence; the software's if none.")
]
Hosts = Annotated[bool, typer.Option("--hosts", help="Name the machines in the metadata.")]

WAYS = ("copy", "link")

_ORCID = re.compile(r"(?:https://orcid\.org/)?((?:\d{4}-){3}\d{3}[\dX])")
_ADDRESS = re.compile(r"https?://[^\s<>\"{}|\\^`]+")


@app.command()
@one_line_errors
def crate(
    scenario: ResultsName,
    results: Results = None,
    folder: Folder = None,
    archive: Archive = None,
    data: Data = "copy",
    partial: Partial = False,
    agent: Agent = "",
    orcid: Orcid = "",
    licence: Licence = "",
    hosts: Hosts = False,
) -> None:
    """Pack a scenario's results, and what they were made with, into a Workflow Run RO-Crate."""
    from softslip.provenance.crate import (
        METADATA,
        Credits,
        check_archive,
        check_folder,
        collect,
        files_of,
        write_archive,
        write_folder,
    )

    _check_options(data, folder, archive, agent, licence)
    credits = Credits(agent, _orcid(orcid, agent), licence, hosts)
    # What cannot be written is refused before everything is read.
    if archive is not None:
        check_archive(archive)
    if folder is not None:
        check_folder(folder)
    scenario, results = scenario_of(scenario, results)
    contents = collect(scenario, results, partial=partial)
    if folder is None and archive is None:
        top = results or Path("results") / contents.scenario.name
        top = top.resolve() if top.name in ("", "..") else top
        folder = top.with_name(f"{top.name}.crate")
        check_folder(folder)
    items = files_of(contents, credits)
    if folder is not None:
        write_folder(items, folder, link=data == "link")
    if archive is not None:
        write_archive(items, archive)
    total = decimal(sum(each.size for each in items))
    missing = f", {len(contents.missing)} results missing" if contents.missing else ""
    for path in filter(None, (folder, archive)):
        print(f"wrote {path}: {len(items)} files, {total}{missing}")
    digest = next(each.sha256 for each in items if each.name == METADATA)
    print(f"SHA-256 of {METADATA}, which names each file with its own: {digest}")


def _check_options(
    data: str, folder: Path | None, archive: Path | None, agent: str, licence: str
) -> None:
    """Refuse values that no command line should have.

    Raises
    ------
    ConfigError
        For the first of them.
    """
    if data not in WAYS:
        raise ConfigError(
            "data",
            brief(data),
            "is not known",
            f"use one of {', '.join(WAYS)}",
        )
    if data == "link" and folder is None and archive is not None:
        raise ConfigError(
            "data", brief(data), "is for a folder, not for an archive", "give --output too"
        )
    if agent and not (agent.strip() and agent.isprintable()):
        raise ConfigError("agent", brief(agent), "is not a name", "write plain text")
    if licence and not _ADDRESS.fullmatch(licence):
        raise ConfigError(
            "license",
            brief(licence),
            "is not a web address",
            "for example https://creativecommons.org/licenses/by/4.0/",
        )


def _orcid(orcid: str, agent: str) -> str:
    """Return the address of an ORCID iD, empty where there is none.

    Raises
    ------
    ConfigError
        When it is none, its check digit is wrong (ISO 7064, MOD 11-2), or nobody is named.
    """
    if not orcid:
        return ""
    found = _ORCID.fullmatch(orcid)
    if found is None or _check_digit(found[1]) != found[1][-1]:
        raise ConfigError(
            "orcid", brief(orcid), "is not an ORCID iD", "for example 0000-0002-1825-0097"
        )
    if not agent:
        raise ConfigError("orcid", brief(orcid), "is given without a name", "give --agent too")
    return f"https://orcid.org/{found[1]}"


def _check_digit(orcid: str) -> str:
    total = 0
    for digit in orcid.replace("-", "")[:-1]:
        total = (total + int(digit)) * 2
    rest = (12 - total % 11) % 11
    return "X" if rest == 10 else str(rest)
