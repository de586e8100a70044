"""A figure or page and the same redrawn, by what can be seen of them."""

import re
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from softslip.files import video
from softslip.files.layout import PAGE
from softslip.files.stamps import MOVING, without_labels
from softslip.provenance.product_labels import PASSING
from softslip.provenance.verification.tolerances import Difference, different

PIXELS = 0.01
"""Share of a figure's pixels that may differ: another release of the font's renderer shifts
letters by a part of a pixel."""

CONTRAST = 32
"""Difference of a colour, of 255, from which a pixel counts as different."""

_REASON = "letters drawn by another release of their renderer"

_SVG_LABELS = re.compile(rb"<dc:description>.*?</dc:description>", re.DOTALL)
_PAGE_DATA = re.compile(rb'<script type="application/json" id="data">([^<]*)</script>')
_PDF_LABELS = b"/Subject "


def figure_differences(
    recorded: Path, rerun: Path, labels: tuple[dict[str, Any], dict[str, Any]]
) -> Iterator[Difference]:
    """Compare the labels and what can be seen of two figures."""
    first, second = labels
    for key in sorted({*first, *second} - PASSING):
        if first.get(key) != second.get(key):
            yield different(f"{key} (label)")
    if recorded.suffix == MOVING:
        yield _movies(recorded, rerun)
    elif recorded.suffix == ".png":
        yield _pixels(recorded, rerun)
    elif recorded.suffix == PAGE:
        yield from _page_parts(recorded, rerun)
    elif drawing(recorded) != drawing(rerun):
        yield different("drawing")


def _page_parts(recorded: Path, rerun: Path) -> Iterator[Difference]:
    """Compare the numbers of two pages, and apart from them what shows the numbers."""
    ours, theirs = (
        _PAGE_DATA.split(without_labels(each.read_bytes())) for each in (recorded, rerun)
    )
    if ours[1::2] != theirs[1::2]:
        yield different("numbers")
    apart = float(ours[::2] != theirs[::2])
    yield Difference("program", apart, 1.0, "the same numbers shown by another release")


def _pixels(recorded: Path, rerun: Path) -> Difference:
    images = []
    for path in (recorded, rerun):
        with Image.open(path) as image:
            images.append(np.asarray(image.convert("RGBA"), dtype=np.int16))
    ours, theirs = images
    if ours.shape != theirs.shape:
        return different("size")
    share = float((np.abs(ours - theirs).max(axis=-1) >= CONTRAST).mean())
    return Difference("pixels", share, PIXELS, _REASON)


def _movies(recorded: Path, rerun: Path) -> Difference:
    """Compare two movies picture by picture; what is told of is the picture that differs most."""
    worst = 0.0
    films = (video.frames(path.read_bytes()) for path in (recorded, rerun))
    for ours, theirs in zip_longest(*films):
        if ours is None or theirs is None:
            return different("number of pictures")
        if ours[0] != theirs[0]:
            return different("moments of the pictures")
        if ours[1].shape != theirs[1].shape:
            return different("size")
        apart = np.abs(ours[1].astype(np.int16) - theirs[1])
        worst = max(worst, float((apart >= CONTRAST).mean()))
    return Difference("pixels", worst, PIXELS, _REASON)


def drawing(path: Path) -> bytes:
    """Return what a drawing is without its labels; nothing of one that is made of pixels."""
    content = path.read_bytes()
    if path.suffix == PAGE:
        return without_labels(content)
    if path.suffix == ".svg":
        return _SVG_LABELS.sub(b"", content)
    # The labels are in the last object; after it only come the places of all objects.
    return content.rpartition(_PDF_LABELS)[0] if path.suffix == ".pdf" else b""
