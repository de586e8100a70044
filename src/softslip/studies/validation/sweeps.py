"""A case at all combinations of some of its parameters, as a dataset."""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from softslip.config.fields import extra, owner
from softslip.errors import ConfigError, SoftslipError
from softslip.messages import NOTHING
from softslip.studies.meanings import attributes
from softslip.studies.timing import Tell, silent
from softslip.studies.validation.case import Case, Outcome

KINDS = {
    "result": "{}",
    "reference": "{}, exact",
    "error": "error of: {}",
    "tolerance": "largest acceptable error of: {}",
}
"""Kinds of variables, by the last part of their names, and how their long names are made."""


def sweep(
    case: type[Case],
    axes: Mapping[str, Sequence[Any]],
    fixed: Mapping[str, Any] | None = None,
    tell: Tell = silent,
) -> xr.Dataset:
    """Solve a case at all combinations of some of its parameters.

    Parameters
    ----------
    case
        What is solved.
    axes
        Values by parameter; each becomes a dimension, in this order. A null is NaN among numbers
        and an empty text among words.
    fixed
        Values of other parameters, the defaults where not given.

    Returns
    -------
    xarray.Dataset
        ``<name>_result``, ``<name>_reference``, ``<name>_error`` and ``<name>_tolerance`` for each
        quantity of the case, ``passed``, and ``refusal``: the message of a combination that could
        not be solved, whose numbers are NaN, and an empty text for others. The attributes are the
        case's name (``case``) and ``summary``, the name of the error that counts (``leading``) and
        the other parameters.

    Raises
    ------
    ConfigError
        When the case has no such parameter, an axis has no values, or a parameter is both swept
        and fixed.
    """
    fixed = dict(fixed or {})
    _check(case, axes, fixed)
    outcomes: list[Outcome | None] = []
    refusals: list[str] = []
    for values in itertools.product(*axes.values()):
        chosen = dict(zip(axes, values, strict=True))
        tell(f"{case.name}: " + ", ".join(f"{key} {value}" for key, value in chosen.items()))
        try:
            outcomes.append(case.of({**fixed, **chosen}).solve())
            refusals.append("")
        except SoftslipError as error:
            outcomes.append(None)
            refusals.append(str(error))
    return _dataset(case, axes, fixed, outcomes, refusals)


def _check(case: type[Case], axes: Mapping[str, Sequence[Any]], fixed: Mapping[str, Any]) -> None:
    for name in (*axes, *fixed):
        owner(case, name, NOTHING)
    for name, values in axes.items():
        if not len(values):
            raise ConfigError(name, [], "is an axis without values", "give at least one")
        if name in fixed:
            raise ConfigError(name, fixed[name], "is given for an axis too", "give it once")


def _dataset(
    case: type[Case],
    axes: Mapping[str, Sequence[Any]],
    fixed: Mapping[str, Any],
    outcomes: Sequence[Outcome | None],
    refusals: Sequence[str],
) -> xr.Dataset:
    """Return what came out, in the shape of the axes."""
    dims, shape = tuple(axes), tuple(len(values) for values in axes.values())
    dataset = xr.Dataset(coords={name: _axis(case, name, axes[name]) for name in axes})
    for kind in KINDS:
        for name in _names(outcomes, kind):
            values = [_value(outcome, kind, name) for outcome in outcomes]
            dataset[f"{name}_{kind}"] = (dims, np.reshape(values, shape), _labels(case, kind, name))
    passed = [outcome is not None and outcome.passed for outcome in outcomes]
    words = attributes("1", "whether every error is within its tolerance")
    dataset["passed"] = (dims, np.reshape(passed, shape), words)
    said = np.array(refusals, dtype=object).reshape(shape)
    dataset["refusal"] = (dims, said, {"long_name": "why there is no result; empty if there is"})
    others = {
        name: fixed.get(name, field.default)
        for name, field in case.model_fields.items()
        if name not in axes
    }
    leading = next(iter(_names(outcomes, "error")), "")
    about = {"case": case.name, "summary": case.summary, "leading": leading}
    plain = {name: "null" if value is None else value for name, value in others.items()}
    return dataset.assign_attrs(about | plain)


def _mapping(outcome: Outcome, kind: str) -> Mapping[str, float]:
    return {
        "result": outcome.result,
        "reference": outcome.reference,
        "error": outcome.errors,
        "tolerance": outcome.tolerances,
    }[kind]


def _names(outcomes: Sequence[Outcome | None], kind: str) -> list[str]:
    """Return all names that any outcome has, in their order there."""
    found = [name for outcome in outcomes if outcome for name in _mapping(outcome, kind)]
    return list(dict.fromkeys(found))


def _value(outcome: Outcome | None, kind: str, name: str) -> float:
    return math.nan if outcome is None else _mapping(outcome, kind).get(name, math.nan)


def _labels(case: type[Case], kind: str, name: str) -> dict[str, str]:
    unit, meaning = case.units[name]
    relative = kind in ("error", "tolerance")
    return attributes("1" if relative else unit, KINDS[kind].format(meaning))


def _axis(case: type[Case], name: str, values: Sequence[Any]) -> xr.Variable:
    """Return the coordinate of a parameter, words as words and numbers as numbers."""
    words = any(isinstance(value, str) for value in values)
    empty: str | float = "" if words else math.nan
    data = np.array([empty if value is None else value for value in values])
    field = case.model_fields[name]
    meaning = (field.description or "").split(". ")[0].rstrip(".")
    labels = attributes(str(extra(field, "unit")), meaning)
    return xr.Variable((name,), data.astype(object) if words else data, labels)
