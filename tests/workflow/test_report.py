"""Snakemake's report: what is in it and what it says is missing, also as a browser shows it."""

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from browser import WIDE, complaints, opened, resized
from projects import ROOT, TINY, copy_project

from softslip.files.layout import CHECKPOINTS
from softslip.operations.failures import Failure, failure_path

pytestmark = pytest.mark.workflow

STUDIED = "results/published/numerics"


def written(folder: Path, page: str = "report.html", scenario: str = "tiny") -> Path:
    """Write the report of a project, as README says it, and return it."""
    words = ("--report", page, "--config", f"scenario={scenario}")
    command = [sys.executable, "-m", "snakemake", *words]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "WARNING" not in done.stderr, done.stderr
    return folder / page


def first_page(report: Path) -> str:
    """Return the first page of a report, as HTML."""
    (line,) = (
        line for line in report.read_text("utf-8").splitlines() if "var workflow_desc = " in line
    )
    text = json.loads(line.partition("=")[2].strip().removesuffix(";"))
    assert "system-message" not in text, text
    return str(text)


@pytest.fixture(scope="module")
def project(whole: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of a project with all results and a published study; not to be changed."""
    folder = tmp_path_factory.mktemp("report") / "project"
    shutil.copytree(whole, folder)
    shutil.copytree(ROOT / STUDIED, folder / STUDIED)
    return folder


@pytest.fixture(scope="module")
def report(project: Path) -> Path:
    return written(project)


@pytest.fixture(scope="module")
def driver(report: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    started = opened(WIDE, tmp_path_factory.mktemp("profile"))
    started.get(report.as_uri())
    yield started
    started.quit()


def waited(driver: Any, script: str, *words: Any) -> Any:
    """Return what a script finds as soon as it finds something: the page is redrawn by and by."""
    from selenium.webdriver.support.wait import WebDriverWait

    return WebDriverWait(driver, 20).until(lambda it: it.execute_script(script, *words))


def press(driver: Any, found: str, *words: Any) -> None:
    """Click what is found as soon as it is there."""
    event = "new MouseEvent('click', {bubbles: true, cancelable: true})"
    waited(driver, f"const it = {found}; return it && (it.dispatchEvent({event}) || true)", *words)


CATEGORIES = {"Accuracy", "Beside the paper", "Figures", "Snapshots", "Stability"}


def test_the_first_page_says_what_was_run_and_that_nothing_is_missing(report: Path) -> None:
    page = first_page(report)
    assert "The smallest run through every stage" in page
    assert "Nothing: every run is done" in page
    assert "<td>shear</td><td>1</td>" in page
    assert "no results/published" not in page


@pytest.mark.browser
def test_every_result_has_labels_a_caption_and_a_category(driver: Any) -> None:
    assert set(driver.execute_script("return Object.keys(categories)")) == CATEGORIES
    results = driver.execute_script("return results")
    shown = driver.execute_script("return Object.values(categories).flatMap(Object.values).flat()")
    assert sorted(shown) == sorted(results)
    for path, entry in results.items():
        assert entry["labels"], path
        assert all(str(label).strip() for label in entry["labels"].values()), path
        assert len(entry["caption"]) > 50, path
        assert "system-message" not in entry["caption"], path


@pytest.mark.browser
def test_every_category_opens_and_every_figure_is_seen(driver: Any) -> None:
    seen = set()
    entry = "[...document.querySelectorAll('#app li a')].find((a) => a.innerText.trim() === {})"
    for category in sorted(CATEGORIES):
        driver.execute_script("app.setView({navbarMode: 'menu'})")
        press(driver, entry.format("arguments[0]"), category)
        listed = "return Object.values(categories[arguments[0]]).flat()"
        for path in driver.execute_script(listed, category):
            driver.execute_script("app.showResultInfo(arguments[0])", path)
            press(driver, VIEW, path)
            assert is_seen(driver, path), path
            seen.add(path)
    assert seen == set(driver.execute_script("return Object.keys(results)"))
    assert complaints(driver) == []


@pytest.mark.browser
def test_nothing_that_is_larger_than_the_window_is_cut(driver: Any) -> None:
    place = "document.querySelector('#app .grow.overflow-auto')"
    (figure,) = (
        path for path in driver.execute_script("return Object.keys(results)") if "fig5" in path
    )
    resized(driver, (700, 200))
    try:
        driver.execute_script("app.setView({content: 'rulegraph'})")
        assert_nothing_is_cut(driver, place)
        driver.execute_script(
            "app.setView({content: 'img', contentPath: results[arguments[0]].data_uri})", figure
        )
        assert is_seen(driver, figure)
        assert_nothing_is_cut(driver, place)
    finally:
        resized(driver, WIDE)


def assert_nothing_is_cut(driver: Any, place: str) -> None:
    """Make sure that what is higher than the window begins at its top, and not above it."""
    top = f"{place}.firstElementChild.getBoundingClientRect().top"
    assert driver.execute_script(f"return {place}.scrollHeight > innerHeight")
    assert driver.execute_script(f"return {top}") >= 0


VIEW = (
    "app.state.navbarMode === 'resultinfo' && app.state.resultPath === arguments[0]"
    " && document.querySelector('#app li table a')"
)
"""The button that shows the result whose description is open."""


def is_seen(driver: Any, path: str) -> bool:
    """Whether the picture or the page of a result is open and has something to be seen."""
    opened = (
        "const place = document.querySelector('#app .grow.overflow-auto');"
        "const it = place && place.querySelector('img, iframe');"
        "return it && it.src === results[arguments[0]].data_uri"
        " && (it.tagName === 'IFRAME' ? 'page' : it.naturalWidth && 'picture')"
    )
    if waited(driver, opened, path) == "picture":
        return True
    driver.switch_to.frame(driver.find_element("css selector", "#app .grow.overflow-auto iframe"))
    try:
        text = waited(driver, "return document.body && document.body.innerText")
        if driver.find_elements("css selector", "video"):
            return bool(waited(driver, "return document.querySelector('video').readyState > 1"))
        return bool(driver.find_elements("css selector", "table")) and len(text) > 200
    finally:
        driver.switch_to.default_content()


@pytest.mark.browser
def test_the_statistics_and_the_rules_are_drawn(driver: Any) -> None:
    for content, places in (("stats", ("runtimes", "timeline")), ("rulegraph", ("rulegraph",))):
        driver.execute_script("app.setView({content: arguments[0]})", content)
        for place in places:
            drawn = f"return document.querySelector('#{place} canvas, #{place} svg')"
            assert waited(driver, drawn)
    assert complaints(driver) == []


def test_the_report_of_a_scenario_that_is_not_finished_says_what_is_missing(
    project: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "project"
    shutil.copytree(project, folder)
    results = folder / "results" / "tiny"
    (sheared,) = (results / "shear").glob("*.nc")
    for path in (sheared, results / "fits.nc", results / "figures" / "fig5.png"):
        path.unlink()
    failure = asdict(Failure("NumericalError", "film & <thickness> at step 7"))
    record = failure_path(results / "shear" / CHECKPOINTS, sheared.stem)
    record.write_text(json.dumps(failure))
    shutil.rmtree(folder / STUDIED)
    page = first_page(written(folder))
    for words in (
        "not done, stage by stage (1):",
        f"<td>{sheared.stem}</td><td>failed</td>",
        "NumericalError: film &amp; &lt;thickness&gt; at step 7",
        "<li>fits.nc</li><li>figures/fig5.png</li>",
        "this folder has no results/published/numerics",
    ):
        assert words in page, words
    assert "Nothing" not in page


def test_the_report_of_nothing_is_a_list_of_what_is_missing(tmp_path: Path) -> None:
    folder = copy_project(tmp_path / "project")
    (folder / "config" / "tiny.yaml").write_text(TINY)
    page = first_page(written(folder))
    assert "not done, stage by stage (4):" in page
    assert not (folder / "results").exists()
