"""What the names in a definition are bound to: other definitions, modules, or things outside."""

import ast
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from softslip.provenance.normal_form import Names, makes_error
from softslip.provenance.scopes import is_plain_error, is_text, names_in, parent_of, source_of

if TYPE_CHECKING:
    from softslip.provenance.definitions import Package

WHOLE, EFFECTS, DEFAULTS = "*", "!", "="
"""In the place of a definition's name: all of a module, its statements that bind no name, and the
defaults of the fields of its classes."""

BLIND = frozenset(
    {"__import__", "__init_subclass__", "__subclasses__", "eval", "exec", "globals"}
    | {"import_module"}
)
"""Names through which code reaches definitions that cannot be seen in it."""

Key = tuple[str, str]
"""A module, and the name of a definition in it or `WHOLE` or `EFFECTS`."""


@dataclass(frozen=True)
class ModuleName:
    """A module of the package as what a name is bound to."""

    name: str


@dataclass(frozen=True)
class Outside:
    """Something that is not of the rooms that compute: its dotted name in its library."""

    name: str


Target = Key | ModuleName | Outside


class Bindings(Names):
    """What the names in the statements of one definition are bound to."""

    def __init__(self, package: "Package", module: str, statements: Iterable[ast.stmt]) -> None:
        self.statements = list(statements)
        self.references: dict[Key, int] = {}
        self._package = package
        self._module = module
        self._used = names_in(self.statements)

    def reference(self, node: ast.expr) -> str | None:
        """Return the text for a name or attribute bound outside the code, if it is."""
        target = self._target(node)
        if target is None:
            return None
        text = self._text(target)
        if isinstance(node, ast.Attribute) and isinstance(target, tuple) and target[1] == WHOLE:
            return f"Attribute({text},{node.attr})"
        return text

    def is_wording(self, node: ast.expr) -> bool:
        """Return whether a name is bound to a constant text of a module."""
        statements = self._defined(node)
        return bool(statements) and all(map(is_text, statements))

    def makes_error(self, node: ast.expr) -> bool:
        """Return whether a name is bound to a function that returns or raises an error."""
        statements = self._defined(node)
        if not statements and isinstance(node, ast.Attribute):
            statements = self._methods(node.attr)
        return bool(statements) and all(map(makes_error, statements))

    def is_known_error(self, node: ast.expr) -> bool:
        """Return whether a name is bound to an error whose arguments are read by people only."""
        target = self._target(node)
        if isinstance(target, Outside):
            return target.name in self._package.errors
        if target is None:
            return super().is_known_error(node)
        statements = self._defined(node)
        return bool(statements) and all(map(is_plain_error, statements))

    def is_outside(self, node: ast.expr) -> bool:
        """Return whether a name is bound to something that is not followed."""
        return isinstance(self._target(node), Outside)

    def imported(self, node: ast.Import | ast.ImportFrom) -> str:
        """Return the text for an import within a function."""
        names = []
        for alias in node.names:
            source = alias.name if isinstance(node, ast.Import) else self._source(node)
            attribute = alias.name if isinstance(node, ast.ImportFrom) else None
            target = self._package.imported(source, attribute)
            names.append(f"{alias.asname or alias.name}={self._text(target)}")
        return f"Import({','.join(names)})"

    def refer_to_hidden(self) -> None:
        """Count what may be meant besides what the text refers to."""
        for name in sorted(self._used.names & self._used.bound):
            target = self._package.lookup(self._module, name)
            if target is not None:
                self._text(target)
        unseen = self._package.modules if self._used.mentioned & BLIND else ()
        for module in [*unseen, *self._package.module(self._module).stars]:
            self._text(ModuleName(module))

    def _text(self, target: Target) -> str:
        if isinstance(target, ModuleName):
            if not self._package.computes(target.name):
                return f"Outside({target.name.rpartition('.')[2]})"
            target = (target.name, WHOLE)
        if isinstance(target, Outside):
            return f"Outside({target.name})"
        return f"Reference({self.references.setdefault(target, len(self.references))})"

    def _target(self, node: ast.expr) -> Target | None:
        if isinstance(node, ast.Name):
            if node.id in self._used.bound:
                return None
            return self._package.lookup(self._module, node.id)
        if isinstance(node, ast.Attribute):
            base = self._target(node.value)
            if isinstance(base, ModuleName):
                return self._package.attribute(base.name, node.attr)
        return None

    def _defined(self, node: ast.expr) -> list[ast.stmt]:
        target = self._target(node)
        if not isinstance(target, tuple) or target[1] == WHOLE:
            return []
        return self._package.module(target[0]).definitions[target[1]]

    def _methods(self, name: str) -> list[ast.stmt]:
        definitions = self._package.module(self._module).definitions.values()
        classes = [s for each in definitions for s in each if isinstance(s, ast.ClassDef)]
        return [s for one in classes for s in one.body if getattr(s, "name", None) == name]

    def _source(self, node: ast.ImportFrom) -> str:
        path = self._package.path_of(self._module)
        assert path is not None
        return source_of(node, parent_of(self._module, path))
