"""Figures with labels and digests; every format goes through every test."""

import io
import json
import zlib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure
from PIL import Image

from softslip.analysis.figures import Movie, save_figure
from softslip.analysis.figures.film_encoding import encoded
from softslip.errors import DatasetError
from softslip.files import video
from softslip.files.stamps import (
    FORMATS,
    MOVING,
    STILLS,
    check_figure,
    content_digest,
    labelled_page,
    page_digest,
    read_labels,
    sealed,
    unsealed,
    with_text,
)
from softslip.files.storage import CONTENT_DIGEST, RECORD_DIGEST

LABELS = {"title": "a line", "run": 'demo (\\) <&> "x"', "parents": [{"stage": "shear"}]}
PROVENANCE = {"host": "here", "started": "2026-01-01"}


def line(height=2.0):
    figure = Figure(figsize=(1.0, 0.8))
    figure.subplots().plot([1.0, height])
    return figure


def figure_for(suffix, height=2.0):
    """The line, or a movie of it as it rises."""
    still = line(height)
    if suffix != MOVING:
        return still
    (drawn,) = still.axes[0].lines
    return Movie(still, 3, (drawn,), lambda number: drawn.set_ydata([1.0, 1.0 + number / 2]))


@pytest.fixture(scope="module", params=FORMATS)
def figure(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("figures") / f"line{request.param}"
    save_figure(figure_for(request.param), path, LABELS, PROVENANCE)
    return path


@pytest.fixture(scope="module")
def picture():
    buffer = io.BytesIO()
    line().savefig(buffer, format="png")
    return buffer.getvalue()


def test_labels_come_back(figure):
    labels = check_figure(figure)
    assert labels == read_labels(figure)
    assert {key: labels[key] for key in LABELS} == LABELS
    assert labels["provenance"] == PROVENANCE
    assert set(labels) == {*LABELS, "provenance", CONTENT_DIGEST, RECORD_DIGEST}


def test_the_content_is_the_picture_and_what_lasts(figure):
    def drawn(height=2.0, labels=LABELS, provenance=PROVENANCE):
        path = figure.with_name(f"other{figure.suffix}")
        save_figure(figure_for(path.suffix, height), path, labels, provenance)
        return check_figure(path)

    content, record = check_figure(figure)[CONTENT_DIGEST], check_figure(figure)[RECORD_DIGEST]
    assert drawn() == check_figure(figure)
    elsewhere = drawn(provenance={"host": "there"})
    assert elsewhere[CONTENT_DIGEST] == content
    assert elsewhere[RECORD_DIGEST] != record
    assert drawn(height=3.0)[CONTENT_DIGEST] != content
    assert drawn(labels={**LABELS, "run": "other"})[CONTENT_DIGEST] != content


def test_all_formats_show_the_same_content(tmp_path):
    digests = set()
    for suffix in STILLS:
        save_figure(line(), tmp_path / f"line{suffix}", LABELS)
        digests.add(check_figure(tmp_path / f"line{suffix}")[CONTENT_DIGEST])
    assert len(digests) == 1


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7), cut=st.booleans())
def test_no_damage_is_missed(figure, tmp_path, place, bit, cut):
    content = bytearray(figure.read_bytes())
    where = int(place * len(content))
    if cut:
        del content[where:]
    else:
        content[where] ^= 1 << bit
    damaged = tmp_path / figure.name
    damaged.write_bytes(content)
    with pytest.raises(DatasetError, match=figure.name):
        check_figure(damaged)


def test_bytes_after_the_end_are_not_missed(figure, tmp_path):
    longer = tmp_path / figure.name
    longer.write_bytes(figure.read_bytes() + b"\n")
    with pytest.raises(DatasetError, match=r"altered|damaged"):
        check_figure(longer)


def test_labels_changed_with_right_checksums_are_not_missed(figure, tmp_path):
    content, old, new = figure.read_bytes(), b'"host": "here"', b'"host": "hera"'
    assert content.count(old) == 1
    changed = content.replace(old, new)
    if figure.suffix == ".png":
        start = changed.index(b"tEXtDescription")
        end = start + 4 + int.from_bytes(changed[start - 4 : start])
        checksum = zlib.crc32(changed[start:end]).to_bytes(4)
        changed = changed[:end] + checksum + changed[end + 4 :]
    forged = tmp_path / figure.name
    forged.write_bytes(changed)
    assert read_labels(forged)["provenance"]["host"] == "hera"
    with pytest.raises(DatasetError, match="has been altered"):
        check_figure(forged)


def test_a_picture_under_other_labels_is_not_missed(picture, tmp_path):
    """As by somebody who knows how to seal: the picture is not the one of the labels."""
    recorded = unsealed({"run": "demo", CONTENT_DIGEST: content_digest(picture, {"run": "other"})})
    path = tmp_path / "forged.png"
    path.write_bytes(sealed(with_text(picture, {"Description": recorded})))
    assert read_labels(path)["run"] == "demo"
    with pytest.raises(DatasetError, match="has been altered"):
        check_figure(path)


@pytest.mark.parametrize("suffix", FORMATS)
def test_figures_of_others_have_no_labels(picture, tmp_path, suffix):
    path = tmp_path / f"theirs{suffix}"
    if suffix == MOVING:
        path.write_bytes(encoded(iter(np.zeros((2, 64, 64, 3), np.uint8)), 2, 2))
    else:
        line().savefig(path)
    with pytest.raises(DatasetError, match="is no figure of softslip, or is damaged"):
        read_labels(path)
    (tmp_path / "recorded.png").write_bytes(with_text(picture, {"Description": json.dumps({})}))
    with pytest.raises(DatasetError, match="does not say what it was made from"):
        read_labels(tmp_path / "recorded.png")
    with pytest.raises(DatasetError, match="cannot be read"):
        read_labels(tmp_path / f"missing{suffix}")


def test_a_movie_under_other_labels_is_not_missed(tmp_path):
    film = encoded(iter(np.zeros((2, 64, 64, 3), np.uint8)), 2, 2)
    told = {"run": "demo", CONTENT_DIGEST: content_digest(film, {"run": "other"})}
    path = tmp_path / "forged.mp4"
    path.write_bytes(sealed(video.with_fields(film, {video.COMMENT: unsealed(told)})))
    assert read_labels(path)["run"] == "demo"
    with pytest.raises(DatasetError, match="has been altered"):
        check_figure(path)


def test_movies_and_stills_are_not_saved_as_one_another(tmp_path):
    with pytest.raises(DatasetError, match=r"cannot save a figure as '\.mp4'; use \.png or"):
        save_figure(line(), tmp_path / "line.mp4", LABELS)
    with pytest.raises(DatasetError, match=r"cannot save a movie as '\.png'; use \.mp4"):
        save_figure(figure_for(MOVING), tmp_path / "line.png", LABELS)


def test_text_leaves_the_pixels_alone(picture):
    text = {"Title": "a line", "Description": "x" * 5000}
    with (
        Image.open(io.BytesIO(with_text(picture, text))) as labelled,
        Image.open(io.BytesIO(picture)) as plain,
    ):
        assert {key: labelled.text[key] for key in text} == text
        assert np.array_equal(np.asarray(labelled), np.asarray(plain))


@pytest.mark.parametrize("content", [b"", b'"record_sha256": "' + b"0" * 64 + b'"' * 2])
def test_only_what_has_one_place_for_its_digest_is_sealed(content):
    double = content + content
    with pytest.raises(ValueError, match=r"[02] digests"):
        sealed(double)


HTML = b'<p>1 &lt; 2</p><script type="application/json" id="labels"></script><p>end</p>'


def page(path, html=HTML, labels=LABELS, provenance=PROVENANCE):
    whole = {**labels, "provenance": provenance, CONTENT_DIGEST: page_digest(html, labels)}
    path.write_bytes(sealed(labelled_page(html, unsealed(whole))))
    return path


def test_labels_of_a_page_come_back(tmp_path):
    path = page(tmp_path / "page.html")
    labels = check_figure(path)
    assert labels == read_labels(path)
    assert {key: labels[key] for key in LABELS} == LABELS
    # What stands in the labels ends no element.
    assert path.read_bytes().count(b"<") == HTML.count(b"<")


def test_the_content_of_a_page_is_all_but_what_passes(tmp_path):
    def content(**changes):
        return check_figure(page(tmp_path / "page.html", **changes))[CONTENT_DIGEST]

    assert content() == content(provenance={"host": "there"})
    assert content() != content(html=HTML + b" ")
    assert content() != content(labels={**LABELS, "run": "other"})


@given(place=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_damage_of_a_page_is_missed(tmp_path, place, bit):
    path = page(tmp_path / "page.html")
    content = bytearray(path.read_bytes())
    content[int(place * len(content))] ^= 1 << bit
    path.write_bytes(content)
    with pytest.raises(DatasetError, match=r"page\.html"):
        check_figure(path)


@pytest.mark.parametrize("html", [b"<p>no place</p>", HTML + HTML])
def test_a_page_has_one_place_for_labels(tmp_path, html):
    with pytest.raises(ValueError, match="elements for labels"):
        labelled_page(html, "{}")
    (tmp_path / "page.html").write_bytes(html)
    with pytest.raises(DatasetError, match="is no figure of softslip, or is damaged"):
        read_labels(tmp_path / "page.html")
