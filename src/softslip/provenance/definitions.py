"""The definitions of the package's modules, and which others each of them refers to.

A definition is what binds a name at the top level of a module: a function, a class, a constant.
What it refers to is resolved through imports to the definitions of the rooms that compute;
where these stand does not matter. What cannot be resolved, such as an attribute that a module does
not visibly have, refers to the whole module.
"""

import ast
import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

from softslip.provenance.bindings import (
    DEFAULTS,
    EFFECTS,
    WHOLE,
    Bindings,
    Key,
    ModuleName,
    Outside,
    Target,
)
from softslip.provenance.normal_form import Writer
from softslip.provenance.scopes import Module, names_in, parent_of, read_module

ROOMS = ("solver", "simulation", "analysis", "studies")
"""Rooms of the package that compute; what is imported from others counts by its name only."""


@dataclass(frozen=True)
class Definition:
    """A definition without what it refers to.

    Attributes
    ----------
    digest
        Of its normal form, in which references are numbered in their order.
    references
        What the numbers stand for.
    """

    digest: str
    references: tuple[Key, ...]


class Package:
    """The modules of a package as they are on disk, each read when it is first asked for."""

    def __init__(self, folder: Path, name: str = "softslip") -> None:
        self.folder = folder
        self.name = name
        self.module = cache(self._module)
        self.definition = cache(self._definition)
        self.path_of = cache(self._path_of)
        self.reached = cache(self._reached)

    def _path_of(self, module: str) -> Path | None:
        """Return the file of a module, if there is such a module."""
        first, *parts = module.split(".")
        path = self.folder.joinpath(*parts)
        files = (path / "__init__.py", path.with_suffix(".py"))
        return next((f for f in files if f.is_file()), None) if first == self.name else None

    def computes(self, module: str) -> bool:
        """Return whether a module is one of the rooms that compute."""
        return module.split(".")[1:2] != [] and module.split(".")[1] in ROOMS

    @cached_property
    def modules(self) -> tuple[str, ...]:
        """Names of all modules that compute."""
        return tuple(sorted(name for room in ROOMS for name in self.modules_in(room)))

    def modules_in(self, room: str) -> list[str]:
        """Return the sorted names of the modules in a room."""
        files = (self.folder / room).rglob("*.py")
        paths = (file.relative_to(self.folder).with_suffix("") for file in files)
        names = (".".join([self.name, *path.parts]) for path in paths)
        return sorted(name.removesuffix(".__init__") for name in names)

    @cached_property
    def errors(self) -> frozenset[str]:
        """Names of the package's own errors, as `Outside` has them."""
        names = self.module(f"{self.name}.errors").definitions
        return frozenset(f"{self.name}.{name}" for name in names)

    def _module(self, name: str) -> Module:
        path = self.path_of(name)
        if path is None:
            raise ValueError(f"{name} is no module of {self.name}")
        return read_module(path.read_bytes(), parent_of(name, path))

    def _definition(self, key: Key) -> Definition:
        module, name = key
        if name == WHOLE:
            return self._whole(module)
        read = self.module(module)
        if name == DEFAULTS:
            return self.define(key, read.defaults())
        return self.define(key, read.effects if name == EFFECTS else read.definitions[name])

    def define(self, key: Key, statements: Iterable[ast.stmt]) -> Definition:
        """Return what statements in a module define, as if they were those of a definition."""
        module, name = key
        bindings = Bindings(self, module, statements)
        writer = Writer(bindings)
        text = f"{name} {[writer.text(statement) for statement in bindings.statements]}"
        bindings.refer_to_hidden()
        return Definition(_digest(text), tuple(bindings.references))

    def _reached(self, root: Key) -> dict[Key, int]:
        """Return what a definition refers to, directly and through others, numbered from 0 on.

        The numbers follow from the order of references alone, not from where the definitions are.
        """
        numbers = {root: 0}
        waiting = [root]
        for key in waiting:
            for reference in self.definition(key).references:
                if reference not in numbers:
                    numbers[reference] = len(numbers)
                    waiting.append(reference)
        return numbers

    def _whole(self, module: str) -> Definition:
        read = self.module(module)
        found = {name: (module, name) for name in read.definitions if name != "__all__"}
        for name in read.imports:
            target = self.lookup(module, name)
            if isinstance(target, tuple):
                found[name] = target
        stars = [(star, WHOLE) for star in read.stars if self.computes(star)]
        names = sorted(found)
        references = [found[name] for name in names] + stars
        return Definition(_digest(f"{names}"), tuple(references))

    def lookup(self, module: str, name: str) -> Target | None:
        """Return what a name at the top level of a module is bound to, if it is bound there."""
        read = self.module(module)
        if name in read.definitions:
            return module, name
        if name not in read.imports:
            return None
        source, attribute = read.imports[name]
        return self.imported(source, attribute)

    def imported(self, source: str, attribute: str | None) -> Target:
        """Return what a module is, or an attribute that is imported from it."""
        if source.partition(".")[0] != self.name:
            return Outside(source if attribute is None else f"{source}.{attribute}")
        return ModuleName(source) if attribute is None else self.attribute(source, attribute)

    def attribute(self, module: str, name: str) -> Target:
        """Return what an attribute of a module of the package is, all of it if that is unclear."""
        there, inside = self.path_of(module) is not None, self.computes(module)
        target = self.lookup(module, name) if there else None
        # Other rooms count by names only, but may hand on what the rooms that compute define.
        if target is not None and (
            inside or (isinstance(target, tuple) and self.computes(target[0]))
        ):
            return target
        if self.path_of(f"{module}.{name}") is not None:
            return ModuleName(f"{module}.{name}")
        return (module, WHOLE) if there and inside else Outside(f"{self.name}.{name}")

    def arguments_of(self, key: Key) -> set[Key]:
        """Return the classes of the arguments of a function, or of all functions of a module."""
        module, name = key
        if name == WHOLE:
            functions = self.definition(key).references
            return {each for function in functions for each in self.arguments_of(function)}
        found = set()
        for statement in self.module(module).definitions[name]:
            if isinstance(statement, ast.FunctionDef):
                # What is imported for types only is not bound: it is no part of what is computed.
                names = names_in([statement]).annotations
                found |= {self.lookup(module, each) for each in names}
        keys = {target for target in found if isinstance(target, tuple)}
        return {key for key in keys if self._is_class(key)}

    def _is_class(self, key: Key) -> bool:
        module, name = key
        statements = self.module(module).definitions.get(name, [])
        return any(isinstance(statement, ast.ClassDef) for statement in statements)

    def loaded(self, modules: Iterable[str]) -> set[str]:
        """Return the modules that compute among those executed when some are imported."""
        found: set[str] = set()
        waiting = set(modules)
        while waiting:
            module = waiting.pop()
            if self.computes(module) and self.path_of(module) is not None:
                found.add(module)
                # Importing a module executes the packages that it is in.
                waiting |= {*self.module(module).imported, module.rpartition(".")[0]} - found
        return found


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
