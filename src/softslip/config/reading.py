"""Strict reading of a YAML file: version 1.2, one document, no key twice, a mapping at the top."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.constructor import ConstructorError, DuplicateKeyError, SafeConstructor
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from softslip.config.fields import path_of
from softslip.errors import ConfigError
from softslip.messages import NOTHING, Verbatim, brief, file_text, key_text

LARGEST_FILE = 2**16
"""Size in bytes above which a file is no scenario; the parser takes a second for so much."""


def read_mapping(path: Path) -> dict[Any, Any]:
    """Read a YAML file that holds one mapping.

    Under YAML 1.2 ``1e-3`` is a number and ``no`` is text.

    Raises
    ------
    ConfigError
        When the file is missing, unreadable, empty, not text, not YAML, holds more than one
        document, a key twice, or something other than a mapping.
    """
    text = _text(path)
    if re.search(r"^%", text, flags=re.MULTILINE):
        raise _refused(path, "has a YAML directive", "remove the line that starts with %")
    try:
        tree = _parser().load(text)
    except DuplicateKeyError as error:
        raise _duplicate(path, text, error) from None
    except MarkedYAMLError as error:
        raise _refused(path, f"{_line(error)}{error.problem}", "correct the YAML") from None
    except RecursionError:
        raise _refused(path, "is nested too deeply", "use at most two levels of keys") from None
    # The constructors of explicitly tagged scalars, such as "!!bool x", raise these bare.
    except (YAMLError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise _refused(path, f"is not valid YAML: {error}", "correct the YAML") from None
    if tree is None:
        raise _refused(path, "is empty", "start from a copy of config/demo.yaml")
    if not isinstance(tree, dict):
        raise _refused(
            path, "has no mapping at the top", "write description:, base: and axes: at the top"
        )
    return tree


class _Constructor(SafeConstructor):
    """Makes values without the merge keys of YAML 1.1, of which a few lines can hold billions."""

    def flatten_mapping(self, node: MappingNode) -> None:
        """Refuse a merge key instead of copying what it names."""
        for key, _ in node.value:
            if key.tag == "tag:yaml.org,2002:merge":
                problem = "found a merge key, which YAML 1.2 does not have"
                raise ConstructorError(None, None, problem, key.start_mark)


def _parser() -> YAML:
    # The compiled parser that may be installed beside the pure one reads YAML 1.1.
    parser = YAML(typ="safe", pure=True)
    parser.Constructor = _Constructor
    parser.allow_duplicate_keys = False
    return parser


def _text(path: Path) -> str:
    try:
        if not path.exists():
            raise _refused(path, "does not exist", "check the name and the current directory")
        if not path.is_file():
            raise _refused(path, "is not a file", "name a YAML file")
        # Not by its size: that of a file which the system makes up as it is read is 0.
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise _refused(path, f"cannot be read ({reason})", "check its permissions") from None
    except ValueError as error:
        raise _refused(path, f"is not a file name ({error})", "name a YAML file") from None
    if len(content) > LARGEST_FILE:
        raise _refused(path, f"is larger than {LARGEST_FILE} bytes", "name a scenario file")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _refused(
            path, f"is not UTF-8 text (byte {error.start})", "name a YAML file saved as UTF-8"
        ) from None


def _refused(path: Path, limit: str, remedy: str) -> ConfigError:
    return ConfigError(file_text(path), NOTHING, _plain(limit), remedy)


def _plain(text: str) -> str:
    """Return a parser's message as one short line of printable text."""
    line = " ".join(text.split())
    line = "".join(sign if sign.isprintable() else ascii(sign)[1:-1] for sign in line)
    return line if len(line) <= 200 else f"{line[:197]}..."


def _line(error: MarkedYAMLError) -> str:
    mark = error.problem_mark or error.context_mark
    return "" if mark is None else f"line {mark.line + 1}, column {mark.column + 1}: "


def relocated(error: ConfigError, key: str, note: str = "") -> ConfigError:
    """Return an error about a parameter with its key as the file has it.

    Parameters
    ----------
    error
        An error about a parameter.
    key
        Where the file gives the offending value, such as ``base.wall.roughness``.
    note
        What the reader must know besides, put in brackets at the end.
    """
    rest = str(error).removeprefix(error.key)
    error.args = (f"{key}{rest} ({note})" if note else f"{key}{rest}",)
    error.key = key
    return error


def in_file(path: Path, error: ConfigError) -> ConfigError:
    """Return an error with the file's name in front; its ``key`` stays as it is."""
    error.args = (" ".join(f"{file_text(path)}: {error}".split()),)
    return error


def _duplicate(path: Path, text: str, error: DuplicateKeyError) -> ConfigError:
    """Return the error about a key that comes twice, with its whole path."""
    for location, value in _repeated(_parser().compose(text), (), set()):
        key = key_text(path_of(location))
        where = _line(error).rstrip(": ")
        limit = f"is the second value of this key ({where})"
        return in_file(path, ConfigError(key, brief(value), limit, "keep one of them"))
    return _refused(path, f"{_line(error)}{error.problem}", "keep one of them")


def _repeated(
    node: Node | None, location: tuple[int | str, ...], visited: set[int]
) -> Iterator[tuple[tuple[int | str, ...], object]]:
    """Yield the location and the value of each key that its mapping holds already."""
    if id(node) in visited:  # An alias may lead back to where it stands.
        return
    visited.add(id(node))
    if isinstance(node, SequenceNode):
        for index, item in enumerate(node.value):
            yield from _repeated(item, (*location, index), visited)
    if not isinstance(node, MappingNode):
        return
    seen: set[str] = set()
    for key, item in node.value:
        if not isinstance(key, ScalarNode):
            continue
        if key.value in seen:
            value = item.value if isinstance(item, ScalarNode) else "a group or list"
            yield (*location, key.value), Verbatim(value)
        seen.add(key.value)
        yield from _repeated(item, (*location, key.value), visited)
