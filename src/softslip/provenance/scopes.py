"""What a module of Python binds at its top level, and the names in pieces of its code."""

import ast
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from softslip.provenance.normal_form import FIELD_MAKERS, PLAIN_DECORATORS, is_for_types, last_name


@dataclass
class Module:
    """What a module binds at its top level.

    Attributes
    ----------
    definitions
        Statements by the names that they bind.
    imports
        Module and name (none for the module itself) by the name that an import binds.
    stars
        Modules whose names are all imported.
    effects
        Statements that do something else than bind names.
    imported
        Names of modules that are executed with this one, as far as they exist.
    """

    definitions: dict[str, list[ast.stmt]] = field(default_factory=dict)
    imports: dict[str, tuple[str, str | None]] = field(default_factory=dict)
    stars: list[str] = field(default_factory=list)
    effects: list[ast.stmt] = field(default_factory=list)
    imported: list[str] = field(default_factory=list)

    def defaults(self) -> list[ast.stmt]:
        """Return the defaults of the fields of all classes, without what else is said of them."""
        classes = [s for each in self.definitions.values() for s in each]
        return [
            ast.Assign(
                [ast.Name(f"{one.name}.{item.target.id}", ast.Store())], _default(item.value)
            )
            for one in sorted(classes, key=lambda each: str(getattr(each, "name", "")))
            if isinstance(one, ast.ClassDef)
            for item in one.body
            if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name) and item.value
        ]


@dataclass
class UsedNames:
    """The names in a piece of code.

    Attributes
    ----------
    names
        All that stand for themselves.
    bound
        Those that the code itself binds.
    mentioned
        Names, attributes and names of functions.
    annotations
        Those in annotations of arguments.
    imports
        Imports in it.
    """

    names: set[str] = field(default_factory=set)
    bound: set[str] = field(default_factory=set)
    mentioned: set[str] = field(default_factory=set)
    annotations: set[str] = field(default_factory=set)
    imports: list[ast.Import | ast.ImportFrom] = field(default_factory=list)


def read_module(source: bytes, parent: str) -> Module:
    """Return what a module binds.

    Parameters
    ----------
    source
        Its text.
    parent
        The package that relative imports start from.
    """
    module = Module()
    for statement in ast.parse(source).body:
        _enter(statement, module, parent)
    return module


def names_in(statements: Iterable[ast.stmt]) -> UsedNames:
    """Return the names in statements; the name of a function or class there is not its own."""
    used = UsedNames()
    waiting: list[ast.AST] = []
    for statement in statements:
        if not _is_definition(statement):
            waiting.append(statement)
            continue
        used.mentioned.add(getattr(statement, "name", ""))
        waiting += _children(statement)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Name):
            used.names.add(node.id)
            if not isinstance(node.ctx, ast.Load):
                used.bound.add(node.id)
        elif not isinstance(node, ast.Constant):
            _note(node, used)
            waiting += _children(node)
    used.mentioned |= used.names
    return used


_NAMELESS = frozenset({"ctx", "op", "ops"})
"""Fields of syntax trees without names."""


def _children(node: ast.AST) -> list[ast.AST]:
    children = []
    for name in node._fields:
        if name in _NAMELESS:
            continue
        part = getattr(node, name, None)
        if isinstance(part, ast.AST):
            children.append(part)
        elif isinstance(part, list):
            children += [item for item in part if isinstance(item, ast.AST)]
    return children


def _note(node: ast.AST, used: UsedNames) -> None:
    if isinstance(node, ast.Attribute):
        used.mentioned.add(node.attr)
    elif isinstance(node, ast.arg):
        used.bound.add(node.arg)
        parts = ast.walk(node.annotation) if node.annotation else ()
        used.annotations |= {part.id for part in parts if isinstance(part, ast.Name)}
    elif isinstance(node, ast.Import | ast.ImportFrom):
        used.imports.append(node)
        used.bound |= {alias.asname or alias.name.partition(".")[0] for alias in node.names}
    elif isinstance(node, ast.MatchMapping) and node.rest:
        used.bound.add(node.rest)
    elif not isinstance(node, ast.alias):
        # Functions and classes, caught errors, patterns.
        name = getattr(node, "name", None)
        if isinstance(name, str):
            used.bound.add(name)
            used.mentioned.add(name)


def _enter(statement: ast.stmt, module: Module, parent: str) -> None:
    """Put what a statement at the top level does into a module."""
    if isinstance(statement, ast.Import | ast.ImportFrom):
        _enter_import(statement, module, parent)
    elif is_for_types(statement):
        for each in getattr(statement, "orelse", []):
            _enter(each, module, parent)
    elif not isinstance(statement, ast.Pass) and not _is_constant(statement):
        names, imports = {getattr(statement, "name", "")}, []
        if not _is_definition(statement):
            used = names_in([statement])
            names, imports = used.bound, used.imports
        for name in names:
            module.definitions.setdefault(name, []).append(statement)
        for node in imports:
            module.imported += _sources(node, parent)
        if not names or not _only_binds(statement):
            module.effects.append(statement)


def _enter_import(node: ast.Import | ast.ImportFrom, module: Module, parent: str) -> None:
    module.imported += _sources(node, parent)
    for alias in node.names:
        if isinstance(node, ast.ImportFrom):
            if alias.name == "*":
                module.stars.append(source_of(node, parent))
            module.imports[alias.asname or alias.name] = (source_of(node, parent), alias.name)
        elif alias.asname:
            module.imports[alias.asname] = (alias.name, None)
        else:
            first = alias.name.partition(".")[0]
            module.imports[first] = (first, None)


def parent_of(module: str, path: Path) -> str:
    """Return the package that relative imports in a module start from."""
    return module if path.name == "__init__.py" else module.rpartition(".")[0]


def source_of(node: ast.ImportFrom, parent: str) -> str:
    """Return the module that names are imported from, also where it is given relatively."""
    if not node.level:
        return node.module or ""
    start = parent.split(".")[: len(parent.split(".")) - node.level + 1]
    return ".".join([*start, *([node.module] if node.module else [])])


def _sources(node: ast.Import | ast.ImportFrom, parent: str) -> list[str]:
    """Return the names of what is executed by an import, and perhaps of things in it."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    source = source_of(node, parent)
    return [source, *(f"{source}.{alias.name}" for alias in node.names)]


def _is_definition(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)


def _only_binds(statement: ast.stmt) -> bool:
    """Return whether a statement that binds names does nothing else that others could see."""
    decorators = getattr(statement, "decorator_list", [])
    if _is_definition(statement):
        return all(last_name(decorator) in PLAIN_DECORATORS for decorator in decorators)
    if isinstance(statement, ast.Assign):
        nodes = [node for target in statement.targets for node in ast.walk(target)]
        return not any(isinstance(node, ast.Attribute | ast.Subscript) for node in nodes)
    return type(statement).__name__ in ("AnnAssign", "AugAssign", "TypeAlias")


def _default(value: ast.expr) -> ast.expr:
    if not isinstance(value, ast.Call) or last_name(value) not in FIELD_MAKERS:
        return value
    named = [word.value for word in value.keywords if word.arg in ("default", "default_factory")]
    return [*value.args, *named, ast.Constant(None)][0]


def _is_constant(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def is_text(statement: ast.stmt) -> bool:
    """Return whether a statement gives a text a name."""
    value = getattr(statement, "value", None)
    return isinstance(value, ast.JoinedStr) or (
        isinstance(value, ast.Constant) and isinstance(value.value, str)
    )


def is_plain_error(statement: ast.stmt) -> bool:
    """Return whether a statement defines an error that does nothing with its arguments."""
    return (
        isinstance(statement, ast.ClassDef)
        and statement.name.endswith("Error")
        and all(isinstance(item, ast.Pass) or _is_constant(item) for item in statement.body)
    )
