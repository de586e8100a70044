"""Films of pictures: what plays them, the same bytes, and no more of them than allowed."""

import io

import av
import numpy as np

from softslip.analysis.figures import film_encoding
from softslip.analysis.figures.film_encoding import encoded

HEIGHT, WIDTH = 96, 64


def noise(count):
    random = np.random.default_rng(4)
    return random.integers(0, 256, (count, HEIGHT, WIDTH, 3), dtype=np.uint8)


def test_the_format_is_one_that_everything_plays():
    with av.open(io.BytesIO(encoded(noise(4), 4, 3))) as opened:
        stream = opened.streams.video[0]
        context = stream.codec_context
        assert (opened.format.name.split(",")[0], context.name) == ("mov", "h264")
        assert (context.pix_fmt, context.width, context.height) == ("yuv420p", WIDTH, HEIGHT)
        assert (stream.frames, float(stream.average_rate)) == (4, 3.0)
        assert "creation_time" not in {**opened.metadata, **stream.metadata}


def test_the_same_pictures_give_the_same_bytes():
    assert encoded(noise(4), 4, 3) == encoded(iter(noise(4)), 4, 3)


def test_a_film_that_would_be_too_large_is_coarser(monkeypatch):
    noisy = noise(30)
    free = len(encoded(noisy, 30, 3))
    monkeypatch.setattr(film_encoding, "MOST_BYTES", free / 4)
    assert len(encoded(noisy, 30, 3)) <= free / 4
