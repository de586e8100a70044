import copy
import io
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

from softslip.config.fidelity import LEVELS
from softslip.config.fields import all_fields, value_at
from softslip.config.parameters import Parameters
from softslip.config.scenario import MOST_RUNS, Scenario, load_scenario
from softslip.config.stages import STAGES, stage_ids
from softslip.errors import ConfigError
from softslip.simulation.sample import particle_radii

PROJECT = Path(__file__).parents[2]
MATERIAL = (
    "solvent.viscosity",
    "membrane.elastic_constant",
    "membrane.area_correction",
    "steric.length",
    "steric.energy",
    "steric.reading",
)
"""What a particle is made of, whatever the numerics."""

NAMED = ("demo", "ci", "paper", "literal", "yielding", "paper_yielding")

TEXT = """\
description: Two walls and two stresses.
base:
  channel: {length: 0.09375, height: 0.140625, outer_gap: 0.015625}
  hydrodynamics: {resolution: 4096}
  time_stepping: {step: 0.006, shear_time: 100}
axes:
  wall.roughness: [0, 0.59]
  rheometer.stress: [0.03, 0.5]
"""


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("scenarios")


@pytest.fixture
def in_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(PROJECT)


def loaded(folder: Path, text: str | bytes) -> Scenario:
    path = folder / "case.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass"))
    return load_scenario(str(path))


def refused(folder: Path, text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        loaded(folder, text)
    message = str(caught.value)
    assert message.splitlines() == [message], f"not one line: {message!r}"
    prefix = f"{folder / 'case.yaml'}: "
    assert message.startswith(prefix), f"{message!r} does not start with the file"
    message = message.removeprefix(prefix)
    assert message.startswith(caught.value.key), f"{message!r} does not go on with the key"
    assert "; " in message, f"no remedy in {message!r}"
    return message


def with_axes(*lines: str) -> str:
    return "\n".join(["description: A case.", "axes:", *(f"  {line}" for line in lines)])


def with_base(*lines: str) -> str:
    return "\n".join(["description: A case.", "base:", *(f"  {line}" for line in lines)])


def test_runs_are_all_combinations_in_the_order_of_the_file(folder: Path) -> None:
    scenario = loaded(folder, TEXT)
    assert scenario.name == "case"
    assert scenario.description == "Two walls and two stresses."
    assert [(axis.path, axis.label) for axis in scenario.axes] == [
        ("wall.roughness", "roughness"),
        ("rheometer.stress", "stress"),
    ]
    assert [tuple(run.coordinates.values()) for run in scenario.runs()] == [
        (0.0, 0.03),
        (0.0, 0.5),
        (0.59, 0.03),
        (0.59, 0.5),
    ]
    for run in scenario.runs():
        assert run.parameters.wall.roughness == run.coordinates["roughness"]
        assert run.parameters.rheometer.stress == run.coordinates["stress"]
        assert run.parameters.hydrodynamics.resolution == 4096
        assert run.ids == stage_ids(run.parameters)
    assert scenario.base == scenario.runs()[0].parameters


@pytest.mark.parametrize("text", ["description: One run.", "description: x\nbase:\naxes: {}"])
def test_without_axes_there_is_one_run_with_no_coordinates(folder: Path, text: str) -> None:
    (run,) = loaded(folder, text).runs()
    assert run.parameters == Parameters()
    assert run.coordinates == {}


def test_stages_before_the_shear_are_shared_by_all_stresses(folder: Path) -> None:
    scenario = loaded(folder, TEXT)
    counts = {stage: len(scenario.stage_table(stage)) for stage in STAGES}
    assert counts == {"packing": 2, "expansion": 2, "ageing": 2, "shear": 4}
    for earlier, later in pairwise(STAGES):
        parents = {entry.parent for entry in scenario.stage_table(later).values()}
        assert parents == set(scenario.stage_table(earlier)), f"parents of {later}"
    for stage in STAGES:
        for identity, entry in scenario.stage_table(stage).items():
            assert (entry.stage, entry.id) == (stage, identity)
            assert stage_ids(entry.parameters)[stage] == identity
            assert (entry.parent is None) == (stage == "packing")


LEVELS_TEXT = """\
description: Two levels of fidelity.
base:
  channel: {length: 0.0625, height: 0.109375, outer_gap: 0.0625}
  membrane: {order: 2}
  hydrodynamics: {quadrature: corrected, node_spacing: 3.0}
  time_stepping: {shear_time: 100}
axes:
  fidelity: [preview, converged]
  rheometer.stress: [0.1, 0.5]
"""


def test_levels_of_fidelity_fill_each_run_and_leave_what_the_base_gives(folder: Path) -> None:
    scenario = loaded(folder, LEVELS_TEXT)
    assert [run.coordinates["fidelity"] for run in scenario.runs()] == [
        *["preview"] * 2,
        *["converged"] * 2,
    ]
    for run in scenario.runs():
        level = LEVELS[str(run.coordinates["fidelity"])]
        kept = {"membrane.order": 2, "hydrodynamics.node_spacing": 3.0}
        for path, value in (
            (f"{group}.{key}", value) for group in level for key, value in level[group].items()
        ):
            wanted = kept.get(path, value)
            assert value_at(run.parameters, path) == wanted, f"{path} at {run.coordinates}"
        assert run.parameters.rheometer.stress == run.coordinates["stress"]
    identities = {run.ids["ageing"] for run in scenario.runs()}
    assert len(identities) == 2, "each level ages its own packing, for both stresses"


def test_an_axis_over_what_a_level_sets_overrides_it(folder: Path) -> None:
    text = LEVELS_TEXT.replace("rheometer.stress: [0.1, 0.5]", "steric.refinement: [4, 5]")
    found = [
        (run.coordinates["fidelity"], run.parameters.steric.refinement)
        for run in loaded(folder, text).runs()
    ]
    assert found == [("preview", 4), ("preview", 5), ("converged", 4), ("converged", 5)]


def test_a_level_in_the_base_is_that_of_every_run(folder: Path) -> None:
    text = LEVELS_TEXT.replace("fidelity: [preview, converged]", "seed: [1, 2]")
    text = text.replace("base:\n", "base:\n  fidelity: paper\n")
    scenario = loaded(folder, text)
    assert scenario.base.time_stepping.tolerance == LEVELS["paper"]["time_stepping"]["tolerance"]
    for run in scenario.runs():
        assert run.parameters.fidelity == "paper"
        assert run.parameters.time_stepping == scenario.base.time_stepping


def test_a_level_that_is_none_is_named_with_its_place(folder: Path) -> None:
    message = refused(folder, LEVELS_TEXT.replace("converged]", "exact]"))
    assert message.startswith("axes.fidelity[1]: 'exact' must be 'preview', 'standard'"), message


def test_an_unknown_stage_is_refused(folder: Path) -> None:
    with pytest.raises(ConfigError, match="packing, expansion, ageing, shear"):
        loaded(folder, TEXT).stage_table("baking")


def test_axes_that_would_share_a_label_take_their_whole_paths(folder: Path) -> None:
    axes = [
        "suspension.area_fraction: [0.8, 0.84]",
        "packing.area_fraction: [0.4, 0.5]",
        "channel.height: [0.44]",
    ]
    labels = [axis.label for axis in loaded(folder, with_axes(*axes)).axes]
    assert labels == ["suspension_area_fraction", "packing_area_fraction", "wall_separation"]


def test_a_rate_sweep_needs_no_rate_in_its_base(folder: Path) -> None:
    text = with_base("rheometer: {mode: rate, stress: null}")
    runs = loaded(folder, f"{text}\naxes:\n  rheometer.shear_rate: [1e-3, 1]").runs()
    assert [run.coordinates["imposed_shear_rate"] for run in runs] == [1e-3, 1.0]


def test_whole_numbers_and_floats_are_the_same_value(folder: Path) -> None:
    ids = [
        loaded(folder, with_axes(f"wall.bump_separation: [{spelt}]")).runs()[0].ids
        for spelt in ("5", "5.0", "5e0", "0.5e1")
    ]
    assert all(one == ids[0] for one in ids), ids


OLD_VALUES = {
    path: field.default
    for path, field in all_fields(Parameters).items()
    if field.default is not None and not isinstance(field.default, tuple)
}


@given(
    paths=st.lists(st.sampled_from(sorted(OLD_VALUES)), min_size=1, max_size=4, unique=True),
    roughness=st.sampled_from([0, 0.25, 0.59]),
    data=st.data(),
)
@settings(max_examples=60, deadline=None)
def test_an_axis_added_at_its_old_value_leaves_every_identity(
    folder: Path, paths: list[str], roughness: float, data: st.DataObject
) -> None:
    base = f"description: x\nbase: {{wall: {{roughness: {roughness}}}}}\n"
    stresses = data.draw(st.lists(st.sampled_from([0.03, 0.3, 0.5]), min_size=1, unique=True))
    before = loaded(folder, f"{base}axes:\n  rheometer.stress: {stresses}\n").runs()
    old = {"wall.roughness": roughness}
    added = [
        f"  {path}: [{old.get(path, OLD_VALUES[path])}]"
        for path in paths
        if path != "rheometer.stress"
    ]
    place = data.draw(st.integers(0, len(added)))
    lines = [*added[:place], f"  rheometer.stress: {stresses}", *added[place:]]
    after = loaded(folder, "\n".join([f"{base}axes:", *lines])).runs()
    assert [run.ids for run in after] == [run.ids for run in before]


def test_a_new_value_leaves_the_runs_at_the_old_one(folder: Path) -> None:
    before = {run.ids["shear"] for run in loaded(folder, TEXT).runs()}
    after = {run.ids["shear"] for run in loaded(folder, f"{TEXT}  seed: [1, 2]\n").runs()}
    assert len(after) == 2 * len(before)
    assert before < after, "the runs with the old seed have new identities"


REFUSALS = {
    "unknown key at the top": ("description: x\nbasis: {}", "basis: {}", "description, base"),
    "no description": ("base: {}", "description: null", "say what"),
    "empty description": ("description: ''", "description: ''", "say what"),
    "description of the wrong type": ("description: 3", "description: 3", "say what"),
    "base that is a list": ("description: x\nbase: [1]", "base: [1]", "'key: value'"),
    "axes that are a list": ("description: x\naxes: [1]", "axes: [1]", "'key: value'"),
    "unknown key": (with_base("wall: {roughnes: 1}"), "base.wall.roughnes: 1", "did you mean"),
    "quoted number": (
        with_base("wall: {roughness: '1e-3'}"),
        "base.wall.roughness: '1e-3'",
        "without quotes",
    ),
    "no": (with_base("rheometer: {mode: no}"), "base.rheometer.mode: 'no'", "for example 'stress'"),
    "date": (with_base("seed: 2024-01-01"), "base.seed: datetime.date(2024, 1, 1)", "such as 1"),
    "value out of bounds": (with_base("wall: {roughness: 5}"), "base.wall.roughness: 5", "≤ 3"),
    "contradiction in the base": (
        with_base("channel: {length: 0.3}"),
        "base.channel.length: 0.3",
        "nearest value that fits is 0.300048828125",
    ),
    "bad base value under an axis": (
        "description: x\nbase: {wall: {roughness: no}}\naxes: {wall.roughness: [0.0]}",
        "base.wall.roughness: 'no'",
        "such as 0.0",
    ),
    "unknown axis": (with_axes("stress: [0.3]"), "axes.stress: [0.3]", "'rheometer.stress'"),
    "axis over a group": (with_axes("wall: [0]"), "axes.wall: [0]", "such as wall.roughness"),
    "nested axis": (
        with_axes("wall: {roughness: [0]}"),
        "axes.wall: {'roughness': [...]}",
        "such as wall.roughness",
    ),
    "axis without a name": (with_axes("3: [0]"), "axes.3: [0]", "such as wall.roughness"),
    "axis that is no list": (with_axes("seed: 3"), "axes.seed: 3 is not a list", "in brackets"),
    "empty axis": (with_axes("seed: []"), "axes.seed: [] is an empty axis", "in brackets"),
    "axis of nothing": (with_axes("seed:"), "axes.seed: null is not a list", "in brackets"),
    "axis value of the wrong type": (
        with_axes("rheometer.stress: [0.1, 0.2, high]"),
        "axes.rheometer.stress[2]: 'high' is not a number",
        "such as 0.3",
    ),
    "quoted axis value": (
        with_axes("rheometer.stress: [0.1, '1e-3']"),
        "axes.rheometer.stress[1]: '1e-3'",
        "without quotes: 1e-3",
    ),
    "axis value out of bounds": (
        with_axes("wall.roughness: [0, 5]"),
        "axes.wall.roughness[1]: 5",
        "≤ 3",
    ),
    "axis value twice": (
        with_axes("wall.roughness: [1, 0, 1.0]"),
        "axes.wall.roughness[2]: 1.0 is in the list already, at [0]",
        "once",
    ),
    "axis value of nothing": (
        with_axes("recording.bulk_margin: [5, null]"),
        "axes.recording.bulk_margin[1]: null cannot label",
        "leave it to base",
    ),
    "axis of lists": (
        with_axes("recording.snapshots: [[1.0]]"),
        "axes.recording.snapshots[0]: [1.0] cannot label",
        "leave it to base",
    ),
    "too many runs": (
        with_axes(f"seed: {list(range(1001))}", f"recording.stride: {list(range(1, 101))}"),
        f"axes: 100100 runs are more than {MOST_RUNS}",
        "shorten an axis",
    ),
}


@pytest.mark.parametrize(("text", "start", "remedy"), REFUSALS.values(), ids=REFUSALS)
def test_a_bad_scenario_is_refused_with_key_value_and_remedy(
    folder: Path, text: str, start: str, remedy: str
) -> None:
    message = refused(folder, text)
    assert message.startswith(start), f"{message!r} does not start with {start!r}"
    assert remedy in message.partition("; ")[2], f"{remedy!r} is not the remedy of {message!r}"


def test_an_invalid_combination_is_named(folder: Path) -> None:
    text = with_axes("suspension.area_fraction: [0.84, 0.95]", "wall.roughness: [0, 2.5]")
    message = refused(folder, text)
    assert message.startswith("axes.suspension.area_fraction[1]: 0.95 cannot fit"), message
    combination = "(in the run with suspension.area_fraction = 0.95, wall.roughness = 2.5)"
    assert message.endswith(combination), message


def test_a_contradiction_points_to_the_base_where_the_base_has_the_key(folder: Path) -> None:
    message = refused(folder, with_axes("hydrodynamics.resolution: [8192, 1000]"))
    assert message.startswith("base.channel.outer_gap: 0.02875 makes the period"), message
    assert message.endswith("(in the run with hydrodynamics.resolution = 1000)"), message


def test_a_syntax_error_is_one_line_with_file_and_line(folder: Path) -> None:
    with pytest.raises(ConfigError, match=r"case\.yaml: line 3, column \d+: ") as caught:
        loaded(folder, "description: x\nbase:\n  wall: ]\n")
    assert len(str(caught.value).splitlines()) == 1


def test_a_key_given_twice_is_refused_with_its_path(folder: Path) -> None:
    message = refused(folder, with_base("wall: {roughness: 0}", "wall: {roughness: 1}"))
    assert message.startswith("base.wall: "), message
    assert "line 4" in message


@pytest.mark.usefixtures("in_project")
@pytest.mark.parametrize("name", NAMED)
def test_every_scenario_of_the_project_loads_by_name_and_by_path(name: str) -> None:
    by_name = load_scenario(name)
    assert by_name.name == name
    assert load_scenario(str(PROJECT / "config" / f"{name}.yaml")) == by_name


@pytest.mark.usefixtures("in_project")
def test_the_demo_is_what_the_project_promises() -> None:
    scenario = load_scenario("demo")
    axes = {axis.path: axis.values for axis in scenario.axes}
    assert {0.0, 0.59} <= set(axes["wall.roughness"])
    assert len(axes["rheometer.stress"]) >= 4
    assert min(axes["rheometer.stress"]) < 0.055, "no stress below the yield stress"
    paper = Parameters()
    for run in scenario.runs():
        parameters, given_radius = run.parameters, run.parameters.suspension.mean_radius
        particles = len(particle_radii(parameters))
        assert particles >= 40, f"{particles} particles"
        assert parameters.channel.height >= 12 * given_radius
        promised = paper.suspension.model_copy(update={"area_reference": "free"})
        assert parameters.suspension == promised, "the suspension differs"
        for path in MATERIAL:
            assert value_at(parameters, path) == value_at(paper, path), f"{path} differs"


@pytest.mark.usefixtures("in_project")
def test_the_paper_scenario_is_the_literal_one_with_other_numerics() -> None:
    runs = zip(load_scenario("paper").runs(), load_scenario("literal").runs(), strict=True)
    for fast, literal in runs:
        assert fast.coordinates == literal.coordinates
        for path in (*MATERIAL, "channel.length", "channel.height"):
            same = value_at(fast.parameters, path) == value_at(literal.parameters, path)
            assert same, f"{path} differs"
        for group in ("suspension", "packing", "wall", "rheometer"):
            assert getattr(fast.parameters, group) == getattr(literal.parameters, group)


@pytest.mark.usefixtures("in_project")
def test_the_literal_scenario_has_the_papers_numbers() -> None:
    scenario = load_scenario("literal")
    numbers = {
        "solvent.viscosity": 1.0,
        "membrane.elastic_constant": 1.0,
        "suspension.area_fraction": 0.84,
        "suspension.size_ratio": 1.4,
        "channel.length": 4096 / 8192,
        "channel.height": 0.44,
        "steric.length": 9 / 8192,
        "steric.energy": 1e-9,
        "hydrodynamics.resolution": 8192,
        "hydrodynamics.node_spacing": 1.42,
        "wall.stiffness": 20000,
        "wall.bump_separation": 5.0,
        "time_stepping.step": 0.002,
        "time_stepping.ageing_time": 50,
    }
    for run in scenario.runs():
        for path, number in numbers.items():
            value = value_at(run.parameters, path)
            assert value == number, f"{path} is {value}, the paper's is {number}"
        channel = run.parameters.channel
        assert channel.height + channel.outer_gap == pytest.approx(1.0, abs=1e-15)
        assert len(particle_radii(run.parameters)) == 800
    assert len(scenario.runs()) == 6 * 9 * 2


@pytest.mark.usefixtures("in_project")
@pytest.mark.parametrize("name", ["dem", "no-such-thing"])
def test_an_unknown_name_is_refused_with_those_there_are(name: str) -> None:
    with pytest.raises(ConfigError, match=r"is not in the folder config .*; .*demo") as caught:
        load_scenario(name)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("name", ["", ".", "../demo", "-x", "a b", "x" * 65, "a\nb", "demo.yml"])
def test_an_impossible_name_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match="is not a scenario's name") as caught:
        load_scenario(name)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("stem", ["a b", "-x", "é", "x" * 65])
def test_a_file_whose_name_is_no_scenarios_name_is_refused(tmp_path: Path, stem: str) -> None:
    path = tmp_path / f"{stem}.yaml"
    path.write_text(TEXT, encoding="utf-8")
    with pytest.raises(ConfigError, match="is not a scenario's name"):
        load_scenario(str(path))


def test_without_a_config_folder_the_remedy_is_to_change_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match="change to the project's folder"):
        load_scenario("demo")


def accepts_or_refuses(folder: Path, text: str | bytes) -> None:
    try:
        loaded(folder, text)
    except ConfigError as error:
        message = str(error)
        assert message.splitlines() == [message], f"not one line: {message!r}"
        assert message.startswith(str(folder)), message
        assert len(message.removeprefix(str(folder))) < 600, f"{len(message)} characters"
        assert message.isprintable(), ascii(message)


SIGNS = "\t\n :[]{}'\"#>|~-%\x00\ufeff\ud800\u2028"
WORDS = "&a *a !!int !!set !!binary <<: ? 1e-3 .nan .inf null wall 2024-01-01 \\ud800"
SNIPPETS = st.sampled_from(
    [*SIGNS, *(f"{word} " for word in WORDS.split()), "%YAML 1.1\n", "---\n", "1" * 400]
)


@given(
    edits=st.lists(
        st.tuples(st.integers(0, len(TEXT)), st.integers(0, 12), SNIPPETS | st.text(max_size=4)),
        min_size=1,
        max_size=4,
    )
)
@settings(max_examples=300, deadline=None)
def test_a_mangled_file_loads_or_is_refused_in_one_line(
    folder: Path, edits: list[tuple[int, int, str]]
) -> None:
    text = TEXT
    for start, length, inserted in edits:
        text = text[:start] + inserted + text[start + length :]
    accepts_or_refuses(folder, text)


@given(content=st.binary(max_size=200))
@settings(max_examples=100, deadline=None)
def test_a_binary_file_loads_or_is_refused_in_one_line(folder: Path, content: bytes) -> None:
    accepts_or_refuses(folder, content)


def places(tree: object, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    yield above
    if isinstance(tree, dict | list):
        for key in tree if isinstance(tree, dict) else range(len(tree)):
            yield from places(tree[key], (*above, key))


TREE = YAML(typ="safe", pure=True).load(TEXT)
LEAVES = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(st.characters(min_codepoint=32, max_codepoint=0x2FFF), max_size=8)
    | st.sampled_from([5e-324, 1e-300, 1e300, -0.0, 2**63, 10**300, "1e-3", "no", "rate"])
)
KEYS = st.sampled_from(
    [*all_fields(Parameters), "wall", "roughness", "stress", "axes", "", ".", "a.b.c"]
)
VALUES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=2)
)


@given(
    changes=st.lists(
        st.tuples(st.sampled_from(list(places(TREE))[1:]), KEYS | st.none(), VALUES),
        min_size=1,
        max_size=3,
    )
)
@settings(max_examples=300, deadline=None)
def test_a_mangled_tree_loads_or_is_refused_in_one_line(
    folder: Path, changes: list[tuple[tuple[Any, ...], str | None, object]]
) -> None:
    tree = copy.deepcopy(TREE)
    for place, key, value in changes:
        node: Any = tree
        for step in place[:-1]:  # An earlier change may have taken the place away.
            node = node.get(step) if isinstance(node, dict) else None
        last = place[-1]
        if isinstance(node, dict):
            node[last if key is None else key] = value
        elif isinstance(node, list) and isinstance(last, int) and last < len(node):
            node[last] = value
    stream = io.StringIO()
    YAML(typ="safe", pure=True).dump(tree, stream)
    accepts_or_refuses(folder, stream.getvalue())
