"""Mutated scenario files: each is accepted with all values in bounds, or refused in one line.

A failure names its kind and number, from which `text_of` and `tree_of` make the same file again.
``SOFTSLIP_FUZZ`` is the number of examples of each kind, for longer hunts.
"""

import copy
import datetime
import io
import math
import os
import re
import resource
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import annotated_types
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic.fields import FieldInfo
from ruamel.yaml import YAML

from softslip.config.fields import all_fields, value_at
from softslip.config.parameters import Parameters
from softslip.config.reading import LARGEST_FILE
from softslip.config.scenario import MOST_RUNS, SETTINGS, Scenario, load_scenario
from softslip.errors import ConfigError

EXAMPLES = int(os.environ.get("SOFTSLIP_FUZZ", "800"))
"""Number of examples of each of the random kinds."""

CHUNKS = 8
"""Parts of each kind, so that they can run side by side."""

MOST_WORK, LONGEST_WAIT = 5.0, 30.0
"""Seconds of work, and of waiting, after which a file counts as hanging its reader."""

MOST_MEMORY = 2**30
"""Bytes that reading a scenario may take."""

LONGEST_MESSAGE = 500
"""Characters of a message, the file's name not counted."""

FIELDS = all_fields(Parameters)
CONFIG = Path(__file__).parents[2] / "config"
FILES = sorted(path for path in CONFIG.glob("*.yaml") if path.stem != SETTINGS)
TEXTS = [path.read_bytes() for path in FILES]
TREES = [YAML(typ="safe", pure=True).load(text) for text in TEXTS]

Random = np.random.Generator


# --- the one thing that is tested -------------------------------------------------------------


@contextmanager
def limits() -> Iterator[None]:
    """Bound the time and the memory of the block."""

    def late(_signal: int, _frame: FrameType | None) -> None:
        # Not an `Exception`, which a reader might take for one of its own.
        raise pytest.fail.Exception(f"takes more than {MOST_WORK:g} s")

    clocks = {
        signal.ITIMER_PROF: (signal.SIGPROF, MOST_WORK),
        signal.ITIMER_REAL: (signal.SIGALRM, LONGEST_WAIT),
    }
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    previous = {number: signal.signal(number, late) for number, _ in clocks.values()}
    resource.setrlimit(resource.RLIMIT_AS, (used + MOST_MEMORY, before[1]))
    try:
        for clock, (_, seconds) in clocks.items():
            signal.setitimer(clock, seconds)
        yield
    finally:
        for clock in clocks:
            signal.setitimer(clock, 0)
        for number, handler in previous.items():
            signal.signal(number, handler)
        resource.setrlimit(resource.RLIMIT_AS, before)


def check(path: Path) -> Scenario | None:
    """Read a file; return the scenario, or None where it is refused as it should be."""
    try:
        with limits():
            scenario = load_scenario(str(path))
    except ConfigError as error:
        check_message(path, error)
        return None
    runs = scenario.runs()
    assert 0 < len(runs) <= MOST_RUNS
    assert scenario.description.isprintable()
    for run in (*runs[:2], *runs[-1:]):
        for name, field in FIELDS.items():
            assert_within(name, field, value_at(run.parameters, name))
    return scenario


def check_message(path: Path, error: ConfigError) -> None:
    message = str(error)
    assert message.splitlines() == [message], f"not one line: {message!r}"
    assert message.isprintable(), ascii(message)
    assert message.startswith(f"{path}: "), message
    rest = message.removeprefix(f"{path}: ")
    assert len(rest) <= LONGEST_MESSAGE, f"{len(rest)} characters: {rest}"
    assert "; " in rest, f"no remedy in {rest!r}"
    # Where the file is no mapping there is no key, and the file itself stands for it.
    assert rest.startswith(error.key) or error.key == str(path), f"{error.key!r} not in {rest!r}"
    if error.key != str(path):
        top = re.match(r"[^.\[ :]*", error.key)
        known = top is not None and top[0] in ("description", "base", "axes")
        unknown = "the keys at the top are" in rest or "second value of this key" in rest
        assert known or unknown, f"{error.key!r} is no key path"


def assert_within(name: str, field: FieldInfo, value: Any) -> None:
    """Check a number against the bounds that its field declares, without the models' own code."""
    if not isinstance(value, int | float):
        return
    assert math.isfinite(value), f"{name} = {value}"
    for rule in field.metadata:
        for kind, holds in BOUNDS.items():
            if isinstance(rule, kind):
                assert holds(value, rule), f"{name} = {value} breaks {rule}"


BOUNDS: dict[type, Callable[[float, Any], bool]] = {
    annotated_types.Ge: lambda value, rule: value >= rule.ge,
    annotated_types.Gt: lambda value, rule: value > rule.gt,
    annotated_types.Le: lambda value, rule: value <= rule.le,
    annotated_types.Lt: lambda value, rule: value < rule.lt,
}


def written(folder: Path, text: bytes) -> Path:
    path = folder / "case.yaml"
    path.write_bytes(text)
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fuzz")


def generator(kind: str, number: int) -> Random:
    return np.random.default_rng(np.random.SeedSequence([*kind.encode(), number]))


def chosen(random: Random, items: Any) -> Any:
    return items[int(random.integers(len(items)))]


def chunk(part: int) -> range:
    return range(part, EXAMPLES, CHUNKS)


@contextmanager
def named(kind: str, number: int) -> Iterator[None]:
    """Say which example failed."""
    try:
        yield
    except BaseException as error:
        error.add_note(f"made by {kind}_of({number})")
        raise


def test_the_files_of_the_project_are_accepted(folder: Path) -> None:
    for text in TEXTS:
        assert check(written(folder, text)) is not None


# --- mutated text -----------------------------------------------------------------------------

TOKENS = [
    *("~", "null", "Null", "yes", "no", "on", "off", "y", "n", "true", "TRUE", "False"),
    *(
        ".nan",
        ".NaN",
        ".inf",
        "-.inf",
        "1e999",
        "-1e999",
        "1e-999",
        "1e308",
        "5e-324",
        "-0",
        "-0.0",
    ),
    *("0x", "0xff", "0o17", "0o", "017", "0b1", "1_000", "_1", "1:30", "1.5e", "+.5", ".", "--1"),
    *("9" * 4000, "9" * 5000, "0x" + "f" * 4000, "1" + "0" * 400, "0." + "3" * 4000),
    *("2024-01-01", "2024-99-99", "2001-12-14t21:59:43.10-05:00", "00:00:00-99:00"),
    *("&a 1", "*a", "&a [*a]", "&b {b: *b}", "<<: *a", "<<: {a: 1}", "{<<: [{a: 1}]}", "=", "<<"),
    *("!!python/object:os.system x", "!!python/name:os.system", "!!set {a, b}", "!!omap [a: 1]"),
    *("!!binary aGVsbG8=", "!!binary é", "!!bool x", "!!int ''", "!!float x", "!!null 1", "!x 1"),
    *(
        "!!timestamp x",
        "!!str 1",
        "!!map [1]",
        "!!seq {}",
        "!",
        "!!",
        "!<tag:x> 1",
        "!!pairs [a: 1]",
    ),
    *(
        "'",
        '"',
        "'open",
        '"open',
        '"\\e[31m"',
        '"\\u202e"',
        '"\\ud800"',
        '"\\x"',
        '"\\n\\n"',
        "`ls`",
    ),
    *(
        "$(touch x)",
        "; rm",
        "|",
        ">",
        "|9",
        "|\n x",
        ">-\n x",
        "#",
        " #",
        "@",
        "%",
        "%YAML 1.1\n---",
    ),
    *("---", "...", "--- {}", "- ", "? ", ": ", "?", "[", "]", "{", "}", ",", "[]", "{}", "[[]]"),
    *(
        "? [a]\n: 1",
        "? {a: 1}\n: 1",
        "{a: 1, a: 2}",
        "[1, [2, [3]]]",
        "''",
        '""',
        "' '",
        "\t",
        "\r",
    ),
    *(
        "\x00",
        "\x07",
        "\x1b[31m",
        "\x7f",
        "\x85",
        "\xa0",
        "\u2028",
        "\u202e",
        "\ufeff",
        "🦆",
        "\u017f",
        "\u0661",
    ),
    *("x" * 2000, "[" * 2000, "{a: " * 2000, "- " * 2000, "a" * 1030 + ": 1", "k.l.m: [1]"),
]
"""What stands in a file where it should not, or looks like something else."""


def _line(text: bytes, random: Random) -> tuple[list[bytes], int]:
    lines = text.splitlines(keepends=True) or [b""]
    return lines, int(random.integers(len(lines)))


def _flip(text: bytes, random: Random) -> bytes:
    changed = bytearray(text or b"x")
    for _ in range(int(random.integers(1, 6))):
        changed[int(random.integers(len(changed)))] ^= int(random.integers(1, 256))
    return bytes(changed)


def _drop(text: bytes, random: Random) -> bytes:
    lines, at = _line(text, random)
    return b"".join(lines[:at] + lines[at + int(random.integers(1, 3)) :])


def _double(text: bytes, random: Random) -> bytes:
    lines, at = _line(text, random)
    return b"".join(lines[: at + 1] + lines[at:])


def _move(text: bytes, random: Random) -> bytes:
    lines, at = _line(text, random)
    line = lines.pop(at)
    lines.insert(int(random.integers(len(lines) + 1)), line)
    return b"".join(lines)


def _indent(text: bytes, random: Random) -> bytes:
    lines, at = _line(text, random)
    start = chosen(random, [b" ", b"  ", b"\t", b"\xc2\xa0", b"", b"- ", b"? ", b"#"])
    lines[at] = start + (lines[at] if random.integers(2) else lines[at].lstrip())
    return b"".join(lines)


def _cut(text: bytes, random: Random) -> bytes:
    first, last = sorted(int(place) for place in random.integers(0, len(text) + 1, 2))
    return text[:first] if random.integers(2) else text[:first] + text[last:]


def _insert(text: bytes, random: Random) -> bytes:
    at = int(random.integers(len(text) + 1))
    return text[:at] + chosen(random, TOKENS).encode() + text[at:]


def _scalar(text: bytes, random: Random) -> bytes:
    """Put something else in the place of a value."""
    places = list(re.finditer(rb"(?<=[:\[,] )[^\s\[\]{},#]+", text))
    if not places:
        return text
    found = chosen(random, places)
    return text[: found.start()] + chosen(random, TOKENS).encode() + text[found.end() :]


def _key(text: bytes, random: Random) -> bytes:
    """Put something else in the place of a key, often one that is known elsewhere."""
    places = list(re.finditer(rb"[A-Za-z_.]+(?=:)", text))
    if not places:
        return text
    found = chosen(random, places)
    word = chosen(random, [*FIELDS, "wall", "axes", "base", *TOKENS]).encode()
    return text[: found.start()] + word + text[found.end() :]


def _recode(text: bytes, random: Random) -> bytes:
    shown = text.decode("utf-8", "replace")
    codes = ["utf-16", "utf-16-le", "utf-32", "utf-8-sig", "utf-7", "cp500"]
    return shown.encode(chosen(random, codes), "replace")


def _endings(text: bytes, random: Random) -> bytes:
    ends = [b"\r\n", b"\r", b"\n\n", b"\n\r", b"\x0b\n", b" \n", b"\xc2\x85", b"\xe2\x80\xa8", b""]
    return text.replace(b"\n", chosen(random, ends))


def _bytes(text: bytes, random: Random) -> bytes:
    at = int(random.integers(len(text) + 1))
    return text[:at] + random.bytes(int(random.integers(1, 9))) + text[at:]


def _again(text: bytes, random: Random) -> bytes:
    return chosen(random, [text + text, text + b"---\n" + text, text + b"...\n" + text, text * 3])


EDITS = [
    *(_flip, _drop, _double, _move, _indent, _cut, _insert, _scalar, _key, _recode, _endings),
    *(_bytes, _again, _insert, _scalar, _key),
]


def text_of(number: int) -> bytes:
    """Return the mutated text of an example."""
    random = generator("text", number)
    text = chosen(random, TEXTS)
    for _ in range(int(random.integers(1, 4))):
        text = chosen(random, EDITS)(text, random)
    return bytes(text)


@pytest.mark.parametrize("part", range(CHUNKS))
def test_a_mutated_text_is_accepted_or_refused_in_one_line(folder: Path, part: int) -> None:
    for number in chunk(part):
        with named("text", number):
            check(written(folder, text_of(number)))


def test_mutated_texts_are_accepted_and_refused_for_many_reasons(folder: Path) -> None:
    """Examples that are all refused for one reason would show nothing."""
    accepted, reasons = 0, set()
    for number in range(200):
        path = written(folder, text_of(number))
        try:
            load_scenario(str(path))
            accepted += 1
        except ConfigError as error:
            reasons.add(re.sub(r"[^a-z ]", "", str(error).removeprefix(str(path)))[:30])
    assert accepted > 5, "hardly a file is accepted"
    assert len(reasons) > 30, f"only {len(reasons)} reasons"


# --- mutated trees ----------------------------------------------------------------------------

NUMBERS = [
    *(0, 1, -1, 2, 7, 10**3, 2**31, 2**63, -(2**63), 10**300, 10**400, 10**4000),
    *(0.0, -0.0, 0.5, -0.5, 1.5, 5e-324, 1e-300, 1e-12, 1e12, 1e300, 1.7976931348623157e308),
    *(math.nan, math.inf, -math.inf),
]
OTHERS = [
    *(
        None,
        True,
        False,
        "",
        " ",
        "x",
        "no",
        "1e-3",
        "null",
        ".nan",
        "rate",
        "ewald",
        "a\nb",
        "\x1b",
    ),
    *("x" * 5000, "\u202e", "🦆", b"", b"\xff\x00", datetime.date(2024, 1, 1)),
    *(datetime.datetime(2024, 1, 1, tzinfo=datetime.UTC), [], [None], [1], [[1]], [1, 1], ["x"]),
    *(
        [math.nan],
        list(range(50)),
        {},
        {"a": 1},
        {1: 2},
        {None: 1},
        {"": 1},
        {"x" * 900: 1},
        {1, 2},
    ),
]
WRONG: list[Any] = [*NUMBERS, *OTHERS]


def dumped(tree: Any) -> bytes:
    stream = io.StringIO()
    YAML(typ="safe", pure=True).dump(tree, stream)
    return stream.getvalue().encode("utf-8", "surrogatepass")


def placed(path: str, value: Any) -> dict[str, Any]:
    for name in reversed(path.split(".")):
        value = {name: value}
    return dict(value)


@pytest.mark.parametrize("path", FIELDS)
def test_every_kind_of_value_for_every_key_is_accepted_or_refused(folder: Path, path: str) -> None:
    for value in WRONG:
        check(written(folder, dumped({"description": "x", "base": placed(path, value)})))


@pytest.mark.parametrize("path", [*FIELDS, "wall", "", ".", "wall.", ".wall", "a.b.c", "wall.x.y"])
def test_every_kind_of_value_for_every_axis_is_accepted_or_refused(folder: Path, path: str) -> None:
    for value in WRONG:
        axis = value if isinstance(value, list) else [value]
        check(written(folder, dumped({"description": "x", "axes": {path: axis}})))
    check(written(folder, dumped({"description": "x", "axes": {path: 3}})))


@pytest.mark.parametrize("place", ["top", "description", "base", "axes", "base.wall", "axes.seed"])
def test_every_kind_of_value_for_every_group_is_accepted_or_refused(
    folder: Path, place: str
) -> None:
    for value in WRONG:
        tree = value if place == "top" else {"description": "x"} | placed(place, value)
        check(written(folder, dumped(tree)))


def _places(tree: Any, above: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    found = []
    if isinstance(tree, dict | list):
        for key in tree if isinstance(tree, dict) else range(len(tree)):
            found += [(*above, key), *_places(tree[key], (*above, key))]
    return found


def _extreme(random: Random, field: FieldInfo) -> Any:
    """Return a value within the bounds of a field, at any order of magnitude."""
    low, high = 1e-300, 1e300
    for rule in field.metadata:
        low = getattr(rule, "ge", None) or getattr(rule, "gt", None) or low
        high = getattr(rule, "le", None) or getattr(rule, "lt", None) or high
    choices = re.findall(r"'(\w+)'", str(field.annotation))
    if choices and random.integers(4):
        return chosen(random, choices)
    exponent = random.uniform(math.log10(low), math.log10(high))
    if not random.integers(3):
        exponent = chosen(random, [math.log10(low), math.log10(high), 0.0, -3.0])
    number = min(max(10.0 ** float(exponent), low), high)
    if "int" in str(field.annotation):
        return min(max(int(min(number, 1e18)), int(low)), int(min(high, 1e18)))
    return 0.0 if not random.integers(10) else number


def tree_of(number: int) -> Any:
    """Return the mutated tree of an example: wrong values, renamed keys, extremes within bounds."""
    random = generator("tree", number)
    tree = copy.deepcopy(chosen(random, TREES))
    for _ in range(int(random.integers(1, 5))):
        kind = int(random.integers(4))
        if kind == 0:
            path = chosen(random, list(FIELDS))
            section, _, name = path.rpartition(".")
            base = tree.get("base") or {}
            group = base.setdefault(section, {}) if section else base
            if isinstance(group, dict):
                group[name] = _extreme(random, FIELDS[path])
            tree["base"] = base
        elif kind == 1:
            path = chosen(random, list(FIELDS))
            count = int(random.integers(1, 4))
            axes = tree.get("axes") or {}
            if isinstance(axes, dict):
                axes[path] = [_extreme(random, FIELDS[path]) for _ in range(count)]
                tree["axes"] = axes
        else:
            _spoil(tree, random, rename=kind == 2)
        if not isinstance(tree.get("base", {}), dict | None):
            break
    return tree


def _spoil(tree: dict[Any, Any], random: Random, rename: bool) -> None:
    """Replace a value by a wrong one, or a key by another."""
    place = chosen(random, _places(tree) or [("description",)])
    node: Any = tree
    for step in place[:-1]:
        node = node[step]
    if rename and isinstance(node, dict):
        value = node.pop(place[-1], None)
        node[chosen(random, [*FIELDS, "wall", "Wall", "roughness", "", 1, None, "axes", 1.5])] = (
            value
        )
    else:
        node[place[-1]] = copy.deepcopy(chosen(random, WRONG))


@pytest.mark.parametrize("part", range(CHUNKS))
def test_a_mutated_tree_is_accepted_or_refused_in_one_line(folder: Path, part: int) -> None:
    for number in chunk(part):
        with named("tree", number):
            check(written(folder, dumped(tree_of(number))))


def test_mutated_trees_are_accepted_and_refused_for_many_reasons(folder: Path) -> None:
    accepted, keys = 0, set()
    for number in range(200):
        try:
            load_scenario(str(written(folder, dumped(tree_of(number)))))
            accepted += 1
        except ConfigError as error:
            keys.add(error.key)
    assert accepted > 5, "hardly a tree is accepted"
    assert len(keys) > 30, f"only {len(keys)} keys"


@given(
    tree=st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9) | st.binary(),
        lambda inner: (
            st.lists(inner, max_size=4)
            | st.dictionaries(st.sampled_from([*FIELDS, "wall", "seed", ""]) | st.integers(), inner)
        ),
        max_leaves=12,
    ),
    place=st.sampled_from(["base", "axes", "base.wall", "axes.seed", "description"]),
)
@settings(max_examples=EXAMPLES // 4)
def test_any_tree_is_accepted_or_refused_in_one_line(folder: Path, tree: Any, place: str) -> None:
    check(written(folder, dumped({"description": "x"} | placed(place, tree))))


# --- files that are meant to do harm ----------------------------------------------------------

HEAD = "description: x\n"


def laughs(levels: int, width: int, line: str) -> str:
    """Lines each of which names the one before it several times."""
    return "".join(
        f"  a{level}: &a{level} " + line % ", ".join([f"*a{level - 1}"] * width) + "\n"
        for level in range(1, levels)
    )


BOMBS = {
    "laughs": HEAD + "base:\n  a0: &a0 [x, x]\n" + laughs(30, 9, "[%s]"),
    "laughs in snapshots": HEAD
    + "x:\n  a0: &a0 [1, 1]\n"
    + laughs(30, 9, "[%s]")
    + "base: {recording: {snapshots: *a29}}",
    "merged laughs": HEAD + "base:\n  a0: &a0 {x: 1}\n" + laughs(30, 9, "{<<: [%s]}"),
    "keys of laughs": HEAD
    + "base:\n  a0: &a0 [x, x]\n"
    + laughs(30, 9, "[%s]")
    + "  ? *a29\n  : 1",
    "itself": "&a\ndescription: x\nbase: *a",
    "itself in an axis": HEAD + "axes: {seed: &a [*a, *a, *a]}",
    "itself merged": HEAD + "base: &a {<<: [*a, *a, *a]}",
    "deep lists": HEAD + "base: " + "[" * 10_000 + "]" * 10_000,
    "deep groups": HEAD + "base: " + "{a: " * 10_000 + "}" * 10_000,
    "deep open lists": HEAD + "base: " + "[" * 60_000,
    "deep lines": HEAD + "".join(" " * depth + "a:\n" for depth in range(350)),
    "deep dashes": HEAD + "base:\n  " + "- " * 20_000 + "1",
    "deep questions": "? " * 20_000,
    "deep within reach": HEAD + "base: {wall: " + "[" * 150 + "]" * 150 + "}",
    "many keys": HEAD + "base:\n" + "".join(f"  k{number}: 1\n" for number in range(5500)),
    "many anchors": HEAD + "".join(f"k{number}: &x{number} 1\n" for number in range(3500)),
    "many aliases": HEAD + "a: &a 1\nb: [" + "*a, " * 15_000 + "]",
    "many runs": HEAD + f"axes: {{seed: {list(range(9000))}}}",
    "far too many runs": HEAD + f"axes: {{seed: {list(range(1100))}, recording.stride: "
    f"{list(range(1, 1100))}}}",
    "runs beyond counting": HEAD
    + "axes:\n"
    + "".join(
        f"  {path}: {list(range(1, 400))}\n"
        for path in (
            "seed",
            "recording.stride",
            "recording.profile_interval",
            "packing.equilibration_steps",
        )
    ),
    "many axes": HEAD
    + "axes:\n"
    + "".join(f"  {path}: [{field.default}]\n" for path, field in FIELDS.items() if field.default),
    "many snapshots": HEAD
    + f"base: {{recording: {{snapshots: {[number / 100 for number in range(8000)]}}}}}",
    "a long number": HEAD + "base: {seed: " + "9" * 60_000 + "}",
    "a long hexadecimal number": HEAD + "base: {seed: 0x" + "f" * 60_000 + "}",
    "a long fraction": HEAD + "base: {wall: {roughness: 0." + "9" * 60_000 + "}}",
    "a long word": HEAD + "base: {wall: '" + "x" * 60_000 + "'}",
    "a long key": HEAD + "base:\n  ? " + "x" * 60_000 + "\n  : 1",
    "a long path": HEAD + "axes:\n  ? " + "a." * 30_000 + "b\n  : [1]",
    "a long path in a group": HEAD + "axes:\n  ? wall." + "r" * 60_000 + "\n  : [1]",
    "a long tag": HEAD + "base: !" + "x" * 60_000 + " 1",
    "a long description": "description: " + "x" * 60_000,
    "nothing but colons": ":" * 60_000,
    "nothing but lines": "\n" * 60_000,
    "a description in colours": 'description: "\\e[31mred"',
    "a key of odd spaces": HEAD + "'a  \xa0b': 1",
    "contacts of any range": HEAD + "base: {steric: {length: 1e300}}",
    "contacts of no range": HEAD + "base: {steric: {length: 5e-324}, hydrodynamics: "
    "{node_spacing: 5e-324}}",
    "membranes of no strength": HEAD + "base: {membrane: {elastic_constant: 1e-30}, "
    "rheometer: {stress: 0}}",
    "too large a file": "#" * (LARGEST_FILE + 1),
}
ACCEPTED = {"many runs", "many snapshots", "a long fraction", "a long description", "many axes"}


@pytest.mark.parametrize("name", BOMBS)
def test_a_file_that_is_meant_to_do_harm_does_none(folder: Path, name: str) -> None:
    found = check(written(folder, BOMBS[name].encode()))
    assert (found is not None) == (name in ACCEPTED), f"{name}: {found}"


def _fifo(path: Path) -> None:
    os.mkfifo(path)


def _sparse(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(2**40)


def _link(target: str) -> Callable[[Path], None]:
    return lambda path: path.symlink_to(target)


SPECIAL: dict[str, Callable[[Path], None]] = {
    "missing": lambda path: None,
    "empty": Path.touch,
    "folder": Path.mkdir,
    "fifo": _fifo,
    "huge": _sparse,
    "itself": _link("case.yaml"),
    "dangling": _link("nowhere/at/all"),
    "zero": _link("/dev/zero"),
    "terminal": _link("/dev/tty"),
    "random": _link("/dev/urandom"),
    "standard input": _link("/dev/stdin"),
    "made up by the system": _link("/proc/self/pagemap"),
    "memory": _link("/proc/self/mem"),
}


@pytest.mark.parametrize("name", SPECIAL)
def test_what_is_no_plain_file_is_refused_and_not_waited_for(tmp_path: Path, name: str) -> None:
    path = tmp_path / "case.yaml"
    SPECIAL[name](path)
    assert check(path) is None
