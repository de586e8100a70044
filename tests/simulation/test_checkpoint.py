import dataclasses
import hashlib
import io
import json
import zipfile

import numpy as np
import pytest
from checkpoints import IDENTITY, said_by, state, written

from softslip.errors import CheckpointError
from softslip.simulation.checkpoint import read_header, state_from


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
    assert (header.time, header.end, header.step, header.restarts) == (0.1, 2.0, 0, 0)
    assert header.identity == IDENTITY
    again, _ = said_by(tmp_path)
    again.load()
    again.save(state().parts, state(), 2.0)
    later = read_header(again.newest)
    assert later.restarts == again.restarts == 1
    assert later.seconds >= header.seconds
    assert later.written >= header.written


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
        ("drift", np.full(26, np.inf), "drift is not finite"),
        ("drift", np.zeros(3), "shape"),
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
