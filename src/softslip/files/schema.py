"""How it is declared what a dataset must look like: its variables, and rules between them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import xarray as xr

from softslip.files.quantities import unit_of

Kind = Literal["number", "count", "flag", "word"]

Rule = Callable[[xr.Dataset], str | None]
"""Returns what is wrong with a dataset whose variables are right one by one, if anything is."""


@dataclass(frozen=True)
class Variable:
    """What one variable must look like.

    Attributes
    ----------
    dims
        Its dimensions in their order; after those of the sweep, where it is ``swept``.
    units
        Its attribute ``units``; None for a label, which carries none.
    kind
        float64, int64, truth values or words.
    unknown
        Whether values may be NaN.
    infinite
        Whether values may be infinite.
    least, above
        Values that are known are at least one of these and above the other.
    increasing
        Whether each value must exceed the one before it.
    words
        The words in their order, for a label; the words that may occur, for any other variable.
    swept
        Whether the dimensions of the sweep come before its own.
    sweep
        The variable whose leading dimensions these are, where it is not the schema's.
    pooled
        Dimensions of the sweep that it has not.
    known_where
        A variable of words and a beginning: where its word begins so, values must be known.
    group
        Variables of one group are there together or not at all; None if it must be there.
    """

    dims: tuple[str, ...]
    units: str | None
    kind: Kind = "number"
    unknown: bool = False
    infinite: bool = False
    least: float = -np.inf
    above: float = -np.inf
    increasing: bool = False
    words: tuple[str, ...] = ()
    swept: bool = False
    sweep: str | None = None
    pooled: tuple[str, ...] = ()
    known_where: tuple[str, str] | None = None
    group: str | None = None


@dataclass(frozen=True)
class Schema:
    """What the datasets of one stage must look like.

    Attributes
    ----------
    variables
        What each variable must look like, by name.
    groups
        The parameter without which a group of variables is absent, by the group's name.
    sweep
        The variable whose leading dimensions are those of the sweep, but for variables that name
        another one; None where nothing is swept.
    shared
        Units of the parameters that are a coordinate where all runs share their value.
    rules
        What must hold between variables.
    """

    variables: Mapping[str, Variable]
    groups: Mapping[str, str] = field(default_factory=dict)
    sweep: str | None = None
    shared: Mapping[str, str] = field(default_factory=dict)
    rules: tuple[Rule, ...] = ()

    def sweep_of(self, variable: Variable) -> str | None:
        """Return the variable whose leading dimensions are those of another one's sweep."""
        return variable.sweep or self.sweep


def of_quantity(name: str, *dims: str, **others: Any) -> dict[str, Variable]:
    """Return what the variable of a quantity must look like, with its unit in `quantities`.

    Parameters
    ----------
    name
        Of the quantity.
    *dims
        Of the variable.
    **others
        What else `Variable` may say.
    """
    return {name: Variable(dims, unit_of(name), **others)}
