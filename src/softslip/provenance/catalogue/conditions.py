"""Conditions on named values, such as ``roughness == 0 and stress > 0.1``.

The grammar is a small part of Python's expressions: ``== != < <= > >=``, ``in`` and ``not in``,
``and or not``, parentheses, chains such as ``0.1 < stress <= 0.5``, numbers, quoted text, ``True``,
``False`` and ``None``. Python only parses it; nothing is ever run.

What something has no value for is neither true nor false: a condition on it holds nowhere, its
opposite neither, unless the rest decides.
"""

import ast
import operator
import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import partial
from typing import Any

from softslip.errors import ConfigError
from softslip.messages import brief, key_text

LONGEST = 2000
"""Characters of a condition at most."""

DEEPEST = 60
"""How deep its parts may lie within one another: far below what Python's own recursion allows."""

EXAMPLE = "roughness == 0 and stress > 0.1"

Names = Mapping[str, Any]
Verdict = bool | None
Part = Callable[[Names], Any]

MISSING = object()
"""The value of something that has none."""

_ORDER: Mapping[type[ast.cmpop], tuple[str, Callable[[Any, Any], bool]]] = {
    ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le),
    ast.Gt: (">", operator.gt),
    ast.GtE: (">=", operator.ge),
}
_SAME: Mapping[type[ast.cmpop], str] = {ast.Eq: "==", ast.NotEq: "!="}
_AMONG: Mapping[type[ast.cmpop], str] = {ast.In: "in", ast.NotIn: "not in"}
_WORDS: Mapping[str, Any] = {"true": True, "false": False, "null": None}
"""YAML's words for what Python writes otherwise."""


@dataclass(frozen=True)
class Condition:
    """Something that holds or does not.

    Attributes
    ----------
    text
        As it was written.
    names
        That it asks about.
    """

    text: str
    names: frozenset[str]
    _verdict: Part

    def holds(self, values: Names) -> bool:
        """Return whether it is true of some values.

        Parameters
        ----------
        values
            By their names; what is left out, or is `MISSING`, has no value.

        Raises
        ------
        ConfigError
            When things are compared that cannot be, such as a number with a text.
        """
        return self._verdict(values) is True


def parse(text: str, known: Collection[str], prefixes: Collection[str] = ()) -> Condition:
    """Read a condition.

    Parameters
    ----------
    text
        What to read.
    known
        Names that it may ask about, dotted or not.
    prefixes
        Those of them, such as digests, that are equal to every text that they begin with.

    Raises
    ------
    ConfigError
        In one sentence with the place at which it goes wrong and what could stand there.
    """
    return _Reader(text, known, prefixes).read()


class _Reader:
    """Turns a condition's syntax tree into functions of the values."""

    def __init__(self, text: str, known: Collection[str], prefixes: Collection[str]) -> None:
        # A line's end within a text would be no text, and elsewhere a blank does as well.
        self.text = " ".join(text.splitlines()).strip()
        self.known = known
        self.prefixes = prefixes
        self.names: set[str] = set()

    def read(self) -> Condition:
        if not self.text:
            raise self._error(None, "is empty", f"write for example {EXAMPLE}")
        if len(self.text) > LONGEST:
            raise self._error(None, f"has more than {LONGEST} characters", "ask for less at once")
        verdict = self._truth(self._parsed(), 0)
        return Condition(self.text, frozenset(self.names), verdict)

    def _parsed(self) -> ast.expr:
        try:
            with warnings.catch_warnings():
                # Of what Python finds odd, such as "1in x"; it is not told to anybody.
                warnings.simplefilter("ignore")
                return ast.parse(self.text, mode="eval").body
        except SyntaxError as error:
            place = min(max(error.offset or 1, 1), len(self.text) + 1)
            raise self._at(place, "cannot be read", self._syntax_remedy(place)) from None
        except (ValueError, RecursionError, MemoryError):
            raise self._error(None, "cannot be read", f"write for example {EXAMPLE}") from None

    def _syntax_remedy(self, place: int) -> str:
        rest = self.text[place - 1 :]
        if rest.startswith("=") and not rest.startswith("=="):
            return "write == to compare"
        for sign, word in (("&&", "and"), ("||", "or"), ("!", "not"), ("<>", "!=")):
            if rest.startswith(sign) or self.text[max(place - 2, 0) :].startswith(sign):
                return f"write {word} instead of {sign}"
        return f"write for example {EXAMPLE}, and texts in quotes"

    def _truth(self, node: ast.expr, depth: int) -> Part:
        """Return the function that says whether a part is true: True, False or None."""
        if depth > DEEPEST:
            raise self._error(node, "is nested too deeply", f"at most {DEEPEST} levels are read")
        if isinstance(node, ast.BoolOp):
            parts = tuple(self._truth(each, depth + 1) for each in node.values)
            return partial(_any if isinstance(node.op, ast.Or) else _all, parts)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return partial(_not, self._truth(node.operand, depth + 1))
        if isinstance(node, ast.Compare):
            return self._chain(node)
        if isinstance(node, ast.Constant) and isinstance(node.value, bool):
            return partial(_constant, node.value)
        if isinstance(node, ast.Name | ast.Attribute):
            return partial(self._flag, node, self._name(node))
        raise self._refused(node)

    def _flag(self, node: ast.expr, name: str, values: Names) -> Verdict:
        value = values.get(name, MISSING)
        if value is MISSING or value is None:
            return None
        if isinstance(value, bool):
            return value
        raise self._error(node, f"stands alone and is no flag but {brief(value)}", "compare it")

    def _chain(self, node: ast.Compare) -> Part:
        sides = [node.left, *node.comparators]
        links = tuple(
            self._link(node, kind, left, right)
            for kind, left, right in zip(node.ops, sides, sides[1:], strict=False)
        )
        return partial(_all, links)

    def _link(self, node: ast.Compare, kind: ast.cmpop, left: ast.expr, right: ast.expr) -> Part:
        if type(kind) in _AMONG:
            among = partial(self._among, node, self._value(left), self._list(right))
            if isinstance(left, ast.Name | ast.Attribute):
                among.keywords["by_prefix"] = self._name(left) in self.prefixes
            return partial(_not, among) if isinstance(kind, ast.NotIn) else among
        if type(kind) in _SAME:
            same = partial(self._same, node, self._value(left), self._value(right))
            same.keywords["by_prefix"] = self._begins(left, right)
            return partial(_not, same) if isinstance(kind, ast.NotEq) else same
        if type(kind) in _ORDER:
            return partial(self._ordered, node, type(kind), self._value(left), self._value(right))
        raise self._error(node, "compares with 'is'", "write == or !=")

    def _begins(self, left: ast.expr, right: ast.expr) -> bool:
        """Return whether two sides are compared by their beginning: a name that allows it."""
        names = [each for each in (left, right) if isinstance(each, ast.Name | ast.Attribute)]
        return len(names) == 1 and self._name(names[0]) in self.prefixes

    def _value(self, node: ast.expr) -> Part:
        """Return the function that gives the value of one side of a comparison."""
        if isinstance(node, ast.Name | ast.Attribute):
            dotted = _dotted(node)
            if dotted is not None and dotted in _WORDS and dotted not in self.known:
                return partial(_constant, _WORDS[dotted])
            return partial(_looked_up, self._name(node))
        return partial(_constant, self._literal(node))

    def _literal(self, node: ast.expr) -> Any:
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            inner = node.operand
            value = self._literal(inner) if isinstance(inner, ast.Constant) else None
            if isinstance(value, int | float) and not isinstance(value, bool):
                return -value if isinstance(node.op, ast.USub) else value
        if isinstance(node, ast.Constant) and (
            node.value is None or isinstance(node.value, bool | str) or _is_number(node.value)
        ):
            return node.value
        raise self._refused(node)

    def _list(self, node: ast.expr) -> Part:
        """Return the function that gives what stands right of ``in``."""
        if isinstance(node, ast.Tuple | ast.List | ast.Set):
            return partial(_constant, [self._literal(each) for each in node.elts])
        if isinstance(node, ast.Name | ast.Attribute):
            return partial(_looked_up, self._name(node))
        # One value in parentheses is no list in Python, but is meant as one.
        return partial(_constant, [self._literal(node)])

    def _name(self, node: ast.Name | ast.Attribute) -> str:
        """Return a name that is known.

        Raises
        ------
        ConfigError
            When it is not.
        """
        name = _dotted(node)
        if name is None:
            raise self._refused(node)
        if name not in self.known:
            near = get_close_matches(name, sorted(self.known), n=3, cutoff=0.6)
            leaf = name.rpartition(".")[2]
            near += [each for each in sorted(self.known) if each.endswith(f".{leaf}")][:3]
            choice = ", ".join(dict.fromkeys(near)) or ", ".join(sorted(self.known))
            words = "did you mean" if near else "the names are"
            end = "?" if near else ""
            raise self._error(
                node, f"asks for {key_text(name)}, which is unknown", f"{words} {choice}{end}"
            )
        self.names.add(name)
        return name

    def _same(
        self, node: ast.expr, left: Part, right: Part, values: Names, *, by_prefix: bool
    ) -> Verdict:
        return self._equal(node, left(values), right(values), by_prefix=by_prefix)

    def _equal(self, node: ast.expr, one: Any, other: Any, *, by_prefix: bool) -> Verdict:
        if one is MISSING or other is MISSING:
            return None
        if one is None or other is None:
            return one is other
        self._comparable(node, one, other)
        if by_prefix:
            longer, shorter = sorted((one, other), key=len, reverse=True)
            return bool(shorter) and bool(longer.startswith(shorter))
        return bool(one == other)

    def _among(
        self, node: ast.expr, left: Part, right: Part, values: Names, *, by_prefix: bool = False
    ) -> Verdict:
        one, listed = left(values), right(values)
        if one is MISSING or listed is MISSING:
            return None
        if not isinstance(listed, list | tuple):
            raise self._error(node, f"looks into {brief(listed)}, which is no list", "write ==")
        found = [self._equal(node, one, each, by_prefix=by_prefix) for each in listed]
        return any(found)

    def _ordered(
        self, node: ast.expr, kind: type[ast.cmpop], left: Part, right: Part, values: Names
    ) -> Verdict:
        one, other = left(values), right(values)
        if any(each is MISSING or each is None for each in (one, other)):
            return None
        self._comparable(node, one, other)
        sign, before = _ORDER[kind]
        if isinstance(one, bool):
            raise self._error(node, f"orders flags by {sign}", "compare flags by ==")
        return bool(before(one, other))

    def _comparable(self, node: ast.expr, one: Any, other: Any) -> None:
        """Refuse to compare values of two kinds.

        Raises
        ------
        ConfigError
            When they are of two kinds.
        """
        if _kind(one) != _kind(other):
            limit = f"compares {brief(one)}, {_kind(one)}, with {brief(other)}, {_kind(other)}"
            raise self._error(node, limit, "compare like with like, texts in quotes")

    def _refused(self, node: ast.expr) -> ConfigError:
        what = _KINDS.get(type(node), "something else than names and values")
        remedy = f"use ==, !=, <, <=, >, >=, in, and, or and not, as in {EXAMPLE}"
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitAnd | ast.BitOr):
            sign, word = ("&", "and") if isinstance(node.op, ast.BitAnd) else ("|", "or")
            what, remedy = f"has {sign}", f"write {word} instead"
        return self._error(node, what, remedy)

    def _error(self, node: ast.expr | None, limit: str, remedy: str) -> ConfigError:
        if node is None:
            return ConfigError("query", brief(self.text), limit, remedy)
        # Offsets count bytes.
        before = self.text.encode()[: node.col_offset].decode("utf-8", "replace")
        return self._at(len(before) + 1, limit, remedy)

    def _at(self, place: int, limit: str, remedy: str) -> ConfigError:
        there = self.text[place - 1 : place + 29] or "the end"
        told = f"{limit} at character {place}, {brief(there)}"
        return ConfigError("query", brief(self.text), told, remedy)


_KINDS: Mapping[type[ast.expr], str] = {
    ast.Call: "has a call",
    ast.Subscript: "has brackets after a name",
    ast.BinOp: "has arithmetic",
    ast.Lambda: "has a lambda",
    ast.IfExp: "has a choice",
    ast.NamedExpr: "assigns",
    ast.JoinedStr: "has a formatted text",
    ast.Tuple: "has a list where none belongs",
    ast.List: "has a list where none belongs",
    ast.Attribute: "looks into something that is no name",
    ast.Constant: "has a value that is compared with nothing, or of a kind that no name has",
}


def _dotted(node: ast.expr) -> str | None:
    """Return a name with dots, None for anything else."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    if not isinstance(node, ast.Name):
        return None
    return ".".join([node.id, *reversed(parts)])


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _kind(value: object) -> str:
    if isinstance(value, bool):
        return "a flag"
    if isinstance(value, str):
        return "a text"
    return "a number" if _is_number(value) else "a list"


def _constant(value: Any, values: Names) -> Any:
    return value


def _looked_up(name: str, values: Names) -> Any:
    return values.get(name, MISSING)


def _not(part: Part, values: Names) -> Verdict:
    verdict = part(values)
    return None if verdict is None else not verdict


def _all(parts: tuple[Part, ...], values: Names) -> Verdict:
    verdicts = [part(values) for part in parts]
    if False in verdicts:
        return False
    return None if None in verdicts else True


def _any(parts: tuple[Part, ...], values: Names) -> Verdict:
    verdicts = [part(values) for part in parts]
    if True in verdicts:
        return True
    return None if None in verdicts else False
