"""Films as files: MP4 with fields of text, written and read by FFmpeg's libraries.

The libraries are only loaded where a film is written or read.
"""

import io
from collections.abc import Iterator, Mapping
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

COMMENT = "comment"
"""The field for a long text."""


def with_fields(film: bytes, fields: Mapping[str, str]) -> bytes:
    """Return a film with fields of text, and the pictures as they are."""
    import av

    buffer = io.BytesIO()
    with av.open(io.BytesIO(film), "r") as source, av.open(buffer, "w", format="mp4") as copy:
        copy.metadata.update(fields)
        pictures = source.streams.video[0]
        stream = copy.add_stream_from_template(pictures)
        for packet in source.demux(pictures):
            if packet.dts is not None:
                packet.stream = stream
                copy.mux(packet)
    return buffer.getvalue()


def field_of(film: bytes, name: str) -> str:
    """Return a field of text.

    Raises
    ------
    KeyError
        When the film has none of this name.
    av.error.FFmpegError
        When it cannot be read.
    """
    import av

    with av.open(io.BytesIO(film), "r") as source:
        return source.metadata[name]


def frames(film: bytes) -> Iterator[tuple[Fraction, NDArray[np.uint8]]]:
    """Yield the moment of each picture [s] and its pixels as they are kept.

    These are the brightness of every pixel and, below it, two colours of every four; all decoders
    of the format give the same.

    Raises
    ------
    av.error.FFmpegError
        When the film cannot be read.
    """
    import av

    with av.open(io.BytesIO(film), "r") as source:
        stream = source.streams.video[0]
        stream.thread_count = 1
        for frame in source.decode(stream):
            assert frame.pts is not None, "a picture without a moment"
            assert frame.time_base is not None, "a film without a clock"
            yield Fraction(frame.pts * frame.time_base), np.asarray(frame.to_ndarray(), np.uint8)
