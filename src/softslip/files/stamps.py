"""What a figure carries of itself: labels within the file, and two digests of what it is.

The labels are a JSON object in the field that is for descriptions, and in a page in an element of
their own. `CONTENT_DIGEST` is of what a rerun repeats, the picture and the labels that
last; `RECORD_DIGEST` is of every byte of the file but its own digits.
"""

import hashlib
import io
import json
import re
import xml.etree.ElementTree as tree
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from softslip.errors import DatasetError
from softslip.files import video
from softslip.files.layout import PAGE
from softslip.files.storage import CONTENT_DIGEST, RECORD_DIGEST, VOLATILE
from softslip.messages import file_text

STILLS = (".png", ".svg", ".pdf")
"""File types of figures that stand still."""

MOVING = ".mp4"
"""File type of those that move."""

FORMATS = (*STILLS, MOVING)
"""File types of figures."""

LABELLED = (*FORMATS, PAGE)
"""File types that carry labels: figures, and pages for a browser."""

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_DIGITS = 64
_PLACE = re.compile(rb'"' + RECORD_DIGEST.encode() + rb'": "([0-9a-f]{64})"')
_LABELS = re.compile(rb'(<script type="application/json" id="labels">)([^<]*)(</script>)')
_DESCRIPTION = "{http://purl.org/dc/elements/1.1/}description"


def content_digest(picture: bytes, labels: Mapping[str, Any]) -> str:
    """Return the SHA-256 of what a figure shows and of the labels that last.

    Parameters
    ----------
    picture
        The figure as PNG or MP4; what counts is its pixels, and of a movie when each is shown.
    labels
        Of the figure; those in `VOLATILE` and the digests do not count.
    """
    digest = hashlib.sha256()
    for place, pixels in _pixels(picture):
        text = json.dumps([_lasting(labels), *place, pixels.shape], sort_keys=True)
        digest.update(text.encode())
        digest.update(pixels.tobytes())
    return digest.hexdigest()


def _pixels(picture: bytes) -> Iterator[tuple[tuple[str, ...], NDArray[np.uint8]]]:
    """Yield the pixels of a still, or the moment and pixels of each picture of a movie."""
    if not picture.startswith(_SIGNATURE):
        for moment, pixels in video.frames(picture):
            yield (str(moment),), pixels
        return
    with Image.open(io.BytesIO(picture)) as image:
        yield (), np.asarray(image.convert("RGBA"))


def page_digest(page: bytes, labels: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a page without its labels, and of the labels that last."""
    text = json.dumps(_lasting(labels), sort_keys=True)
    return hashlib.sha256(text.encode() + without_labels(page)).hexdigest()


def _lasting(labels: Mapping[str, Any]) -> dict[str, Any]:
    left_out = (*VOLATILE, CONTENT_DIGEST, RECORD_DIGEST)
    return {key: value for key, value in labels.items() if key not in left_out}


def unsealed(labels: Mapping[str, Any]) -> str:
    """Return labels as JSON, with room for the digest that `sealed` puts in."""
    return json.dumps({**labels, RECORD_DIGEST: "0" * _DIGITS}, sort_keys=True)


def sealed(content: bytes) -> bytes:
    """Return a figure's file with the digest of its bytes in the room that it has for it.

    Raises
    ------
    ValueError
        When there is no such room, or more than one.
    """
    return _with_digits(content, _digest(content).encode())


def with_text(picture: bytes, fields: Mapping[str, str]) -> bytes:
    """Return a PNG with more fields of text, each a chunk after its header."""
    chunks = b""
    for keyword, text in fields.items():
        chunk = b"tEXt" + keyword.encode("ascii") + b"\0" + text.encode("ascii")
        chunks += (len(chunk) - 4).to_bytes(4) + chunk + _checksum(chunk)
    _, end = next(_chunks(picture))
    return picture[:end] + chunks + picture[end:]


def labelled_page(page: bytes, text: str) -> bytes:
    """Return a page with other labels, as JSON, in the element that it has for them.

    Raises
    ------
    ValueError
        When it has no such element, or several.
    """
    # Nothing in it may end the element.
    safe = text.replace("<", "\\u003c").encode("ascii")
    changed, count = _LABELS.subn(lambda found: found[1] + safe + found[3], page)
    if count != 1:
        raise ValueError(f"{count} elements for labels")
    return changed


def without_labels(page: bytes) -> bytes:
    """Return a page whose element for labels is empty."""
    return labelled_page(page, "")


def read_labels(path: Path) -> dict[str, Any]:
    """Return the labels of a figure.

    Raises
    ------
    DatasetError
        When the file is missing, is no figure of ours, or cannot be read.
    """
    return _labels(path, _content(path))


def check_figure(path: Path) -> dict[str, Any]:
    """Return the labels of a figure after making sure that nothing in its file has changed.

    Raises
    ------
    DatasetError
        When the file is missing, is no figure of ours, or has been altered.
    """
    content = _content(path)
    labels = _labels(path, content)
    try:
        altered = _digest(content) != labels.get(RECORD_DIGEST)
    except ValueError:
        altered = True
    if not altered and path.suffix in _DIGESTS:
        altered = _DIGESTS[path.suffix](content, labels) != labels.get(CONTENT_DIGEST)
    if altered:
        raise DatasetError(
            f"{file_text(path)}: has been altered since it was drawn; delete it and redraw it"
        )
    return labels


_DIGESTS = {".png": content_digest, MOVING: content_digest, PAGE: page_digest}
"""Content digests that can be recomputed from the file; others are of the picture drawn with."""


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise DatasetError(f"{file_text(path)}: cannot be read ({error.strerror})") from error


def _labels(path: Path, content: bytes) -> dict[str, Any]:
    readers = {
        ".png": _png_text,
        ".svg": _svg_text,
        ".pdf": _pdf_text,
        MOVING: _movie_text,
        PAGE: _page_text,
    }
    try:
        found = json.loads(readers[path.suffix](content))
    # What the libraries raise for a damaged file has no common base.
    except Exception as error:
        raise DatasetError(
            f"{file_text(path)}: is no figure of softslip, or is damaged ({type(error).__name__})"
        ) from error
    if not isinstance(found, dict) or CONTENT_DIGEST not in found:
        raise DatasetError(f"{file_text(path)}: does not say what it was made from; redraw it")
    return found


def _png_text(content: bytes) -> str:
    with Image.open(io.BytesIO(content)) as image:
        # Before the pixels, which are not looked at: there may be thousands of figures.
        return str(image.info["Description"])


def _svg_text(content: bytes) -> str:
    found = tree.fromstring(content).find(f".//{_DESCRIPTION}")
    if found is None or found.text is None:
        raise ValueError("no description")
    return found.text


def _pdf_text(content: bytes) -> str:
    import pypdf  # Few figures are PDF, and every command would wait for it.

    metadata = pypdf.PdfReader(io.BytesIO(content), strict=True).metadata
    if metadata is None or metadata.subject is None:
        raise ValueError("no subject")
    return str(metadata.subject)


def _movie_text(content: bytes) -> str:
    return video.field_of(content, video.COMMENT)


def _page_text(content: bytes) -> str:
    found = _LABELS.findall(content)
    if len(found) != 1:
        raise ValueError(f"{len(found)} elements for labels")
    return str(found[0][1], "ascii")


def _digest(content: bytes) -> str:
    return hashlib.sha256(_with_digits(content, b"0" * _DIGITS)).hexdigest()


def _with_digits(content: bytes, digits: bytes) -> bytes:
    """Return a file with other digits in the place of its digest.

    Raises
    ------
    ValueError
        When there is not one such place, or a PNG's checksum of it is wrong.
    """
    places = list(_PLACE.finditer(content))
    if len(places) != 1:
        raise ValueError(f"{len(places)} digests")
    start, end = places[0].span(1)
    changed = content[:start] + digits + content[end:]
    if content.startswith(_SIGNATURE):
        first, last = next(span for span in _chunks(content) if span[0] <= start < span[1])
        if _checksum(content[first : last - 4]) != content[last - 4 : last]:
            raise ValueError("a wrong checksum")
        changed = changed[: last - 4] + _checksum(changed[first : last - 4]) + changed[last:]
    return changed


def _chunks(content: bytes) -> Iterator[tuple[int, int]]:
    """Yield where each chunk of a PNG begins, after its length, and ends."""
    place = len(_SIGNATURE)
    while place < len(content):
        length = int.from_bytes(content[place : place + 4])
        yield place + 4, place + 12 + length
        place += 12 + length


def _checksum(chunk: bytes) -> bytes:
    return zlib.crc32(chunk).to_bytes(4)
