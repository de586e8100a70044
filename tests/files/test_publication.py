from dataclasses import replace
from pathlib import Path

import pytest

from softslip.errors import ConfigError, DatasetError
from softslip.files.publication import Publication, blocks_in, with_blocks

DOCUMENT = "# Title\n\n<!-- begin size: generated -->\n\nold\n\n<!-- end size -->\n"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Return a project with a document and a folder of results."""
    (tmp_path / "results" / "parts").mkdir(parents=True)
    (tmp_path / "results" / "whole.nc").write_bytes(b"whole")
    (tmp_path / "results" / "parts" / "one.nc").write_bytes(b"one")
    (tmp_path / "document.md").write_text(DOCUMENT)
    return tmp_path


def publication(*files: str) -> Publication:
    return Publication(
        folder=Path("published"),
        document=Path("document.md"),
        files=files,
        made_by="make them",
        blocks=lambda results: {"size": f"{(results / 'whole.nc').stat().st_size} byte"},
    )


def test_blocks_are_replaced_and_nothing_else():
    document = "before\n<!-- begin a: generated -->\nold\n<!-- end a -->\nafter\n"
    once = with_blocks(document, {"a": "new \\1"})
    assert blocks_in(once) == {"a": "new \\1"}
    assert once.startswith("before\n")
    assert once.endswith("after\n")
    assert with_blocks(once, {"a": "new \\1"}) == once


@pytest.mark.parametrize("document", ["", "<!-- begin a: generated -->\n<!-- end a -->\n" * 2])
def test_a_document_that_has_lost_a_block_is_refused(document):
    with pytest.raises(ConfigError, match="a"):
        with_blocks(document, {"a": "new"})


def test_files_are_copied_and_the_document_is_rewritten(project):
    results = project / "results"
    written = publication("whole.nc", "parts/*.nc").write(results, project)
    document = project / "document.md"
    copies = [project / "published" / "whole.nc", project / "published" / "parts" / "one.nc"]
    assert written == [*copies, document]
    assert [path.read_bytes() for path in copies] == [b"whole", b"one"]
    assert blocks_in(document.read_text()) == {"size": "5 byte"}


def test_further_documents_have_the_parts_that_they_name(project):
    (project / "further.md").write_text(f"Few words.\n\n{DOCUMENT}")
    (project / "without.md").write_text("Nothing generated.\n")
    names = ("further.md", "without.md", "nowhere.md")
    every = replace(publication("whole.nc"), further=tuple(map(Path, names)))
    every.write(project / "results", project)
    assert blocks_in((project / "further.md").read_text()) == {"size": "5 byte"}
    assert (project / "further.md").read_text().startswith("Few words.\n")
    assert (project / "without.md").read_text() == "Nothing generated.\n"
    assert not (project / "nowhere.md").exists()


def test_nothing_is_published_where_a_file_is_missing(project):
    with pytest.raises(DatasetError, match=r"more/\*.nc: is missing; first make them"):
        publication("whole.nc", "more/*.nc").write(project / "results", project)
    assert not (project / "published").exists()
    assert (project / "document.md").read_text() == DOCUMENT


def test_nothing_is_published_where_the_document_has_lost_a_part(project):
    (project / "document.md").write_text("# Title\n")
    with pytest.raises(ConfigError, match="size"):
        publication("whole.nc").write(project / "results", project)
    assert not (project / "published").exists()


def test_nothing_is_published_where_there_is_no_document(project):
    (project / "document.md").unlink()
    with pytest.raises(ConfigError, match=r"document.md' is not there; publish from the folder"):
        publication("whole.nc").write(project / "results", project)
    assert not (project / "published").exists()
