"""Levels of fidelity: one word for the numerical settings of a run.

A level is a set of parameter values that apply where a scenario does not say otherwise. All
levels solve the paper's equations with the paper's material; they differ in how closely, and in
what it costs. Without a level the numbers are the paper's own scheme: a mesh of 1/8192, boundary
nodes 1.42 of it apart, and explicit Euler steps of 0.002.
"""

from collections.abc import Mapping
from typing import Any

from softslip.config.accuracy import cheapest

Settings = Mapping[str, Mapping[str, Any]]
"""Values by group and key of the parameter tree."""


LONGEST_STEP = 10.0
"""Longest step of all levels, where the error allows it: records end every time unit by default, so
that ageing alone takes steps as long as this [time unit]."""


def _level(
    regularisation: float | None,
    node_spacing: float,
    refinement: int,
    tolerance: float,
) -> Settings:
    return {
        "membrane": {"order": 6, "area_restoring": 1.0},
        "steric": {"refinement": refinement},
        "hydrodynamics": {
            "mobility": "ewald",
            "resolution": 8192,
            "regularisation": regularisation,
            "node_spacing": node_spacing,
            "quadrature": "corrected",
        },
        "time_stepping": {
            "integrator": "imex_rkc2",
            "step": 0.01,
            "tolerance": tolerance,
            "longest_step": LONGEST_STEP,
        },
        "recording": {"stride": 1},
    }


LEVELS: Mapping[str, Settings] = {
    "preview": _level(0.1, 6.0, 4, 2.5e-2),
    "standard": _level(0.06, 5.0, 3, 5e-3),
    # The regularisation of the paper's own mesh: to be compared with the paper, not with the limit.
    "paper": _level(None, 4.0, 2, 1e-3),
    "converged": _level(0.06, 2.0, 2, 1e-3),
}
"""The settings of each level: nodes and lengths from the table in docs/accuracy.md, steps from
docs/time_stepping.md."""

CHOSEN_FROM = "standard"
"""Level whose settings a target accuracy starts from; what it chooses replaces some of them."""


def with_level(tree: Mapping[str, Any]) -> dict[str, Any]:
    """Return a parameter tree with the settings of its level or accuracy where it is silent.

    Parameters
    ----------
    tree
        Nested mapping; its ``fidelity`` names the level, or its ``accuracy`` asks for the
        cheapest settings that meet it. An unknown level, or a group that is no mapping, is left
        for validation to refuse, and so is a tree with both.

    Raises
    ------
    ConfigError
        When no settings meet the accuracy.
    """
    merged = dict(tree)
    for group, values in _settings(tree).items():
        given = merged.get(group, {})
        if isinstance(given, Mapping):
            merged[group] = {**values, **given}
    return merged


def _settings(tree: Mapping[str, Any]) -> Settings:
    level, accuracy = tree.get("fidelity"), tree.get("accuracy")
    if isinstance(level, str):
        return LEVELS.get(level, {})
    if level is None and isinstance(accuracy, float) and 0 < accuracy < 1:
        chosen, base = cheapest(accuracy).settings, LEVELS[CHOSEN_FROM]
        return {
            group: {**base.get(group, {}), **chosen.get(group, {})} for group in {**base, **chosen}
        }
    return {}
