"""A figure and the same redrawn, by what can be seen of them."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from softslip.provenance.product_labels import PASSING
from softslip.provenance.verification.tolerances import Difference, different

PIXELS = 0.01
"""Share of a figure's pixels that may differ: another release of the font's renderer shifts
letters by a part of a pixel."""

CONTRAST = 32
"""Difference of a colour, of 255, from which a pixel counts as different."""

_SVG_LABELS = re.compile(rb"<dc:description>.*?</dc:description>", re.DOTALL)
_PDF_LABELS = b"/Subject "


def figure_differences(
    recorded: Path, rerun: Path, labels: tuple[dict[str, Any], dict[str, Any]]
) -> Iterator[Difference]:
    """Compare the labels and what can be seen of two figures."""
    first, second = labels
    for key in sorted({*first, *second} - PASSING):
        if first.get(key) != second.get(key):
            yield different(f"{key} (label)")
    if recorded.suffix == ".png":
        yield _pixels(recorded, rerun)
    elif drawing(recorded) != drawing(rerun):
        yield different("drawing")


def _pixels(recorded: Path, rerun: Path) -> Difference:
    images = []
    for path in (recorded, rerun):
        with Image.open(path) as image:
            images.append(np.asarray(image.convert("RGBA"), dtype=np.int16))
    ours, theirs = images
    if ours.shape != theirs.shape:
        return different("size")
    share = float((np.abs(ours - theirs).max(axis=-1) >= CONTRAST).mean())
    return Difference("pixels", share, PIXELS, "letters drawn by another release of their renderer")


def drawing(path: Path) -> bytes:
    """Return what a drawing is without its labels; nothing of one that is made of pixels."""
    content = path.read_bytes()
    if path.suffix == ".svg":
        return _SVG_LABELS.sub(b"", content)
    # The labels are in the last object; after it only come the places of all objects.
    return content.rpartition(_PDF_LABELS)[0] if path.suffix == ".pdf" else b""
