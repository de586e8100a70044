import dataclasses
import json

import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st

from softslip.checkpoint import (
    Checkpoints,
    Identity,
    check_identity,
    read_header,
    state_arrays,
    state_from,
)
from softslip.errors import CheckpointError, StorageError
from softslip.state import State

IDENTITY = Identity("shear", "a" * 16, "b" * 64, "c" * 16, "python 3", json.dumps({"seed": 1}))


def state(particle_nodes=5, wall_nodes=3, seed=0):
    random = scenes.generator(seed)
    vector = random.standard_normal(2 * particle_nodes + 4 * wall_nodes + 4)
    direction = random.standard_normal(vector.size)
    return State(vector, particle_nodes, wall_nodes, 0.1, 7, 0.02, 300.0, 4, direction)


def said_by(folder, identity=IDENTITY, **options):
    said = []
    return Checkpoints(folder, identity, said.append, **options), said


def written(folder, generations=1):
    checkpoints, _ = said_by(folder)
    for number in range(generations):
        point = dataclasses.replace(state(), step=number)
        checkpoints.save(state_arrays(point), point, 2.0)
    return checkpoints


def test_a_state_comes_back_bit_for_bit(tmp_path):
    checkpoints = written(tmp_path)
    found = state_from(checkpoints.load(), state())
    for field in dataclasses.fields(State):
        one, other = getattr(found, field.name), getattr(state(), field.name)
        assert np.array_equal(one, other) or field.name == "step"
        assert type(one) is type(other)


def test_the_header_says_where_the_run_is(tmp_path):
    checkpoints = written(tmp_path)
    header = read_header(checkpoints.newest)
    assert (header.stage, header.run, header.fingerprint) == ("shear", "a" * 16, "c" * 16)
    assert (header.time, header.end, header.step, header.restarts) == (0.1, 2.0, 0, 0)
    assert header.identity == IDENTITY
    again, _ = said_by(tmp_path)
    again.load()
    again.save(state_arrays(state()), state(), 2.0)
    later = read_header(again.newest)
    assert later.restarts == again.restarts == 1
    assert later.seconds >= header.seconds
    assert later.written >= header.written


def test_two_generations_are_kept(tmp_path):
    checkpoints = written(tmp_path, generations=3)
    assert read_header(checkpoints.newest).step == 2
    assert read_header(checkpoints.previous).step == 1
    assert len(list(tmp_path.iterdir())) == 2
    checkpoints.remove()
    assert not list(tmp_path.iterdir())
    assert checkpoints.load() is None


@given(st.data())
def test_no_damage_is_believed(tmp_path_factory, data):
    """Any bit flipped or any part missing, anywhere."""
    checkpoints = written(tmp_path_factory.mktemp("damaged"), generations=2)
    content = bytearray(checkpoints.newest.read_bytes())
    # Files differ in length by the digits of their time of writing.
    place = int(len(content) * data.draw(st.floats(0, 1, exclude_max=True)))
    if data.draw(st.booleans()):
        content[place] ^= 1 << data.draw(st.integers(0, 7))
    else:
        del content[place:]
    checkpoints.newest.write_bytes(content)
    again, said = said_by(checkpoints.newest.parent)
    arrays = again.load()
    assert int(arrays["step"]) == 0, "the generation before"
    assert "it is removed" in said[0]


def test_when_nothing_sound_is_left_it_is_said(tmp_path):
    checkpoints = written(tmp_path, generations=2)
    for path in (checkpoints.newest, checkpoints.previous):
        path.write_bytes(b"\0" * 100)
    again, said = said_by(tmp_path)
    assert again.load() is None
    assert len(said) == 2
    required, _ = said_by(tmp_path, required=True)
    with pytest.raises(CheckpointError, match="leave out --resume"):
        required.load()


def test_another_schema_is_refused(tmp_path):
    newest = written(tmp_path).newest
    newest.write_bytes(newest.read_bytes().replace(b"checkpoint 1 ", b"checkpoint 2 ", 1))
    with pytest.raises(CheckpointError, match="schema '2', not 1"):
        read_header(newest)


def test_a_pickle_is_not_opened(tmp_path):
    checkpoints, _ = said_by(tmp_path)
    with pytest.raises(ValueError, match="pickle"):
        checkpoints.save({"vector": np.array([object()])}, state(), 1.0)
    assert not list(tmp_path.glob("*.checkpoint"))


def test_the_key_that_differs_is_named():
    seeds = dataclasses.replace(
        IDENTITY, run="d" * 16, parameters=json.dumps({"wall": {"roughness": 0.3}, "seed": 1})
    )
    mine = dataclasses.replace(
        seeds, run="e" * 16, parameters=json.dumps({"wall": {"roughness": 0.4}, "seed": 1})
    )
    with pytest.raises(CheckpointError, match=r"wall\.roughness is 0\.3, but this run has 0\.4"):
        check_identity("x", seeds, mine)


def test_parameters_of_other_stages_do_not_count():
    other = dataclasses.replace(IDENTITY, parameters=json.dumps({"seed": 2}))
    check_identity("x", other, IDENTITY)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("particle_nodes", np.asarray(6), "particle_nodes is 6, but this run has 5"),
        ("wall_nodes", np.asarray([3]), "wall_nodes"),
        ("vector", np.zeros(3), "shape"),
        ("vector", np.zeros(26, np.float32), "type float32"),
        ("vector", np.full(26, np.nan), "vector is not finite"),
        ("direction", np.full(26, np.inf), "direction is not finite"),
        ("direction", np.zeros(3), "shape"),
        ("time", np.asarray(-1.0), "time is -1"),
        ("time", np.asarray(np.nan), "time is nan"),
        ("step", np.asarray(-1), "step is -1"),
        ("step", np.asarray(1.5), "type float64"),
        ("spectral_radius", np.asarray(np.inf), "spectral_radius is inf"),
        ("radius_age", None, "radius_age is missing"),
    ],
)
def test_a_state_out_of_range_is_refused(name, value, said):
    arrays = state_arrays(state())
    assert arrays["vector"].shape == (26,)
    if value is None:
        del arrays[name]
    else:
        arrays[name] = value
    with pytest.raises(CheckpointError, match=said):
        state_from(arrays, state())


def test_a_failed_write_leaves_what_was_there(tmp_path, monkeypatch):
    checkpoints = written(tmp_path, generations=2)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(StorageError, match="No space left on device"):
        checkpoints.save(state_arrays(state()), state(), 1.0)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
