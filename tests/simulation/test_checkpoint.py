import dataclasses
import hashlib
import io
import json
import zipfile
from types import SimpleNamespace

import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st

from softslip.errors import CheckpointError, StorageError
from softslip.simulation.checkpoint import (
    Checkpoints,
    Identity,
    check_identity,
    read_header,
    state_from,
)
from softslip.solver.integrators import Memory
from softslip.solver.state import State

IDENTITY = Identity("shear", "a" * 16, "b" * 64, "c" * 16, "python 3", json.dumps({"seed": 1}))


def state(particle_nodes=5, wall_nodes=3, seed=0):
    random = scenes.generator(seed)
    vector = random.standard_normal(2 * particle_nodes + 4 * wall_nodes + 4)
    direction = random.standard_normal(vector.size)
    return State(vector, particle_nodes, wall_nodes, 0.1, 7, Memory(0.02, 300.0, 4, direction))


def said_by(folder, identity=IDENTITY, **options):
    said = []
    return Checkpoints(folder, identity, said.append, **options), said


def written(folder, generations=1):
    checkpoints, _ = said_by(folder)
    for number in range(generations):
        point = dataclasses.replace(state(), step=number)
        checkpoints.save(point.parts, point, 2.0)
    return checkpoints


def test_a_state_comes_back_bit_for_bit(tmp_path):
    checkpoints = written(tmp_path)
    found = state_from(checkpoints.load(), state())
    kept = dataclasses.replace(state(), step=found.step)
    for one, other in ((found, kept), (found.memory, kept.memory)):
        for field in dataclasses.fields(one):
            value, wanted = getattr(one, field.name), getattr(other, field.name)
            assert type(value) is type(wanted)
            assert field.name == "memory" or np.array_equal(value, wanted)


def test_a_state_without_an_estimate_of_the_spectral_radius_comes_back():
    """Its direction has no entries; any other number but the vector's is wrong."""
    memory = dataclasses.replace(state().memory, direction=np.zeros(0))
    young = dataclasses.replace(state(), memory=memory)
    assert state_from(young.parts, state()).memory.direction.shape == (0,)
    for size in (1, 25):
        arrays = young.parts | {"direction": np.zeros(size)}
        with pytest.raises(CheckpointError, match=rf"direction \({size},\)"):
            state_from(arrays, state())


def test_the_header_says_where_the_run_is(tmp_path):
    checkpoints = written(tmp_path)
    header = read_header(checkpoints.newest)
    assert (header.stage, header.run, header.fingerprint) == ("shear", "a" * 16, "c" * 16)
    assert (header.time, header.end, header.step, header.restarts) == (0.1, 2.0, 0, 0)
    assert header.identity == IDENTITY
    again, _ = said_by(tmp_path)
    again.load()
    again.save(state().parts, state(), 2.0)
    later = read_header(again.newest)
    assert later.restarts == again.restarts == 1
    assert later.seconds >= header.seconds
    assert later.written >= header.written


def test_two_generations_are_kept(tmp_path):
    checkpoints = written(tmp_path, generations=3)
    assert read_header(checkpoints.newest).step == 2
    assert read_header(checkpoints.previous).step == 1
    assert len(list(tmp_path.iterdir())) == 2


def test_only_the_newest_outlives_the_run(tmp_path):
    checkpoints = written(tmp_path, generations=2)
    checkpoints.finish()
    assert [*tmp_path.iterdir()] == [checkpoints.newest]
    checkpoints.finish()
    assert [*tmp_path.iterdir()] == [checkpoints.newest]


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
    with pytest.raises(CheckpointError, match="run without --resume"):
        required.load()


@pytest.mark.parametrize("schema", [b"0", b"2"])
def test_another_schema_is_refused(tmp_path, schema):
    newest = written(tmp_path).newest
    newest.write_bytes(newest.read_bytes().replace(b"checkpoint 1 ", b"checkpoint %b " % schema, 1))
    with pytest.raises(CheckpointError, match=f"schema '{schema.decode()}', not 1"):
        read_header(newest)


def test_a_first_line_with_more_on_it_is_refused(tmp_path):
    newest = written(tmp_path).newest
    newest.write_bytes(newest.read_bytes().replace(b"\n", b" more\n", 1))
    with pytest.raises(CheckpointError, match="no checkpoint, or damaged"):
        read_header(newest)


def test_no_byte_of_the_header_and_few_of_the_arrays_can_change_unseen(tmp_path):
    checkpoints = written(tmp_path)
    content = checkpoints.newest.read_bytes()
    header = content.index(b"\n", content.index(b"\n") + 1)
    for place in (*range(header), *range(header, len(content), 16)):
        damaged = bytearray(content)
        damaged[place] ^= 1
        checkpoints.newest.write_bytes(damaged)
        assert checkpoints.load() is None, f"byte {place} of {len(content)}"


def test_without_the_newest_the_one_before_counts(tmp_path):
    """As after a kill between the two renames of `save`."""
    checkpoints = written(tmp_path, generations=2)
    checkpoints.newest.unlink()
    again, said = said_by(tmp_path)
    assert int(again.load()["step"]) == 0
    assert "resuming from" in said[0]


def test_one_generation_alone_outlives_the_run_whichever_it_is(tmp_path):
    """As after a kill between the two renames of `save`."""
    checkpoints = written(tmp_path)
    checkpoints.newest.replace(checkpoints.previous)
    checkpoints.finish()
    assert [*tmp_path.iterdir()] == [checkpoints.previous]


@pytest.mark.parametrize("digit", ["0", "f"])
def test_one_of_another_parent_is_passed_over_and_said_so(tmp_path, digit):
    checkpoints = written(tmp_path, generations=2)
    other = dataclasses.replace(IDENTITY, parent=digit * 64)
    again, said = said_by(tmp_path, identity=other)
    assert again.load() is None
    name = checkpoints.newest.name
    assert said == [f"{name} continues an earlier result of the stage before; starting again"]
    required, _ = said_by(tmp_path, required=True, identity=other)
    with pytest.raises(CheckpointError, match="parent is 'b"):
        required.load()


def test_no_other_difference_hides_behind_another_parent(tmp_path):
    written(tmp_path)
    other = dataclasses.replace(IDENTITY, parent="f" * 64, environment="python 2")
    again, _ = said_by(tmp_path, identity=other)
    with pytest.raises(CheckpointError, match="parent is 'b"):
        again.load()


def test_times_of_work_add_up_over_restarts(tmp_path, monkeypatch):
    clock = SimpleNamespace(monotonic=lambda: 100.0, process_time=lambda: 0.5, time=lambda: 5e8)
    monkeypatch.setattr("softslip.simulation.checkpoint.time", clock)
    first, _ = said_by(tmp_path)
    clock.monotonic, clock.process_time = (lambda: 130.0), (lambda: 7.0)
    first.save(state().parts, state(), 2.0)
    header = read_header(first.newest)
    assert (header.seconds, header.core_seconds, header.written) == (30.0, 7.0, 5e8)
    clock.monotonic, clock.process_time = (lambda: 10.0), (lambda: 0.5)
    again, _ = said_by(tmp_path)
    again.load()
    clock.monotonic, clock.process_time = (lambda: 15.0), (lambda: 2.0)
    again.save(state().parts, state(), 2.0)
    later = read_header(again.newest)
    assert (later.seconds, later.core_seconds, later.restarts) == (35.0, 9.0, 1)
    assert again.core_seconds == 9.0


def forged(checkpoints, rest):
    """Put something in place of the arrays, with digests that are right."""
    line = checkpoints.newest.read_bytes().split(b"\n")[1]
    words = json.loads(line) | {"arrays": hashlib.sha256(rest).hexdigest()}
    line = json.dumps(words).encode()
    first = f"softslip-checkpoint 1 {hashlib.sha256(line).hexdigest()}".encode()
    checkpoints.newest.write_bytes(b"\n".join((first, line, rest)))


def pickled():
    buffer = io.BytesIO()
    np.savez(buffer, vector=np.array([{}], dtype=object))
    return buffer.getvalue()


def hollow():
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("vector.npy", b"")
    return buffer.getvalue()


@pytest.mark.parametrize("rest", [b"no arrays", b"PK\x03\x04 and no more", pickled(), hollow()])
def test_what_holds_no_plain_arrays_is_not_believed(tmp_path, rest):
    checkpoints = written(tmp_path)
    forged(checkpoints, rest)
    again, said = said_by(tmp_path)
    assert again.load() is None
    assert "holds no arrays" in said[0]


def test_a_pickle_is_not_opened(tmp_path):
    checkpoints, _ = said_by(tmp_path)
    with pytest.raises(ValueError, match="pickle"):
        checkpoints.save({"vector": np.array([object()])}, state(), 1.0)
    assert not list(tmp_path.glob("*.checkpoint"))


@pytest.mark.parametrize("runs", ["de", "ed"])
@pytest.mark.parametrize(("found", "wanted"), [(0.3, 0.4), (0.4, 0.3)])
def test_the_key_that_differs_is_named(runs, found, wanted):
    def rough(run, roughness):
        parameters = json.dumps({"wall": {"roughness": roughness}, "seed": 1})
        return dataclasses.replace(IDENTITY, run=run * 16, parameters=parameters)

    said = rf"wall\.roughness is {found}, but this run has {wanted}"
    with pytest.raises(CheckpointError, match=said):
        check_identity("x", rough(runs[0], found), rough(runs[1], wanted))


@pytest.mark.parametrize("key", ["stage", "run", "parent", "fingerprint", "environment"])
@pytest.mark.parametrize("values", [("0", "z"), ("z", "0")])
def test_a_checkpoint_of_something_else_is_refused(key, values):
    """Whatever parameters of other stages say meanwhile, unless it is the run that differs."""
    found, wanted = (dataclasses.replace(IDENTITY, **{key: value}) for value in values)
    said = f"x: {key} is '{values[0]}', but this run has '{values[1]}'"
    with pytest.raises(CheckpointError, match=said):
        check_identity("x", found, wanted)
    if key != "run":
        found = dataclasses.replace(found, parameters=json.dumps({"seed": 2}))
        with pytest.raises(CheckpointError, match=said):
            check_identity("x", found, wanted)


def test_parameters_of_other_stages_do_not_count():
    other = dataclasses.replace(IDENTITY, parameters=json.dumps({"seed": 2}))
    check_identity("x", other, IDENTITY)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("particle_nodes", np.asarray(6), "particle_nodes is 6, but this run has 5"),
        ("particle_nodes", np.asarray(4), "particle_nodes is 4, but this run has 5"),
        ("wall_nodes", np.asarray(2), "wall_nodes is 2, but this run has 3"),
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
    arrays = state().parts
    assert arrays["vector"].shape == (26,)
    if value is None:
        del arrays[name]
    else:
        arrays[name] = value
    with pytest.raises(CheckpointError, match=said):
        state_from(arrays, state())


@pytest.mark.parametrize("size", [3, 25, 27])
def test_a_vector_of_another_length_is_refused(size):
    arrays = state().parts | {"vector": np.zeros(size), "direction": np.zeros(0)}
    with pytest.raises(CheckpointError, match=rf"shape \({size},\).* this run has \(26,\)"):
        state_from(arrays, state())


def test_a_failed_write_leaves_what_was_there(tmp_path, monkeypatch):
    checkpoints = written(tmp_path, generations=2)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(StorageError, match="No space left on device"):
        checkpoints.save(state().parts, state(), 1.0)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
