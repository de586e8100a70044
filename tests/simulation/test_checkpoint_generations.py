import dataclasses
import json
from types import SimpleNamespace

import pytest
from checkpoints import IDENTITY, said_by, state, written
from hypothesis import given
from hypothesis import strategies as st

from softslip.errors import CheckpointError, StorageError
from softslip.simulation.checkpoint import read_header
from softslip.simulation.checkpoint_generations import check_identity


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
    monkeypatch.setattr("softslip.simulation.checkpoint_generations.time", clock)
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


def test_a_failed_write_leaves_what_was_there(tmp_path, monkeypatch):
    checkpoints = written(tmp_path, generations=2)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(StorageError, match="No space left on device"):
        checkpoints.save(state().parts, state(), 1.0)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
