"""Hold research objects against the profiles that they claim, without a network.

Run by the Python of `.crate/`, where the validator is; see `make crate-check`.
"""

import argparse
import json
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from importlib import resources
from io import BytesIO
from pathlib import Path

from requests import PreparedRequest, Response
from requests.adapters import BaseAdapter
from requests_cache import NEVER_EXPIRE, CachedSession
from rocrate_validator.models import Severity
from rocrate_validator.services import validate
from urllib3 import HTTPResponse

CONTEXT = "https://w3id.org/ro/crate/1.1/context"
"""The one address that validating a crate fetches: what RO-Crate's terms mean."""

PROFILES = (
    "ro-crate-1.1",
    "workflow-ro-crate-1.0",
    "process-run-crate-0.5",
    "workflow-run-crate-0.5",
    "provenance-run-crate-0.5",
)
"""All that apply; each looks at what it builds on, too."""

UNFOLLOWED = {
    "Root Data Entity: `publisher` property": "nobody has published it when it is made",
    "Main Workflow Bioschemas compliance": "that profile demands an address of the workflow and "
    "of the site that holds it, and there is none",
    "Application url": "the package names no address of its own",
    "Organization: RECOMMENDED url property": "nor do its authors",
    "SoftwareApplication id": "absolute where the software has an address; where it has none the "
    "profile lets it have an identifier within the crate",
}
"""Recommendations that no crate of ours follows, and why."""

UNNAMED = {
    "Root Data Entity: `author` property": "nobody is named unless --agent asks for it",
    "Action agent": "nobody is named unless --agent asks for it",
}
"""Recommendations that a crate follows only with --agent."""

AFFILIATION = "CreativeWork Author: RECOMMENDED "
NAMED = {
    f"{AFFILIATION}affiliation property": "only a name is asked for, not where people work",
    f"{AFFILIATION}Contextual Entity linked for the organizational `affiliation` property": "as "
    "before",
}
"""Recommendations that a crate with --agent does not follow."""


class Shelf(BaseAdapter):
    """Answers with the context that the library rocrate ships, as its address would."""

    def send(self, request: PreparedRequest, **_: object) -> Response:
        """Return the context."""
        content = (resources.files("rocrate") / "data" / "ro-crate.jsonld").read_bytes()
        found = json.loads(content)["@id"]
        if request.url != CONTEXT or found != CONTEXT:
            raise SystemExit(f"{request.url}: wanted, but rocrate ships {found}")
        response = Response()
        response.status_code, response.url, response.request = 200, CONTEXT, request
        response.headers["Content-Type"] = "application/ld+json"
        response.raw = HTTPResponse(
            BytesIO(content), response.headers, status=200, preload_content=False
        )
        return response

    def close(self) -> None:
        """Do nothing: nothing is open."""


def fill(cache: Path) -> None:
    """Put what validating fetches into the validator's cache."""
    cache.parent.mkdir(parents=True, exist_ok=True)
    with CachedSession(str(cache), backend="sqlite", expire_after=NEVER_EXPIRE) as session:
        session.mount(CONTEXT, Shelf())
        session.get(CONTEXT).raise_for_status()


def issues(crate: Path, profile: str, cache: Path) -> Iterator[tuple[Severity, str, str]]:
    """Yield what a profile finds, required and recommended: how grave, which check, and where."""
    settings = {
        "rocrate_uri": str(crate),
        "profile_identifier": profile,
        "requirement_severity": Severity.RECOMMENDED,
        "offline": True,
        "cache_path": str(cache),
    }
    for issue in validate(settings).get_issues(Severity.RECOMMENDED):
        yield issue.severity, issue.check.name, f"{issue.violatingEntity or ''} {issue.message}"


def check_the_check(crate: Path, cache: Path) -> None:
    """Make sure that a crate whose actions have no instrument is refused."""
    if crate.is_dir():
        content = (crate / "ro-crate-metadata.json").read_bytes()
    else:
        with zipfile.ZipFile(crate) as archive:
            content = archive.read("ro-crate-metadata.json")
    metadata = json.loads(content)
    for entity in metadata["@graph"]:
        entity.pop("instrument", None)
    with tempfile.TemporaryDirectory() as name:
        (Path(name) / "ro-crate-metadata.json").write_text(json.dumps(metadata), "utf-8")
        found = issues(Path(name), "process-run-crate-0.5", cache)
        named = {check for severity, check, _ in found if severity is Severity.REQUIRED}
    if "Action instrument" not in named:
        raise SystemExit(f"{crate}: passes without instruments: {named}")


def main() -> None:
    """Validate every crate against every profile; fail on what is not listed above."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cache", type=Path, required=True, help="file for the validator's cache")
    parser.add_argument("--named", action="store_true", help="the crates were made with --agent")
    parser.add_argument("crates", nargs="+", type=Path)
    options = parser.parse_args()
    allowed = UNFOLLOWED | (NAMED if options.named else UNNAMED)
    fill(options.cache)
    check_the_check(options.crates[0], options.cache)
    seen: set[str] = set()
    faults = 0
    for crate in options.crates:
        for profile in PROFILES:
            found = set(issues(crate, profile, options.cache))
            bad = {each for each in found if each[0] is Severity.REQUIRED or each[1] not in allowed}
            faults += len(bad)
            seen |= {name for _, name, _ in found - bad}
            print(f"{crate.name}: {profile}: {len(bad)} issues, {len(found - bad)} as listed")
            for severity, name, recorded in sorted(bad, key=str):
                print(f"    {severity.name}: {name}: {recorded}")
    for name in sorted(seen):
        print(f"not followed: {name}: {allowed[name]}")
    # A recommendation that is followed after all must leave the list.
    stale = sorted(set(allowed) - seen)
    for name in stale:
        print(f"listed as not followed, but followed: {name}")
    sys.exit(1 if faults or stale else 0)


if __name__ == "__main__":
    main()
