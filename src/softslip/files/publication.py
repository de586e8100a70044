"""Results that are published: copies in the project, and the document whose tables they give."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from softslip.errors import ConfigError, DatasetError
from softslip.files.storage import replacing
from softslip.messages import brief

Blocks = Mapping[str, str]
"""Generated parts of a document by name."""


@dataclass(frozen=True)
class Publication:
    """What is published of a folder of results, and where.

    Attributes
    ----------
    folder
        Folder of the copies, below the project's.
    document
        Document with the generated parts, below the project's folder.
    files
        Patterns of the published files, below the folder of results; each finds at least one.
    made_by
        Command that makes them.
    blocks
        Generated parts of the document from such a folder.
    further
        Further documents, which have some of the same parts; one that is not there is left out.
    others
        Text of further files that are made from such a folder, by their paths below the project's.
    """

    folder: Path
    document: Path
    files: tuple[str, ...]
    made_by: str
    blocks: Callable[[Path], Blocks]
    further: tuple[Path, ...] = ()
    others: Callable[[Path], Mapping[Path, str]] = lambda results: {}

    def write(self, results: Path, root: Path = Path()) -> list[Path]:
        """Copy finished results into the project, and rewrite what is made from them.

        Returns
        -------
        list of Path
            What was written.

        Raises
        ------
        DatasetError
            When a file is missing or unreadable; then nothing is written.
        ConfigError
            When the document is not there, or has lost a part.
        """
        contents = {
            self.folder / source.relative_to(results): source.read_bytes()
            for source in self._sources(results)
        }
        if not (root / self.document).exists():
            limit, remedy = "is not there", "publish from the folder of a clone of the project"
            raise ConfigError("document", brief(str(self.document)), limit, remedy)
        blocks = self.blocks(results)
        text = (root / self.document).read_text(encoding="utf-8")
        contents[self.document] = with_blocks(text, blocks).encode()
        for document in filter(lambda each: (root / each).exists(), self.further):
            text = (root / document).read_text(encoding="utf-8")
            own = {name: blocks[name] for name in blocks_in(text) if name in blocks}
            contents[document] = with_blocks(text, own).encode()
        for path, other in self.others(results).items():
            contents[path] = other.encode()
        for path, content in contents.items():
            with replacing(root / path) as temporary:
                temporary.write_bytes(content)
        return [root / path for path in contents]

    def _sources(self, results: Path) -> list[Path]:
        """Return the files that are published, in a fixed order."""
        found = []
        for pattern in self.files:
            matching = sorted(results.glob(pattern))
            if not matching:
                raise DatasetError(f"{results / pattern}: is missing; first {self.made_by}")
            found += matching
        return found


def with_blocks(document: str, blocks: Blocks) -> str:
    """Return a document with its generated parts replaced.

    Raises
    ------
    ConfigError
        When the document does not have each part's two marks once.
    """
    for name, text in blocks.items():
        begin, end = f"<!-- begin {name}: generated -->", f"<!-- end {name} -->"
        pattern = re.escape(begin) + r"\n.*?" + re.escape(end)
        whole = f"{begin}\n\n{text.strip()}\n\n{end}"
        places = re.findall(pattern, document, flags=re.DOTALL)
        if len(places) != 1:
            limit = f"is generated for {len(places)} places of the document"
            raise ConfigError("document", name, limit, f"keep one of {begin} ... {end}")
        document = document.replace(places[0], whole)
    return document


def blocks_in(document: str) -> dict[str, str]:
    """Return the generated parts that a document has, by name."""
    pattern = r"<!-- begin (\w+): generated -->\n(.*?)<!-- end \1 -->"
    return {name: text.strip() for name, text in re.findall(pattern, document, flags=re.DOTALL)}
