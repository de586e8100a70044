"""The documentation's site, as its readers open it from a folder."""

import posixpath
from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest
from browser import WIDE, complaints, opened
from projects import ROOT

SITE = ROOT / ".site" / "html"

API = SITE / "reference" / "api"
"""Folder of the pages that are made from docstrings, all in one way."""

SOME = 40
"""Of so many of these one is opened."""

NOT_LOADED = """
return [...document.images]
    .filter((each) => !each.complete || each.naturalWidth === 0)
    .map((each) => each.src)
"""


class Page(HTMLParser):
    """What a page leads to, what it loads, and the anchors that it has."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.anchors: set[str] = {"", "top"}
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("href", "src") and value is not None:
                self.links.add(value)
            elif name == "id" or (tag == "a" and name == "name"):
                self.anchors.add(value or "")


@cache
def page(path: Path) -> Page:
    return Page(path)


@pytest.fixture(scope="module")
def pages() -> list[Path]:
    found = sorted(SITE.rglob("*.html"))
    if not found:
        pytest.skip("the documentation's site is not built; make docs builds it")
    return found


@pytest.fixture(scope="module")
def driver(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    started = opened(WIDE, tmp_path_factory.mktemp("profile"))
    yield started
    started.quit()


@cache
def _file_at(folder: Path, link: str) -> Path | None:
    """Return the file of the site that a link from a folder leads to; None where there is none."""
    target = Path(posixpath.normpath(folder / unquote(link)))
    return target if target.is_relative_to(SITE) and target.is_file() else None


def leads_somewhere(link: str, path: Path) -> bool:
    """Tell whether a page's link is to another site, or to a file and an anchor of this one."""
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return True
    target = _file_at(path.parent, parts.path) if parts.path else path
    if target is None:
        return False
    return target.suffix != ".html" or unquote(parts.fragment) in page(target).anchors


def test_every_link_and_anchor_leads_somewhere(pages: list[Path]) -> None:
    astray = [
        f"{path.relative_to(SITE)}: {link}"
        for path in pages
        for link in page(path).links
        if not leads_somewhere(link, path)
    ]
    assert astray == []


@pytest.mark.browser
def test_pages_open_with_their_pictures_and_without_complaint(
    pages: list[Path], driver: Any
) -> None:
    written = [path for path in pages if API not in path.parents]
    generated = [path for path in pages if API in path.parents]
    assert written
    assert generated
    said = []
    for path in (*written, *generated[::SOME]):
        driver.get(path.as_uri())
        troubles = [*complaints(driver), *driver.execute_script(NOT_LOADED)]
        said += [f"{path.relative_to(SITE)}: {each}" for each in troubles]
    assert said == []
