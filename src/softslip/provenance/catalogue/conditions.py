"""Conditions on named values, such as ``roughness == 0 and stress > 0.1``.

Written as in Python: ``== != < <= > >=``, ``in``, ``not in``, ``and or not``, parentheses, chains
such as ``0.1 < stress <= 0.5``, numbers, quoted text, ``True``, ``False`` and ``None``. Python only
parses them; nothing is run.

What has no value is neither true nor false: a condition on it holds nowhere, its opposite neither,
unless the rest decides. (That, dotted names and digests that are given by their first digits are
what `pandas.DataFrame.query` lacks.)
"""

import ast
import operator
import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from softslip.errors import ConfigError
from softslip.messages import brief, key_text

LONGEST = 2000
"""Characters of a condition at most."""

DEEPEST = 60
"""How deep its parts may lie within one another: far below what Python's own recursion allows."""

EXAMPLE = "roughness == 0 and stress > 0.1"

MISSING = object()
"""The value of something that has none."""

_ORDERS: Mapping[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_YAML: Mapping[str, Any] = {"true": True, "false": False, "null": None}
"""What YAML writes otherwise than Python."""

_INSTEAD = {"&&": "and", "||": "or", "<>": "!=", "!": "not", "=": "=="}
"""What people write who know other languages, and what it is here."""


@dataclass(frozen=True)
class Condition:
    """Something that holds or does not; see `parse`."""

    text: str
    names: frozenset[str]
    _tree: ast.expr
    _known: Collection[str]
    _prefixes: Collection[str]

    def holds(self, values: Mapping[str, Any]) -> bool:
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
        return _Evaluation(self.text, self._known, self._prefixes, values).truth(self._tree) is True


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
    # A line's end within a text would be no text, and elsewhere a blank does as well.
    text = " ".join(text.splitlines()).strip()
    if not text:
        raise ConfigError("query", "", "is empty", f"write for example {EXAMPLE}")
    if len(text) > LONGEST:
        limit = f"has more than {LONGEST} characters"
        raise ConfigError("query", brief(text), limit, "ask for less at once")
    tree = _tree(text)
    # Every part is looked at even where there are no values, so that all of it is checked.
    trial = _Evaluation(text, known, prefixes, {})
    trial.truth(tree)
    return Condition(text, frozenset(trial.names), tree, known, prefixes)


def _tree(text: str) -> ast.expr:
    try:
        with warnings.catch_warnings():
            # Python finds some of what is no condition odd, such as "1in x".
            warnings.simplefilter("ignore")
            return ast.parse(text, mode="eval").body
    except SyntaxError as error:
        place = min(max(error.offset or 1, 1), len(text) + 1)
        near = text[max(place - 2, 0) : place + 1]
        signs = (sign for sign in _INSTEAD if sign in near and not {"==", "!="} & {near[:2]})
        sign = next(signs, None)
        remedy = f"write {_INSTEAD[sign]} instead of {sign}" if sign else f"write as in {EXAMPLE}"
        raise _error(text, place, "cannot be read", remedy) from None
    except (ValueError, RecursionError, MemoryError):
        limit, remedy = "cannot be read", f"write for example {EXAMPLE}"
        raise ConfigError("query", brief(text), limit, remedy) from None


def _error(text: str, place: int, limit: str, remedy: str) -> ConfigError:
    at = f"{limit} at character {place}, {brief(text[place - 1 : place + 29] or 'the end')}"
    return ConfigError("query", brief(text), at, remedy)


@dataclass
class _Evaluation:
    """A condition's syntax tree with values for its names; a verdict of None is neither."""

    text: str
    known: Collection[str]
    prefixes: Collection[str]
    values: Mapping[str, Any]

    def __post_init__(self) -> None:
        self.names: set[str] = set()

    def truth(self, node: ast.expr, depth: int = 0) -> bool | None:
        """Return whether a part is true."""
        if depth > DEEPEST:
            raise self._error(node, "is nested too deeply", f"write at most {DEEPEST} levels")
        match node:
            case ast.BoolOp(op=kind, values=parts):
                verdicts = [self.truth(part, depth + 1) for part in parts]
                return _decided(verdicts, isinstance(kind, ast.Or))
            case ast.UnaryOp(op=ast.Not(), operand=part):
                return _opposite(self.truth(part, depth + 1))
            case ast.Compare(left=first, ops=kinds, comparators=others):
                links = zip([first, *others], kinds, others, strict=False)
                return _decided([self._link(node, *link) for link in links], False)
            case ast.Constant(value=bool() as value):
                return value
            case ast.Name() | ast.Attribute():
                value = self._named(node)
                if value is MISSING or value is None or isinstance(value, bool):
                    return None if value is MISSING else value
                limit = f"stands alone and is not a flag but {brief(value)}"
                raise self._error(node, limit, "compare it")
        raise self._refused(node)

    def _link(
        self, whole: ast.expr, left: ast.expr, kind: ast.cmpop, right: ast.expr
    ) -> bool | None:
        one = self._value(left)
        by_beginning = self._is_prefix(left) != self._is_prefix(right)
        match kind:
            case ast.In() | ast.NotIn():
                among = self._among(whole, one, self._listed(whole, right), by_beginning)
                return among if isinstance(kind, ast.In) else _opposite(among)
            case ast.Eq() | ast.NotEq():
                same = self._same(whole, one, self._value(right), by_beginning)
                return same if isinstance(kind, ast.Eq) else _opposite(same)
            case ast.Lt() | ast.LtE() | ast.Gt() | ast.GtE():
                other = self._value(right)
                if any(each is MISSING or each is None for each in (one, other)):
                    return None
                self._check_kinds(whole, one, other)
                if isinstance(one, bool):
                    raise self._error(whole, "orders flags", "compare flags by ==")
                return _ORDERS[type(kind)](one, other)
        raise self._error(whole, "compares with 'is'", "write == or !=")

    def _is_prefix(self, node: ast.expr) -> bool:
        return isinstance(node, ast.Name | ast.Attribute) and ast.unparse(node) in self.prefixes

    def _value(self, node: ast.expr) -> Any:
        """Return the value of one side of a comparison."""
        match node:
            case ast.Constant(value=None | bool() | int() | float() | str() as value):
                return value
            case ast.UnaryOp(
                op=ast.USub() | ast.UAdd() as sign,
                operand=ast.Constant(value=int() | float() as number),
            ) if not isinstance(number, bool):
                return -number if isinstance(sign, ast.USub) else number
            case ast.Name() | ast.Attribute():
                return self._named(node)
        raise self._refused(node)

    def _named(self, node: ast.Name | ast.Attribute) -> Any:
        """Return the value of a name."""
        name = ast.unparse(node)
        if name in self.known:
            self.names.add(name)
            return self.values.get(name, MISSING)
        if name in _YAML:
            return _YAML[name]
        known, leaf = sorted(self.known), name.rpartition(".")[2]
        near = get_close_matches(name, known, n=3)
        near += [each for each in known if each.endswith(f".{leaf}")][:3]
        choice = f"did you mean {', '.join(dict.fromkeys(near))}?" if near else ""
        remedy = choice or f"the names are {', '.join(known)}"
        raise self._error(node, f"asks for {key_text(name)}, which is unknown", remedy)

    def _listed(self, whole: ast.expr, node: ast.expr) -> Any:
        """Return what stands right of ``in``: a list, or `MISSING`."""
        if isinstance(node, ast.Tuple | ast.List | ast.Set):
            return [self._value(each) for each in node.elts]
        value = self._value(node)
        if not isinstance(node, ast.Name | ast.Attribute):
            # One value in parentheses is no list in Python, but is meant as one.
            return [value]
        if value is not MISSING and not isinstance(value, list | tuple):
            limit = f"looks into {brief(value)}, which is no list"
            raise self._error(whole, limit, "write ==")
        return value

    def _among(self, whole: ast.expr, one: Any, listed: Any, by_beginning: bool) -> bool | None:
        if one is MISSING or listed is MISSING:
            return None
        return any([self._same(whole, one, each, by_beginning) for each in listed])

    def _same(self, whole: ast.expr, one: Any, other: Any, by_beginning: bool) -> bool | None:
        if one is MISSING or other is MISSING:
            return None
        if one is None or other is None:
            return one is other
        self._check_kinds(whole, one, other)
        if by_beginning:
            shorter, longer = sorted((one, other), key=len)
            return bool(shorter) and bool(longer.startswith(shorter))
        return bool(one == other)

    def _check_kinds(self, whole: ast.expr, one: Any, other: Any) -> None:
        """Refuse to compare values of two kinds."""
        if _kind(one) != _kind(other):
            limit = f"compares {brief(one)}, {_kind(one)}, with {brief(other)}, {_kind(other)}"
            raise self._error(whole, limit, "compare like with like, texts in quotes")

    def _refused(self, node: ast.expr) -> ConfigError:
        match node:
            case ast.BinOp(op=ast.BitAnd()):
                return self._error(node, "has &", "write and instead")
            case ast.BinOp(op=ast.BitOr()):
                return self._error(node, "has |", "write or instead")
        remedy = f"use ==, !=, <, <=, >, >=, in, and, or and not, as in {EXAMPLE}"
        return self._error(node, "has something else than comparisons of names and values", remedy)

    def _error(self, node: ast.expr, limit: str, remedy: str) -> ConfigError:
        # Offsets count bytes.
        before = self.text.encode()[: node.col_offset].decode("utf-8", "replace")
        return _error(self.text, len(before) + 1, limit, remedy)


def _kind(value: object) -> str:
    kinds = {bool: "a flag", str: "a text", int | float: "a number", object: "a list"}
    return next(name for kind, name in kinds.items() if isinstance(value, kind))


def _opposite(verdict: bool | None) -> bool | None:
    return None if verdict is None else not verdict


def _decided(verdicts: Collection[bool | None], deciding: bool) -> bool | None:
    """Return what ``and`` (False decides) or ``or`` (True decides) makes of some verdicts."""
    if deciding in verdicts:
        return deciding
    return None if None in verdicts else not deciding
