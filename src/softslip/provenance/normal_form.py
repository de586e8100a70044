"""Code as text without what has no effect on what it computes.

Left out are comments, formatting, docstrings and all other bare constants, ``pass``, annotations,
what is imported for types only, and the wording of errors: ``raise NumericalError(...)`` keeps its
type and the condition under which it is raised, but not its arguments, and so are the description
and the unit of a field of a model. The text also leaves out
what the syntax trees of different Python versions write differently.
"""

import ast
import builtins
from collections.abc import Callable
from typing import Any

PLAIN_DECORATORS = frozenset(
    {"abstractmethod", "cache", "cached_property", "classmethod", "compiled"}
    | {"compiled_exactly", "contextmanager", "dataclass", "intrinsic", "lru_cache"}
    | {"property", "staticmethod", "styled", "wraps"}
)
"""Decorators that read no annotation, and do nothing but wrap what they decorate."""

PLAIN_BASES = frozenset({"ABC", "Generic", "Protocol"})
"""Base classes that read no annotation."""

FIELD_MAKERS = frozenset({"Field", "quantity"})
"""Functions that make a field of a validated model from its default, its bounds and its meaning."""

_MEANING = frozenset({"description", "label", "symbol", "unit"})
"""What they only show to people."""

_FOLLOWING = frozenset({"ctx", "kind", "type_comment"})
"""Fields of syntax trees that follow from the place of a node, or are mere spelling."""

_FIELD_MARKS = frozenset({"ClassVar", "InitVar", "KW_ONLY"})
"""Annotations that say what a dataclass makes of a field."""

_WORDING = "Wording()"


class Names:
    """What the names in a piece of code are bound to: here, nothing that is known."""

    def reference(self, node: ast.expr) -> str | None:
        """Return the text for a name or attribute bound outside the code, if it is."""
        return None

    def is_wording(self, node: ast.expr) -> bool:
        """Return whether a name is bound to a constant text of a module."""
        return False

    def makes_error(self, node: ast.expr) -> bool:
        """Return whether a name is bound to a function that returns or raises an error."""
        return False

    def is_known_error(self, node: ast.expr) -> bool:
        """Return whether a name is bound to an error whose arguments are read by people only."""
        return isinstance(node, ast.Name) and is_builtin_error(node.id)

    def is_outside(self, node: ast.expr) -> bool:
        """Return whether a name is bound to something that is not followed."""
        return False

    def imported(self, node: ast.Import | ast.ImportFrom) -> str:
        """Return the text for an import within a function."""
        names = ",".join(f"{alias.name} as {alias.asname}" for alias in node.names)
        return f"Import({getattr(node, 'level', 0)},{getattr(node, 'module', '')},{names})"


def normal_form(source: bytes) -> str:
    """Return the text of a module, with names as they are written.

    Raises
    ------
    SyntaxError
        When it is no Python.
    """
    return Writer(Names()).text(ast.parse(source))


def is_builtin_error(name: str) -> bool:
    """Return whether a name is that of an exception of Python's that carries a text."""
    kind = getattr(builtins, name, None)
    # A StopIteration carries what a generator returns.
    return isinstance(kind, type) and issubclass(kind, Exception) and name[:4] != "Stop"


def makes_error(statement: ast.stmt) -> bool:
    """Return whether a function does nothing but return or raise an error, by its annotation."""
    if not isinstance(statement, ast.FunctionDef) or statement.returns is None:
        return False
    name = last_name(statement.returns)
    return name == "NoReturn" or name.endswith("Error")


def is_for_types(statement: ast.stmt) -> bool:
    """Return whether a statement only imports for annotations."""
    return isinstance(statement, ast.If) and last_name(statement.test) == "TYPE_CHECKING"


def last_name(node: ast.expr) -> str:
    """Return the last part of a dotted name, also of one that is called."""
    if isinstance(node, ast.Call):
        return last_name(node.func)
    if isinstance(node, ast.Constant):
        return str(node.value).rpartition(".")[2]
    return str(getattr(node, "attr", getattr(node, "id", "")))


class Writer:
    """Writes syntax trees as text."""

    def __init__(self, names: Names) -> None:
        self._names = names
        self._wordless = False
        self._annotated = False

    def text(self, value: object) -> str:
        """Return the text of a node, of a list of nodes, or of a constant."""
        if isinstance(value, ast.AST):
            name = value.__class__.__name__
            write = _WRITERS.get(name)
            written = write(self, value) if write else None
            return self._node(value) if written is None else written
        if isinstance(value, list):
            return f"[{','.join([self.text(item) for item in value if not _is_idle(item)])}]"
        if isinstance(value, int):
            return str(value)
        # Which characters repr shows as they are depends on the Unicode tables of this Python.
        return ascii(value)

    def _node(self, node: ast.AST, **instead: object) -> str:
        parts = []
        # Fields that are empty are left out: so are those that later versions of Python add.
        for name in node._fields:
            part = instead[name] if name in instead else getattr(node, name, None)
            if part is None or name in _FOLLOWING:
                continue
            if not isinstance(part, list) or not all(map(_is_idle, part)):
                parts.append(f"{name}={self.text(part)}")
        return f"{node.__class__.__name__}({','.join(parts)})"

    def _Name(self, node: ast.Name | ast.Attribute) -> str | None:
        if self._wordless and self._names.is_wording(node):
            return _WORDING
        return self._names.reference(node)

    _Attribute = _Name

    def _Constant(self, node: ast.Constant) -> str | None:
        return _WORDING if self._wordless and isinstance(node.value, str) else None

    def _JoinedStr(self, node: ast.JoinedStr) -> str:
        if self._wordless and not _has_effect(node):
            return _WORDING
        # Python 3.12 ends some format specifications with an empty string.
        values = [part for part in node.values if getattr(part, "value", None) != ""]
        return self._node(node, values=values)

    def _Call(self, node: ast.Call) -> str | None:
        if self._names.is_known_error(node.func) and not _has_effect(node):
            return f"Error({self.text(node.func)})"
        if last_name(node) in FIELD_MAKERS and self._names.is_outside(node.func):
            keywords = [word for word in node.keywords if word.arg not in _MEANING]
            return self._node(node, keywords=keywords)
        if self._wordless or not self._names.makes_error(node.func):
            return None
        self._wordless = True
        try:
            return self._node(node)
        finally:
            self._wordless = False

    def _Assert(self, node: ast.Assert) -> str:
        return self._node(node, msg=None)

    def _If(self, node: ast.If) -> str | None:
        return self.text(node.orelse) if is_for_types(node) else None

    def _Import(self, node: ast.Import | ast.ImportFrom) -> str:
        return self._names.imported(node)

    _ImportFrom = _Import

    def _FunctionDef(self, node: ast.FunctionDef) -> str:
        before = self._annotated, self._wordless
        self._annotated = bool(_unknown(node.decorator_list))
        self._wordless |= makes_error(node)
        try:
            return self._node(node) if self._annotated else self._node(node, returns=None)
        finally:
            self._annotated, self._wordless = before

    def _arg(self, node: ast.arg) -> str:
        return self._node(node) if self._annotated else self._node(node, annotation=None)

    def _AnnAssign(self, node: ast.AnnAssign) -> str:
        if node.value is None:
            return f"Declared({self.text(node.target)})"
        return f"Assign(targets=[{self.text(node.target)}],value={self.text(node.value)})"

    def _ClassDef(self, node: ast.ClassDef) -> str:
        readers = [base for base in node.bases if _base_name(base) not in PLAIN_BASES]
        kept = bool(readers or node.keywords or _unknown(node.decorator_list))
        body = ",".join(
            self._field(item, kept) if isinstance(item, ast.AnnAssign) else self.text(item)
            for item in node.body
            if not _is_idle(item)
        )
        return f"{self._node(node, body=None)}[{body}]"

    def _field(self, node: ast.AnnAssign, kept: bool) -> str:
        parts = (part for part in ast.walk(node.annotation) if isinstance(part, ast.expr))
        if kept or any(last_name(part) in _FIELD_MARKS for part in parts):
            return self._node(node)
        return self._node(node, annotation=None)


def _unknown(decorators: list[ast.expr]) -> list[ast.expr]:
    return [one for one in decorators if last_name(one) not in PLAIN_DECORATORS]


def _is_idle(item: object) -> bool:
    """Return whether something in a list of the tree has no effect on what the code computes."""
    if not isinstance(item, ast.stmt):
        return False
    if isinstance(item, ast.Expr):
        return isinstance(item.value, ast.Constant)
    return isinstance(item, ast.Pass) or (is_for_types(item) and not getattr(item, "orelse", None))


def _has_effect(node: ast.AST) -> bool:
    effects = (ast.NamedExpr, ast.Yield, ast.YieldFrom, ast.Await)
    return any(isinstance(part, effects) for part in ast.walk(node))


def _base_name(base: ast.expr) -> str:
    return last_name(base.value if isinstance(base, ast.Subscript) else base)


_WRITERS: dict[str, Callable[[Writer, Any], str | None]] = {
    name[1:]: method
    for name, method in vars(Writer).items()
    if name[1:2].isupper() or name == "_arg"
}
"""What is written otherwise than by its fields, by the names of its class."""
