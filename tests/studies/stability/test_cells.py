import pytest
from studies_small import SMALL_MAP

from softslip.config.parameters import Parameters
from softslip.errors import ConfigError
from softslip.studies.boxes import merged
from softslip.studies.stability import GROUPS, MapDesign, gather, measure_group
from softslip.studies.stability.map_scenes import aged, dense, in_scheme, start_tree

CHEAP = ("stress", "contact_energy", "roughness", "area_fraction", "wall_separation", "particles")


@pytest.mark.parametrize("design", [MapDesign(), SMALL_MAP])
@pytest.mark.parametrize(
    "group", [name for name in GROUPS if not name.startswith("step") and name != "rest"]
)
def test_a_group_has_its_values_in_each_of_its_schemes(group, design):
    cells = GROUPS[group](design)
    assert {cell.group for cell in cells} == {group}
    schemes = {cell.scheme for cell in cells}
    for scheme in schemes:
        labels = [cell.label for cell in cells if cell.scheme == scheme]
        assert len(set(labels)) == len(labels) == len(cells) / len(schemes)
    assert all(cell.duration > 0 for cell in cells)


@pytest.mark.parametrize("design", [MapDesign(), SMALL_MAP])
def test_a_rest_is_as_long_in_explicit_steps_as_it_says(design):
    """By the level, too; the level's own stepper goes through the time of those on the mesh."""
    lasting = {}
    for cell in GROUPS["rest"](design):
        stepping = Parameters.from_mapping(cell.tree).time_stepping
        explicit = stepping.integrator == "euler"
        assert cell.label.endswith("Euler") == explicit
        if explicit:
            assert cell.duration / stepping.step == pytest.approx(cell.value, rel=1e-12)
        lasting[cell.scheme, explicit, cell.value] = cell.duration
    for count in design.rests:
        assert ("standard", True, count) in lasting
        assert lasting["standard", False, count] == lasting["literal", True, count]


@pytest.mark.parametrize("group", CHEAP)
def test_cells_are_runs_of_the_values_that_they_name(group):
    paths = {
        "stress": ("rheometer", "stress"),
        "contact_energy": ("steric", "energy"),
        "roughness": ("wall", "roughness"),
        "area_fraction": ("suspension", "area_fraction"),
    }
    for cell in GROUPS[group](SMALL_MAP):
        given = Parameters.from_mapping(cell.tree)
        assert (given.hydrodynamics.mobility == "ewald") == (cell.scheme == "standard")
        assert (given.time_stepping.integrator == "imex_rkc2") == (cell.scheme == "standard")
        if group in paths:
            section, key = paths[group]
            assert getattr(getattr(given, section), key) == pytest.approx(cell.value)
        if group == "wall_separation":
            ratio = given.channel.height / given.suspension.mean_radius
            assert ratio == pytest.approx(cell.value)


def test_steps_are_those_of_the_limit():
    steps = {
        cell.value: Parameters.from_mapping(cell.tree).time_stepping.step
        for cell in GROUPS["step_euler"](SMALL_MAP)
    }
    assert steps[10.0] / steps[0.1] == pytest.approx(100)
    assert 0.001 < steps[0.8] < 0.05


def test_a_box_holds_the_particles_that_are_asked_for():
    design = SMALL_MAP
    for count in (1, 2, 6):
        start = start_tree(design.model_copy(update={"ageing": 0.02}), count, 1 / 16)
        assert aged(start).sizes["particle"] == count
        assert Parameters.from_mapping(start).suspension.area_fraction <= 0.84 + 1e-9


def test_a_start_is_made_once():
    assert aged(dense(SMALL_MAP)) is aged(dense(SMALL_MAP))


def test_coarse_meshes_keep_close_contact_points():
    tree = in_scheme(SMALL_MAP, dense(SMALL_MAP), "literal")
    assert Parameters.from_mapping(tree).steric.refinement == 4


def test_merging_leaves_its_input_alone():
    tree = {"wall": {"roughness": 0.0}}
    assert merged(tree, {"wall": {"stiffness": 1.0}}) == {
        "wall": {"roughness": 0.0, "stiffness": 1.0}
    }
    assert tree == {"wall": {"roughness": 0.0}}


@pytest.mark.parametrize(
    ("values", "key"), [({"particles": 3}, "particles"), ({"stress": [1.0]}, "stress")]
)
def test_a_plan_says_what_is_wrong_with_it(values, key):
    with pytest.raises(ConfigError, match=key):
        MapDesign.of(values)


def test_a_plan_takes_lists_as_yaml_has_them():
    assert MapDesign.of({"stresses": [1, 0.3], "rests": [100]}).stresses == (1.0, 0.3)


def test_an_unknown_group_is_refused():
    with pytest.raises(ConfigError, match="is no group of the map"):
        measure_group("temperature", SMALL_MAP)


def test_groups_become_one_map_in_its_order():
    design = SMALL_MAP.model_copy(
        update={"duration": 0.02, "stresses": (0.3,), "wall_stiffnesses": (2e4, 2e6)}
    )
    recorded = []
    stiff = measure_group("wall_stiffness", design, recorded.append)
    together = gather([stiff, measure_group("stress", design)])
    assert list(dict.fromkeys(together["group"].values)) == ["stress", "wall_stiffness"]
    assert together.attrs["cells"] == 6 == together.sizes["cell"]
    assert len(recorded) == 4
    # Only the mesh's steps are too long for the stiffest walls.
    assert (together.attrs["correct"], together.attrs["stopped"]) == (5, 1)
    assert "time_stepping.step" in str(together["message"].values[-1])
    for name in together.variables:
        assert together[name].attrs["long_name"], name
