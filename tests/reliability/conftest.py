"""Scenes of the reliability tests, and the counts of what was done and what came of it."""

import json
import os
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from pathlib import Path

import pytest
from chain import SHORT, Chain, small_chain

TALLY = "reliability"

FOUND = "lost or wrong"
"""Count of tests that found something lost or wrong; 0 in every row is what is promised."""

SKIPPED = pytest.skip.Exception

Tally = Callable[[str], Counter[str]]
"""Called as tally(what); the test counts in what it returns, until it ends or fails."""


@pytest.fixture(scope="session")
def chain(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chain]:
    """Return the small run, undisturbed, and a warm process to disturb it in."""
    found = small_chain(tmp_path_factory.mktemp("chain"))
    yield found
    found.warm.close()


@pytest.fixture(scope="session")
def short_chain(chain: Chain, tmp_path_factory: pytest.TempPathFactory) -> Chain:
    """Return a run of a few steps, for what is done once for each of its checkpoints."""
    return small_chain(tmp_path_factory.mktemp("short"), SHORT, chain.warm)


@pytest.fixture
def tally(record_property: Callable[[str, object], None]) -> Tally:
    """Return a function that counts, so that the summary tells; see `Tally`."""

    def counter(what: str) -> Counter[str]:
        counts: Counter[str] = Counter()
        record_property(TALLY, [what, counts])
        return counts

    return counter


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Count what a test has found, before its report goes to whoever collects them."""
    if call.when == "call":
        for name, value in item.user_properties:
            if name == TALLY:
                failed = call.excinfo is not None and not call.excinfo.errisinstance(
                    pytest.skip.Exception
                )
                value[1] = dict(value[1]) | {FOUND: int(failed)}
    return (yield)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the counts of all tests, and write them where SOFTSLIP_RELIABILITY says."""
    table: dict[str, Counter[str]] = {}
    for reports in terminalreporter.stats.values():
        for report in reports:
            if getattr(report, "when", None) == "call":
                for name, value in report.user_properties:
                    if name == TALLY:
                        table.setdefault(value[0], Counter()).update(value[1])
    if not table:
        return
    terminalreporter.section("reliability")
    for what, numbers in sorted(table.items()):
        words = ", ".join(f"{name} {count}" for name, count in numbers.items())
        terminalreporter.write_line(f"{what:32} {words}")
    if target := os.environ.get("SOFTSLIP_RELIABILITY"):
        path = Path(target)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(table, indent=1, sort_keys=True) + "\n")
