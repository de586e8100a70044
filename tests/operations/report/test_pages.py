import base64
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from projects import ROOT

from softslip.analysis.figures.movie import Movie
from softslip.analysis.figures.saving import save_figure
from softslip.errors import DatasetError
from softslip.operations.report import pages
from softslip.operations.report.pages import PAGES, write_page
from softslip.studies.publish import NUMERICS, blocks_of

LARGEST_FRAME = 2**21
"""Characters of an address up to which Chromium opens it within another page."""


@pytest.fixture
def movie(tmp_path: Path) -> Path:
    """Return a movie of three pictures."""
    figure = Figure(figsize=(1.0, 0.5), dpi=80)
    axes = figure.add_axes((0, 0, 1, 1))
    (line,) = axes.plot([0, 1], [0, 0])
    shown = Movie(figure, 3, (line,), lambda number: line.set_ydata(np.full(2, number / 3)))
    save_figure(shown, tmp_path / "movie.mp4", {"title": "movie"})
    return tmp_path / "movie.mp4"


@pytest.mark.parametrize(
    ("name", "parts"), [("accuracy", pages.ACCURACY), ("stability", pages.STABILITY)]
)
def test_a_page_of_the_study_has_all_its_tables(name: str, parts: dict[str, object]) -> None:
    written = PAGES[name](ROOT / NUMERICS.folder).decode()
    blocks = blocks_of(ROOT / NUMERICS.folder)
    text = "\n".join(blocks[part] for part in parts)
    assert written.count("<table>") == len(re.findall(r"^\| ?[-:]+", text, re.M)) > 0
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert written.count("<tr>") == len(rows) - written.count("<table>")
    assert "---" not in written
    assert len(base64.b64encode(written.encode())) < LARGEST_FRAME


def test_every_part_of_a_study_is_on_one_of_the_pages() -> None:
    assert set(blocks_of(ROOT / NUMERICS.folder)) == pages.ACCURACY.keys() | pages.STABILITY.keys()
    assert not pages.ACCURACY.keys() & pages.STABILITY.keys()


def test_a_movie_is_played_from_within_the_page(movie: Path, tmp_path: Path) -> None:
    write_page("movie", movie, tmp_path / "movie.html")
    written = (tmp_path / "movie.html").read_text("utf-8")
    (data,) = re.findall(r'src="data:video/mp4;base64,([^"]+)"', written)
    assert base64.b64decode(data) == movie.read_bytes()


def test_a_movie_that_browsers_would_not_open_is_named(
    movie: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    twice = 16 / 9 * pages.LARGEST_MOVIE
    assert twice < LARGEST_FRAME
    monkeypatch.setattr(pages, "LARGEST_MOVIE", movie.stat().st_size - 1)
    written = PAGES["movie"](movie).decode()
    assert "<video" not in written
    assert f"open {movie}" in written


def test_nothing_is_written_of_a_damaged_source(movie: Path, tmp_path: Path) -> None:
    content = bytearray(movie.read_bytes())
    content[len(content) // 2] ^= 1
    movie.write_bytes(content)
    with pytest.raises(DatasetError, match=r"movie\.mp4"):
        write_page("movie", movie, tmp_path / "movie.html")
    assert not (tmp_path / "movie.html").exists()
