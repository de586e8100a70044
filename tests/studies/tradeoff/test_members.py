import re

import pytest

from softslip.config.fidelity import LEVELS
from softslip.errors import ConfigError
from softslip.studies.tradeoff.members import (
    CONTACT_SPACING,
    Member,
    finest_name,
    members_of,
    parameters_of,
    reference_of,
    smallest,
)
from softslip.studies.tradeoff.tradeoff_design import TradeoffDesign

SMALL = TradeoffDesign.of(
    {
        "particles": 24,
        "regularisations": [0.2, None],
        "node_spacings": [4.0, 6.0],
        "tolerances": [1e-2],
        "levels": ["standard", "converged"],
        "variants": {
            "mesh-4096": {
                "level": "literal",
                "settings": {"hydrodynamics": {"resolution": 4096}},
                "short": True,
            },
            "gap-0.1": {"outer_gap": 0.1},
            "periodic": {"settings": {"channel": {"outside": "periodic"}}},
        },
    }
)


def test_every_combination_of_the_grid_is_a_member_once():
    found = [member for member in members_of(SMALL).values() if member.kind == "factorial"]
    values = {
        (
            member.settings["hydrodynamics"]["regularisation"],
            member.settings["hydrodynamics"]["node_spacing"],
            member.settings["time_stepping"]["tolerance"],
        )
        for member in found
    }
    assert values == {(0.2, 4.0, 1e-2), (0.2, 6.0, 1e-2), (None, 4.0, 1e-2), (None, 6.0, 1e-2)}
    assert len(found) == 4


def test_each_regularisation_length_has_a_finest_member_and_the_smallest_a_twin():
    found = members_of(SMALL)
    for spread in SMALL.regularisations:
        member = found[finest_name(spread)]
        assert member.settings["hydrodynamics"]["node_spacing"] == 4.0
        assert member.settings["time_stepping"]["tolerance"] == SMALL.finest_tolerance
    assert found["twin"].settings == found[finest_name(0.2)].settings
    assert found["closer"].settings["hydrodynamics"]["node_spacing"] == SMALL.closer_spacing


def test_names_of_all_members_are_safe_in_files_and_stand_for_their_keys():
    for name, member in members_of(TradeoffDesign()).items():
        assert member.name == name
        assert re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", name)


def test_none_is_between_smaller_and_larger_regularisation_lengths():
    assert smallest((None, 0.1, 1.56)) == 0.1
    assert smallest((None, 1.56)) is None


def test_contact_points_stay_close_whatever_the_node_spacing():
    for member in members_of(TradeoffDesign()).values():
        if member.kind == "factorial":
            spacing = member.settings["hydrodynamics"]["node_spacing"]
            assert spacing / member.settings["steric"]["refinement"] <= CONTACT_SPACING


@pytest.mark.parametrize("roughness", [0.0, 0.59])
def test_members_make_valid_parameters_of_their_own_settings(roughness):
    for name, member in members_of(SMALL).items():
        given = parameters_of(member, SMALL, 0.5, roughness)
        assert given.rheometer.stress == 0.5
        assert given.wall.roughness == roughness
        assert given.suspension.area_reference == "free"
        for group, values in member.settings.items():
            for key, value in values.items():
                assert getattr(getattr(given, group), key) == value, f"{name}: {group}.{key}"


def test_the_box_keeps_its_channel_when_the_outer_gap_changes():
    usual = parameters_of(reference_of(SMALL), SMALL, 0.5, 0.0).channel
    wide = parameters_of(members_of(SMALL)["gap-0.1"], SMALL, 0.5, 0.0).channel
    assert (wide.length, wide.height, wide.outside) == (usual.length, usual.height, "still")
    # L_y is a multiple of 1/64, of which half is the most that the wish can be missed by.
    assert wide.outer_gap == pytest.approx(0.1, abs=1 / 128)
    assert wide.outer_gap != usual.outer_gap
    periodic = parameters_of(members_of(SMALL)["periodic"], SMALL, 0.5, 0.0).channel
    assert periodic.outside == "periodic"
    assert periodic.outer_gap == usual.outer_gap


def test_the_literal_scheme_has_no_level():
    given = parameters_of(members_of(SMALL)["mesh-4096"], SMALL, 0.5, 0.0)
    assert given.fidelity is None
    assert given.hydrodynamics.mobility == "grid"
    assert given.time_stepping.integrator == "euler"


def test_levels_are_members_with_the_settings_of_the_level_alone():
    found = members_of(SMALL)
    assert {name for name in found if name.startswith("level-")} == {
        "level-standard",
        "level-converged",
    }
    given = parameters_of(found["level-converged"], SMALL, 0.5, 0.0)
    wanted = LEVELS["converged"]["hydrodynamics"]
    assert given.hydrodynamics.regularisation == wanted["regularisation"]
    assert given.hydrodynamics.node_spacing == wanted["node_spacing"]


def test_a_variant_may_not_take_the_name_of_another_member():
    design = SMALL.model_copy(update={"variants": {"twin": _variant()}})
    with pytest.raises(ConfigError, match=r"variants\.twin"):
        members_of(design)


def _variant():
    return TradeoffDesign.of({"variants": {"other": {}}}).variants["other"]


def test_settings_that_contradict_the_scene_are_refused_where_they_are_used():
    wide = Member("wide", "variant", settings={"hydrodynamics": {"node_spacing": 8.0}})
    with pytest.raises(ConfigError, match=r"hydrodynamics\.node_spacing"):
        parameters_of(wide, SMALL, 0.5, 0.0)
