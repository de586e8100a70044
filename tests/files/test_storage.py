import os

import netCDF4
import numpy as np
import pytest
import scenes
import xarray as xr

import softslip
from softslip.errors import DatasetError, StorageError
from softslip.files.discovery import discovery
from softslip.files.storage import (
    CONTENT_DIGEST,
    RECORD_DIGEST,
    digests,
    read_dataset,
    write_dataset,
)


@pytest.fixture
def dataset():
    random = scenes.generator(1)
    return xr.Dataset(
        {
            "stress": ("time", random.standard_normal(50), {"units": "stress unit"}),
            "count": ("particle", np.arange(7)),
            "far": ("time", np.where(np.arange(50) % 3, 1e-300, np.nan)),
            "single": ((), 0.1),
        },
        coords={"time": ("time", np.linspace(0, 1, 50)), "wall": ("wall", ["lower", "upper"])},
        attrs={"particles": 7},
    )


@pytest.fixture
def written(dataset, tmp_path):
    path = tmp_path / "deep" / "run.nc"
    write_dataset(dataset, path, stage="toy", run="abc", title="A run")
    return path


def refusal(path, **wanted):
    with pytest.raises(DatasetError) as caught:
        read_dataset(path, **({"stage": "toy"} | wanted))
    text = str(caught.value)
    assert str(path) in text
    assert "\n" not in text, text
    return text


def test_what_is_written_is_read_to_the_last_bit(written, dataset):
    read = read_dataset(written, stage="toy", run="abc")
    for name in dataset.variables:
        assert read[name].dtype == dataset[name].dtype or name == "wall"
        assert read[name].values.tolist() == dataset[name].values.tolist() or name == "far"
        assert read[name].attrs == dataset[name].attrs
    assert read["far"].values.tobytes() == dataset["far"].values.tobytes()
    assert read.attrs["particles"] == 7


def test_files_say_what_they_are(written):
    attributes = read_dataset(written, stage="toy").attrs
    assert attributes["Conventions"] == "CF-1.11, ACDD-1.3"
    assert (attributes["stage"], attributes["run"]) == ("toy", "abc")
    assert attributes["title"] == "A run"
    assert softslip.__version__ in attributes["source"]
    assert {"history", "references", "date_created"} <= set(attributes)
    with netCDF4.Dataset(written) as file:
        assert file.id == "softslip.toy.abc"
        # No variable lies along the walls, whose labels are therefore the whole file's.
        others = {*discovery("toy", "abc"), *attributes, "coordinates"}
        assert set(file.ncattrs()) == others, "what others look for is in the file alone"


def test_what_a_dataset_says_of_itself_goes_before_what_is_said_of_its_kind(dataset, tmp_path):
    path = tmp_path / "run.nc"
    recorded = dataset.assign_attrs(summary="its own words", stage="other", date_created="long ago")
    write_dataset(recorded, path, stage="toy", run="abc", title="A run")
    read = read_dataset(path, stage="toy")
    assert read.attrs["summary"] == "its own words"
    assert read.attrs["date_created"] != "long ago"


def test_nothing_is_missing_from_a_coordinate(written):
    with netCDF4.Dataset(written) as file:
        assert "_FillValue" not in file["model_time"].ncattrs()
        assert np.isnan(file["far"]._FillValue), "what is unknown is NaN, see the schema"


def test_files_from_before_there_were_conventions_are_read(dataset, tmp_path):
    path = tmp_path / "old.nc"
    old = dataset.assign_attrs(stage="toy", run="abc", Conventions="CF-1.11")
    old.assign_attrs(digests(old)).to_netcdf(path)
    read = read_dataset(path, stage="toy", run="abc")
    assert read["stress"].attrs["units"] == "stress unit"
    assert read.drop_attrs().identical(dataset.drop_attrs())


def test_names_that_only_files_have_are_refused(dataset, written):
    before = written.read_bytes()
    with pytest.raises(StorageError, match=r"run\.nc: cannot be written \(wall_label is a name"):
        write_dataset(
            dataset.assign(wall_label=1), written, stage="toy", run="abc", title="Another"
        )
    assert written.read_bytes() == before


def test_writing_leaves_the_dataset_as_it_was(dataset, tmp_path):
    before = dataset.copy(deep=True)
    write_dataset(dataset, tmp_path / "run.nc", stage="toy", run="abc", title="A run")
    assert dataset.identical(before)


def test_every_number_carries_a_checksum(written):
    with netCDF4.Dataset(written) as file:
        for name in ("stress", "count", "far", "model_time"):
            filters = file[name].filters()
            assert filters["fletcher32"], name
            assert filters["zlib"], name


def test_a_damaged_byte_is_found(written, dataset):
    """Wherever a chunk of data is damaged, its checksum tells."""
    content = bytearray(written.read_bytes())
    with netCDF4.Dataset(written) as file:
        file.set_auto_mask(False)
        assert file["stress"][:].tobytes() == dataset["stress"].values.tobytes()
    found = 0
    for place in range(len(content) // 2, len(content), max(len(content) // 40, 1)):
        damaged = bytearray(content)
        damaged[place] ^= 0xFF
        written.write_bytes(damaged)
        try:
            read = read_dataset(written, stage="toy")
        except DatasetError:
            found += 1
            continue
        for name in ("stress", "count", "time"):
            assert np.array_equal(read[name].values, dataset[name].values), f"byte {place}: {name}"
    assert found > 0


def test_a_failed_writer_leaves_the_old_file_and_no_other(written, dataset, monkeypatch):
    before = written.read_bytes()

    def fail(self, path, **others):
        path.write_bytes(b"half a file")
        raise OSError("disk full")

    monkeypatch.setattr(xr.Dataset, "to_netcdf", fail)
    with pytest.raises(StorageError, match=r"run\.nc: cannot be written \(disk full\)"):
        write_dataset(dataset, written, stage="toy", run="new", title="Another")
    assert written.read_bytes() == before
    assert [each.name for each in written.parent.iterdir()] == [written.name]


def test_a_rewritten_file_replaces_the_old_one(written, dataset):
    write_dataset(dataset * 2, written, stage="toy", run="new", title="Another")
    read = read_dataset(written, stage="toy", run="new")
    assert np.array_equal(read["stress"].values, 2 * dataset["stress"].values)
    assert [each.name for each in written.parent.iterdir()] == [written.name]


@pytest.mark.parametrize("umask", [0o022, 0o002, 0o077, 0o027])
def test_the_umask_says_who_may_read_and_write(dataset, tmp_path, umask):
    before = os.umask(umask)
    try:
        path = tmp_path / "new" / "toy.nc"
        write_dataset(dataset, path, stage="toy", run="abc", title="Toy")
    finally:
        os.umask(before)
    assert path.stat().st_mode & 0o777 == 0o666 & ~umask
    assert path.parent.stat().st_mode & 0o777 == 0o777 & ~umask


def test_missing_files_are_refused(tmp_path):
    assert "toy stage" in refusal(tmp_path / "none.nc")


def test_other_stages_and_runs_are_refused(written):
    assert "'toy', not 'ageing'" in refusal(written, stage="ageing")
    assert "'abc', not 'xyz'" in refusal(written, run="xyz")


@pytest.mark.parametrize("content", [b"", b"not a dataset\n" * 100, b"\x89HDF\r\n\x1a\n"])
def test_garbage_is_refused(tmp_path, content):
    path = tmp_path / "garbage.nc"
    path.write_bytes(content)
    refusal(path)


@pytest.mark.parametrize("part", [0.02, 0.3, 0.7, 0.99])
def test_truncated_files_are_refused(written, part):
    content = written.read_bytes()
    written.write_bytes(content[: int(part * len(content))])
    refusal(written)


def test_a_folder_is_refused(tmp_path):
    refusal(tmp_path)


def test_a_dataset_of_nobody_is_refused(tmp_path, dataset):
    path = tmp_path / "foreign.nc"
    dataset.to_netcdf(path)
    assert "of stage None" in refusal(path)


def test_words_of_parts_that_were_read_keep_their_length_in_the_whole(tmp_path):
    paths = [tmp_path / f"{number}.nc" for number in range(2)]
    for path, words in zip(paths, (["short"], ["much longer"]), strict=True):
        part = xr.Dataset({"label": ("cell", np.array(words, dtype=object))})
        write_dataset(part, path, stage="part", run="", title="")
    whole = xr.concat([read_dataset(path, stage="part") for path in paths], "cell")
    write_dataset(whole, tmp_path / "whole.nc", stage="whole", run="", title="")
    found = read_dataset(tmp_path / "whole.nc", stage="whole")
    assert found["label"].values.tolist() == ["short", "much longer"]


def altered(path, change):
    """Change a written file in place, as another program would."""
    with netCDF4.Dataset(path, "a") as file:
        change(file)


def set_value(name, place, value):
    def change(file):
        file.variables[name][place] = value

    return change


@pytest.mark.parametrize(
    "change",
    [
        set_value("stress", 3, 0.25),
        set_value("single", ..., np.nextafter(0.1, 1)),
        set_value("count", 0, 1),
        set_value("wall_label", 1, "middle"),
        lambda file: file.setncattr("particles", 8),
        lambda file: file.setncattr("history", "long ago"),
        lambda file: file.setncattr("added", "word"),
        lambda file: file.delncattr("title"),
        lambda file: file.variables["stress"].setncattr("units", "Pa"),
        lambda file: file.variables["stress"].setncattr("model_units", "length unit"),
        lambda file: file.variables["far"].setncattr("coverage_content_type", "coordinate"),
        lambda file: file.setncattr("license", "none"),
        lambda file: file.renameVariable("far", "near"),
        lambda file: file.setncattr(CONTENT_DIGEST, "0" * 64),
        lambda file: file.delncattr(RECORD_DIGEST),
    ],
)
def test_an_altered_file_is_refused(written, change):
    altered(written, change)
    assert "sha256" in refusal(written)


def test_a_file_without_digests_is_refused(written):
    bare = xr.load_dataset(written)
    for key in (CONTENT_DIGEST, RECORD_DIGEST):
        del bare.attrs[key]
    bare.to_netcdf(written)
    assert "is missing" in refusal(written)


def test_the_same_content_has_the_same_digest_whenever_it_is_written(written, dataset, tmp_path):
    first = read_dataset(written, stage="toy").attrs
    other = tmp_path / "later.nc"
    names = reversed(list(dataset.variables))
    shuffled = xr.Dataset({name: dataset.variables[name] for name in names}, attrs=dataset.attrs)
    shuffled = shuffled.assign_attrs(provenance="elsewhere")
    write_dataset(shuffled, other, stage="toy", run="abc", title="A run")
    second = read_dataset(other, stage="toy").attrs
    assert first[CONTENT_DIGEST] == second[CONTENT_DIGEST]
    assert first[RECORD_DIGEST] != second[RECORD_DIGEST]


@pytest.mark.parametrize("key", ["date_created", "history", "provenance"])
def test_when_and_where_is_no_content(dataset, key):
    first, second = (digests(dataset.assign_attrs({key: words})) for words in ("one", "other"))
    assert first[CONTENT_DIGEST] == second[CONTENT_DIGEST]
    assert first[RECORD_DIGEST] != second[RECORD_DIGEST]


def test_byte_order_is_no_content(dataset):
    swapped = dataset.assign(stress=("time", dataset["stress"].values.astype(">f8")))
    swapped["stress"].attrs = dataset["stress"].attrs
    assert digests(swapped) == digests(dataset)
    narrow = dataset.assign(stress=dataset["stress"].astype(np.float32))
    narrow["stress"].attrs = dataset["stress"].attrs
    assert digests(narrow) != digests(dataset)


def test_what_does_not_read_back_is_not_kept(written, dataset, monkeypatch):
    before = written.read_bytes()
    to_netcdf = xr.Dataset.to_netcdf

    def careless(self, path, **others):
        return to_netcdf(self.assign(single=((), 0.3)), path, **others)

    monkeypatch.setattr(xr.Dataset, "to_netcdf", careless)
    with pytest.raises(StorageError, match="does not fit what the file holds"):
        write_dataset(dataset, written, stage="toy", run="new", title="Another")
    assert written.read_bytes() == before
