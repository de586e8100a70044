"""How pictures become a film: H.264 in MP4, by x264 as FFmpeg's libraries have it.

The same pictures give the same bytes, on any processor: one thread encodes, rounding is exact, and
no time of writing is kept.
"""

import io
from collections.abc import Iterable
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from av import VideoFrame
    from av.container import OutputContainer
    from av.video.stream import VideoStream

QUALITY = 20
"""Constant rate factor of x264: from about 18 on compression begins to be seen."""

PRESET = "medium"
"""How much x264 tries out to make a film small."""

MOST_BYTES = 5e6
"""Largest film [byte]: one that would be larger is encoded more coarsely."""

ROOM = 0.9
"""Share of the largest film that its pictures may take; the rest is for text and overshoot."""

_BT709, _LIMITED = 1, 1
"""Colours of high-definition video, as the formats number them."""


def encoded(pictures: Iterable[NDArray[np.uint8]], count: int, rate: int) -> bytes:
    """Return a film of pictures.

    Parameters
    ----------
    pictures
        Red, green and blue, shape (rows, columns, 3) each, both even.
    count
        How many there are.
    rate
        Pictures a second.
    """
    import av

    # A film of few pictures must not end up large either: it is the mean rate that is limited.
    most = int(ROOM * MOST_BYTES * 8 / (count / rate))
    buffer, stream = io.BytesIO(), None
    with av.open(buffer, "w", format="mp4") as film:
        for number, picture in enumerate(pictures):
            stream = stream or _stream(film, picture.shape, rate, most)
            frame = _frame(picture)
            frame.pts, frame.time_base = number, Fraction(1, rate)
            film.mux(stream.encode(frame))
        assert stream is not None, "a film without pictures"
        film.mux(stream.encode())
    return buffer.getvalue()


def _stream(film: "OutputContainer", shape: tuple[int, ...], rate: int, most: int) -> "VideoStream":
    """Return the stream that encodes pictures, up to ``most`` bits a second."""
    limit = most // 1000
    settings = f"threads=1:cpu-independent=1:vbv-maxrate={limit}:vbv-bufsize={limit}"
    options = {"crf": str(QUALITY), "preset": PRESET, "x264-params": settings}
    stream = film.add_stream("libx264", rate=rate, options=options)
    stream.height, stream.width = shape[:2]
    stream.pix_fmt = "yuv420p"
    stream.codec_context.thread_count = 1
    stream.codec_context.colorspace = stream.codec_context.color_primaries = _BT709
    stream.codec_context.color_trc, stream.codec_context.color_range = _BT709, _LIMITED
    return stream


def _frame(picture: NDArray[np.uint8]) -> "VideoFrame":
    """Return a picture in the colours of video, each of four pixels, rounded exactly."""
    import av
    from av.video.reformatter import ColorRange, Colorspace, Interpolation

    return av.VideoFrame.from_ndarray(picture, format="rgb24").reformat(
        format="yuv420p",
        dst_colorspace=Colorspace.ITU709,
        dst_color_range=ColorRange.MPEG,
        interpolation=Interpolation.AREA | Interpolation.BITEXACT | Interpolation.ACCURATE_RND,
    )
