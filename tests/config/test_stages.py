import json
import os
import subprocess
import sys
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softslip.config.fidelity import LEVELS
from softslip.config.fields import all_fields
from softslip.config.parameters import Parameters
from softslip.config.stages import (
    DEPENDENCIES,
    ID_DIGITS,
    LENGTH,
    STAGES,
    stage_ids,
    stage_parameters,
    stage_paths,
    trajectory_id,
)
from softslip.errors import ConfigError

FIELDS = all_fields(Parameters)

CHANGED: dict[str, Any] = {
    "channel.length": 0.25,
    "channel.height": 0.45,
    "channel.outer_gap": 0.56,
    "channel.outside": "periodic",
    "wall.roughness": 0.59,
    "suspension.area_reference": "free",
    "expansion.closest_approach": 0.5,
    "hydrodynamics.symbol": "wide",
    "hydrodynamics.resolution": 4096,
    "membrane.area_correction": "none",
    "steric.reading": "density",
    "rheometer.control": "printed",
    "recording.bulk_margin": None,
    "recording.snapshots": [50.0],
    "hydrodynamics.mobility": "ewald",
    "hydrodynamics.split": 4.0,
    "hydrodynamics.regularisation": 0.9,
    "hydrodynamics.quadrature": "corrected",
    "membrane.area_restoring": 1.0,
    "membrane.order": 6,
    "time_stepping.integrator": "rkc2",
    "until.error": 0.03,
}
"""Another valid value for the paths whose default cannot simply be doubled."""

ON_EWALD = {"hydrodynamics.regularisation", "hydrodynamics.quadrature"}
"""Paths that mean something for the Ewald sum only."""

ALONE = {"rheometer.mode"}
"""Paths that have no other value that is valid by itself."""

THROUGH_OTHERS = {"fidelity", "accuracy"}
"""Paths that choose the values of others, by which alone they change a run."""

DOUBLE = 2.0


def ground(path: str) -> dict[str, Any]:
    """Return what else must be given for a path to have another value."""
    return {"hydrodynamics": {"mobility": "ewald"}} if path in ON_EWALD else {}


def changed(path: str) -> Parameters:
    section, _, name = path.rpartition(".")
    default = FIELDS[path].default
    if path in CHANGED:
        value = CHANGED[path]
    elif path == "rheometer.shear_rate":
        rate = {"mode": "rate", "stress": None, "shear_rate": 0.1}
        return Parameters.from_mapping({"rheometer": rate})
    elif path == "suspension.area_fraction":
        value = default / DOUBLE
    elif path == "packing.area_fraction":
        value = 0.4
    else:
        value = int(default * DOUBLE) if isinstance(default, int) else default * DOUBLE
    extra = {"outer_gap": 0.01875} if path == "channel.height" else ground(path).get(section, {})
    return Parameters.from_mapping({section: {name: value, **extra}} if section else {name: value})


@pytest.mark.parametrize("path", sorted(set(FIELDS) - ALONE - THROUGH_OTHERS))
def test_only_lengths_leave_a_trajectory_as_it_is(path: str) -> None:
    before = trajectory_id(Parameters.from_mapping(ground(path)))
    assert (trajectory_id(changed(path)) == before) == (path in LENGTH)


def test_every_parameter_belongs_to_a_stage() -> None:
    missing = set(FIELDS) - set(stage_paths(STAGES[-1])) - THROUGH_OTHERS
    assert not missing, f"no stage depends on {sorted(missing)}"


@pytest.mark.parametrize("stage", STAGES)
def test_every_dependency_names_parameters(stage: str) -> None:
    for pattern in DEPENDENCIES[stage]:
        group = pattern.removesuffix("*")
        named = [path for path in FIELDS if path == pattern or path.startswith(group)]
        assert named, f"{stage} depends on {pattern}, which names no parameter"


@pytest.mark.parametrize("path", sorted(set(FIELDS) - ALONE - THROUGH_OTHERS))
def test_a_changed_parameter_changes_the_stages_that_depend_on_it_and_no_others(path: str) -> None:
    before = stage_ids(Parameters.from_mapping(ground(path)))
    after = stage_ids(changed(path))
    differ = [stage for stage in STAGES if before[stage] != after[stage]]
    # A taller channel of the same mesh needs another gap, which only the ageing sees.
    depend = [stage for stage in STAGES if path in stage_paths(stage)]
    assert differ == depend, f"{path} changes {differ} but belongs to {depend}"


@pytest.mark.parametrize(
    "path",
    [
        "rheometer.stress",
        "solvent.viscosity",
        "time_stepping.step",
        "time_stepping.shear_time",
        "channel.outer_gap",
        "recording.stride",
        "membrane.elastic_constant",
        "hydrodynamics.resolution",
    ],
)
def test_a_packing_does_not_depend_on(path: str) -> None:
    assert path not in stage_paths("packing")


def test_ageing_is_shared_by_all_stresses() -> None:
    assert not [path for path in stage_paths("ageing") if path.startswith("rheometer.")]


@pytest.mark.parametrize("level", LEVELS)
def test_a_level_of_fidelity_is_the_settings_that_it_stands_for(level: str) -> None:
    by_name = Parameters.from_mapping({"fidelity": level})
    by_value = Parameters.from_mapping(LEVELS[level])
    assert by_name.fidelity == level
    assert by_value.fidelity is None
    assert stage_ids(by_name) == stage_ids(by_value)
    differ = [
        stage for stage in STAGES if stage_ids(by_name)[stage] != stage_ids(Parameters())[stage]
    ]
    assert differ == ["expansion", "ageing", "shear"], "a packing of discs has no fidelity"


def test_stages_are_nested() -> None:
    for earlier, later in pairwise(STAGES):
        assert set(stage_paths(earlier)) < set(stage_paths(later))


def test_an_unknown_stage_is_refused() -> None:
    with pytest.raises(ConfigError, match="packing, expansion, ageing, shear"):
        stage_paths("baking")


def test_identities_are_short_hexadecimal_and_differ_between_stages() -> None:
    ids = stage_ids(Parameters())
    assert tuple(ids) == STAGES
    assert len(set(ids.values())) == len(STAGES)
    for identity in ids.values():
        assert len(identity) == ID_DIGITS
        assert int(identity, 16) >= 0


@given(st.permutations(["wall", "channel", "solvent", "seed"]), st.sampled_from([0, 0.0, -0.0]))
@settings(max_examples=50, deadline=None)
def test_identities_do_not_depend_on_order_or_spelling(order: list[str], zero: float) -> None:
    tree: dict[str, Any] = {
        "wall": {"roughness": zero, "stiffness": 20000},
        "channel": {"outer_gap": 0.56, "height": 0.44},
        "solvent": {"viscosity": 1},
        "seed": 3,
    }
    reordered = {
        key: dict(reversed(tree[key].items())) if isinstance(tree[key], dict) else tree[key]
        for key in order
    }
    spelt = {"channel": {"outer_gap": 0.56}, "seed": 3}
    wanted = stage_ids(Parameters.from_mapping(spelt))
    assert stage_ids(Parameters.from_mapping(reordered)) == wanted


@pytest.mark.parametrize(
    "environment",
    [
        {"PYTHONHASHSEED": "1", "LC_ALL": "C"},
        {"PYTHONHASHSEED": "2", "LC_ALL": "de_DE.UTF-8", "LANG": "tr_TR.UTF-8"},
    ],
)
def test_identities_are_the_same_in_another_process(environment: dict[str, str]) -> None:
    code = (
        "from softslip.config.stages import stage_ids; "
        "from softslip.config.parameters import Parameters; "
        "print(*stage_ids(Parameters()).values())"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    assert answer.stdout.split() == list(stage_ids(Parameters()).values())


def test_runs_that_share_a_stage_write_the_same_parameters_of_it() -> None:
    low, high = (Parameters.from_mapping({"rheometer": {"stress": each}}) for each in (0.1, 0.5))
    for stage in ("packing", "expansion", "ageing"):
        assert stage_parameters(low, stage) == stage_parameters(high, stage)
    assert stage_parameters(low, "shear") != stage_parameters(high, "shear")


def test_the_parameters_of_the_last_stage_make_the_run_again() -> None:
    given = Parameters.from_mapping({"fidelity": "standard", "rheometer": {"stress": 0.25}})
    again = Parameters.from_mapping(json.loads(stage_parameters(given, "shear")))
    assert stage_ids(again) == stage_ids(given)
