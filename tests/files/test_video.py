"""Films as files: pictures, moments and text come back."""

import json

import numpy as np
import pytest

from softslip.analysis.figures.film_encoding import encoded
from softslip.files import video

HEIGHT, WIDTH = 96, 64
SHADES = (40, 100, 160, 220)


@pytest.fixture(scope="module")
def film():
    """Grey pictures, each brighter than the one before."""
    pictures = (np.full((HEIGHT, WIDTH, 3), shade, np.uint8) for shade in SHADES)
    return encoded(pictures, len(SHADES), 3)


def test_pictures_come_back_with_their_moments(film):
    moments, pixels = zip(*video.frames(film), strict=True)
    assert [float(each) for each in moments] == pytest.approx([0, 1 / 3, 2 / 3, 1])
    assert {each.shape for each in pixels} == {(HEIGHT * 3 // 2, WIDTH)}
    # Grey of 0 to 255 is a brightness of 16 to 235, as in all video of the kind.
    for grey, found in zip(SHADES, pixels, strict=True):
        assert found[:HEIGHT] == pytest.approx(16 + grey * 219 / 255, abs=2)
        assert found[HEIGHT:] == pytest.approx(128, abs=1)


def test_fields_leave_the_pictures_alone(film):
    text = json.dumps({"long": "x" * 20_000, "signs": 'a "quoted" \\ <word>; = é'})
    labelled = video.with_fields(film, {"title": "a film", video.COMMENT: text})
    assert video.field_of(labelled, video.COMMENT) == text
    assert video.field_of(labelled, "title") == "a film"
    assert video.with_fields(film, {"title": "a film", video.COMMENT: text}) == labelled
    for (moment, pixels), (other, others) in zip(
        video.frames(film), video.frames(labelled), strict=True
    ):
        assert moment == other
        assert np.array_equal(pixels, others)


def test_a_film_without_a_field_says_so(film):
    with pytest.raises(KeyError):
        video.field_of(film, video.COMMENT)
