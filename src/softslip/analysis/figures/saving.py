"""How figures become files: stills and movies, with what they were made from inside them."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

import softslip
from softslip.analysis.figures.drawing import house_style
from softslip.analysis.figures.film_encoding import encoded
from softslip.analysis.figures.movie import Movie
from softslip.errors import DatasetError
from softslip.files.stamps import MOVING, STILLS, content_digest, sealed, unsealed, with_text
from softslip.files.storage import CONTENT_DIGEST, replacing
from softslip.files.video import COMMENT, with_fields


def save_figure(
    figure: Figure | Movie,
    path: Path,
    labels: Mapping[str, Any],
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Save a figure under its final name in one step, with what it was made from inside it.

    The same figure with the same labels gives the same bytes: no time of writing is kept.

    Parameters
    ----------
    figure
        What to save.
    path
        Final name; its suffix is the format: .png, .svg or .pdf, of a movie .mp4.
    labels
        What JSON can hold, such as the scenario and the parents; kept as sorted JSON in the field
        Description (PNG, SVG), Subject (PDF) or comment (MP4), with the digests of `files.stamps`.
        "title" also becomes the file's title.
    provenance
        What differs between two drawings of the same thing; kept among the labels.

    Raises
    ------
    DatasetError
        When the suffix is none of these.
    """
    endings = (MOVING,) if isinstance(figure, Movie) else STILLS
    if path.suffix not in endings:
        kind = "movie" if isinstance(figure, Movie) else "figure"
        raise DatasetError(
            f"{path}: cannot save a {kind} as {path.suffix!r}; use {' or '.join(endings)}"
        )
    passing = {} if provenance is None else {"provenance": dict(provenance)}
    with house_style():
        if isinstance(figure, Movie):
            content = _film(figure, labels, passing)
        else:
            content = _still(figure, path.suffix, labels, passing)
    with replacing(path) as temporary:
        temporary.write_bytes(sealed(content))


def _text(picture: bytes, labels: Mapping[str, Any], passing: Mapping[str, Any]) -> str:
    """Return the labels of a picture as they stand in its file."""
    return unsealed({**labels, **passing, CONTENT_DIGEST: content_digest(picture, labels)})


def _title(labels: Mapping[str, Any]) -> str:
    return str(labels.get("title", "softslip"))


def _film(movie: Movie, labels: Mapping[str, Any], passing: Mapping[str, Any]) -> bytes:
    film = encoded(movie.pictures(), movie.count, movie.rate)
    return with_fields(film, {"title": _title(labels), COMMENT: _text(film, labels, passing)})


def _still(
    figure: Figure, suffix: str, labels: Mapping[str, Any], passing: Mapping[str, Any]
) -> bytes:
    program = f"softslip {softslip.__version__}"
    picture = _rendered(figure, ".png", {"Software": program})
    text, title = _text(picture, labels, passing), _title(labels)
    if suffix == ".png":
        # Drawn again, the layout could differ by a rounding from that of the digest.
        return with_text(picture, {"Title": title, "Description": text})
    return _rendered(figure, suffix, _fields(suffix, title, text, program))


def _rendered(figure: Figure, suffix: str, fields: Mapping[str, Any]) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format=suffix.removeprefix("."), metadata=dict(fields))
    return buffer.getvalue()


def _fields(suffix: str, title: str, text: str, program: str) -> dict[str, Any]:
    """Return the fields of a format that hold a title, labels and the program."""
    common = {"Title": title, "Creator": program}
    if suffix == ".svg":
        return common | {"Description": text, "Date": None}
    return common | {"Subject": text, "CreationDate": None}
