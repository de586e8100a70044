"""Seals, claims, comparisons and reruns."""

import functools
import json
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib.figure
import netCDF4
import numpy as np
import pytest
import scenes
import small_results
import xarray as xr
from small_results import attribute, call, edit, edited_json, redigest, results

from softslip.analysis.figures import Movie, save_figure
from softslip.config.scenario import load_scenario
from softslip.errors import DatasetError
from softslip.files.expected_results import run_shown
from softslip.files.products import DATASETS, FIGURES, figures_of
from softslip.files.seals import check_seal, seal
from softslip.files.storage import digests, read_dataset, write_dataset
from softslip.provenance.verification import (
    Verification,
    agreement,
    consistency,
    possible_reruns,
    reexecute,
    sampled,
    verify,
)
from softslip.provenance.verification.agreement import DIFFERS, EQUAL, WITHIN, Agreement, compare
from softslip.provenance.verification.examination import examine
from softslip.provenance.verification.reexecution import (
    FAILED,
    STRETCH,
    WHOLE,
    RerunOutcome,
    run_command,
)

__all__ = ["results"]

PROCESSOR = {"processor": "another one"}


def verified(results: Path, scenario: str | None = None) -> Verification:
    return verify(load_scenario(scenario or small_results.source(results)), results)


def only(results: Path, pattern: str) -> Path:
    return sorted(results.glob(pattern))[0]


# --- seals -------------------------------------------------------------------------------------


def drawn_in(results: Path) -> list[Path]:
    """Return the files of all figures and movies."""
    return sorted(path for path in (results / "figures").rglob("*") if path.is_file())


def drawn_from(*stages: str) -> tuple[str, ...]:
    """Return the figures of a scenario that are drawn from any of some datasets."""
    return tuple(name for name in figures_of("figure") if set(FIGURES[name].parents) & set(stages))


def drawn_of(run: str) -> list[str]:
    """Return the files of the figures and the movie that show one run, where it is this one."""
    scenario = load_scenario(str(small_results.made() / "small.yaml"))
    samples = (entry for entry in FIGURES.values() if entry.sample)
    return [e.name + e.suffix for e in samples if run_shown(e, scenario) == run]


@pytest.fixture
def sealed(tmp_path: Path) -> Path:
    path = tmp_path / "sealed.nc"
    path.write_bytes(scenes.generator(3).bytes(300))
    seal(path)
    return path


def test_a_sealed_file_is_believed(sealed: Path) -> None:
    check_seal(sealed)


def test_an_empty_file_can_be_sealed(tmp_path: Path) -> None:
    path = tmp_path / "empty.nc"
    path.touch()
    with pytest.raises(DatasetError, match="no seal"):
        check_seal(path)
    seal(path)
    check_seal(path)


def test_a_file_larger_than_what_is_read_at_once_is_sealed_as_a_whole(tmp_path: Path) -> None:
    path = tmp_path / "large.nc"
    path.write_bytes(bytes(5_000_000))
    seal(path)
    check_seal(path)
    content = bytearray(path.read_bytes())
    content[4_000_000] = 1
    path.write_bytes(content)
    with pytest.raises(DatasetError, match="altered"):
        check_seal(path)


def test_no_byte_of_a_sealed_file_can_change(sealed: Path) -> None:
    content = sealed.read_bytes()
    for place in range(len(content)):
        changed = bytearray(content)
        changed[place] ^= 1 << place % 8
        sealed.write_bytes(changed)
        with pytest.raises(DatasetError, match=r"sealed\.nc"):
            check_seal(sealed)
        sealed.write_bytes(content[:place])
        with pytest.raises(DatasetError, match=r"sealed\.nc"):
            check_seal(sealed)
    sealed.write_bytes(content + b"\n")
    with pytest.raises(DatasetError, match=r"sealed\.nc"):
        check_seal(sealed)


@pytest.mark.parametrize("pattern", ["shear/*.nc", "figures/*.png"])
def test_a_file_that_may_not_be_read_is_unreadable(
    results: Path, monkeypatch: pytest.MonkeyPatch, pattern: str
) -> None:
    def refusing(path: Path, *words: Any, **more: Any) -> Any:
        raise PermissionError(13, "Permission denied", str(path))

    path = only(results, pattern)
    with monkeypatch.context() as closed:
        closed.setattr(Path, "open", refusing)
        found = examine(path)
    assert (found.state, found.product) == ("unreadable", None)
    assert found.problem == f"{path}: cannot be read (Permission denied)"


def test_a_seal_that_need_not_be_there_must_be_right(sealed: Path) -> None:
    content = sealed.read_bytes()
    sealed.write_bytes(content[:300])
    check_seal(sealed, required=False)
    sealed.write_bytes(content[:299] + b"?" + content[300:])
    with pytest.raises(DatasetError, match="altered"):
        check_seal(sealed, required=False)


def test_a_missing_file_has_no_seal(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="cannot be read"):
        check_seal(tmp_path / "missing.nc")


def test_readers_pass_a_seal_by(tmp_path: Path) -> None:
    plain, sealed = tmp_path / "plain.nc", tmp_path / "sealed.nc"
    numbers = xr.Dataset({"stress": ("time", scenes.generator(4).standard_normal(1000))})
    numbers.to_netcdf(plain, engine="netcdf4")
    shutil.copyfile(plain, sealed)
    seal(sealed)
    assert xr.load_dataset(sealed).identical(xr.load_dataset(plain))
    assert digests(xr.load_dataset(sealed)) == digests(xr.load_dataset(plain))
    with netCDF4.Dataset("memory", memory=sealed.read_bytes()) as dataset:
        assert dataset["stress"][:].tolist() == numbers["stress"].values.tolist()


def test_whoever_opens_a_file_for_writing_breaks_its_seal(results: Path) -> None:
    path = only(results, "packing/*.nc")
    with netCDF4.Dataset(path, "a"):
        pass
    with pytest.raises(DatasetError, match="seal"):
        check_seal(path)


# --- consistency -------------------------------------------------------------------------------


def with_axes(results: Path, axes: str) -> str:
    path = results.parent / "small.yaml"
    path.write_text(small_results.SCENARIO.partition("axes:")[0] + f"axes: {axes}\n")
    return str(path)


def test_what_an_earlier_sweep_left_is_foreign_and_no_problem(results: Path) -> None:
    found = verified(results, with_axes(results, "{rheometer.stress: [0.4, 0.6]}"))
    assert found.problems == ()
    foreign = {each.name for each in found.verdicts if each.foreign}
    gone = load_scenario(small_results.source(results)).base
    assert gone.rheometer.stress == 0.4
    (old,) = (name for name in foreign if name.startswith("shear/"))
    assert {f"figures/snapshots/{Path(old).stem}.png", "flow_curve.nc", "fits.nc"} < foreign
    assert not any(name.startswith(("packing/", "ageing/")) for name in foreign)
    new = [name for name in found.missing if name.startswith("shear/")]
    assert found.missing == (*new, f"figures/snapshots/{Path(new[0]).stem}.png")
    assert len(new) == 1


def test_results_of_other_code_are_named_and_no_problem(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        consistency, "fingerprint", lambda stage: "0" * 16 if stage == "fit" else _true(stage)
    )
    found = verified(results)
    assert found.problems == ()
    assert [each.name for each in found.verdicts if each.other_code] == ["fits.nc"]
    (remark,) = (remark for each in found.verdicts for remark in each.remarks)
    assert "fits.nc" in remark
    assert "other code" in remark


_true = consistency.fingerprint


def test_a_last_product_that_is_not_there_is_missing(results: Path) -> None:
    (results / "figures" / "fig8.png").unlink()
    found = verified(results)
    assert found.problems == ()
    assert found.missing == ("figures/fig8.png",)


def test_a_folder_that_is_not_there_is_refused(results: Path) -> None:
    with pytest.raises(DatasetError, match="nowhere"):
        verified(results / "nowhere", small_results.source(results))


def test_an_empty_folder_misses_everything(results: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    found = verified(tmp_path / "empty", small_results.source(results))
    assert (len(found.missing), found.verdicts, found.problems) == (small_results.count(), (), ())


def forge_origin(path: Path, **changes: Any) -> None:
    edit(path, {"provenance": edited_json(attribute(path, "provenance"), **changes)})
    redigest(path)


def forge_parameters(path: Path, section: str, **changes: Any) -> None:
    told = json.loads(attribute(path, "parameters"))
    told[section] |= changes
    edit(path, {"parameters": json.dumps(told)})
    redigest(path)


CLAIMS: list[tuple[str, Callable[[Path], None], str]] = [
    ("shear/*.nc", lambda path: forge_parameters(path, "rheometer", stress=0.3), "is called run"),
    ("shear/*.nc", lambda path: forge_parameters(path, "solvent", viscosity=2.0), "its one parent"),
    ("ageing/*.nc", lambda path: forge_parameters(path, "wall", colour=1), "wall.colour"),
    ("ageing/*.nc", lambda path: forge_origin(path, seed=5), "its seed is noted as 5"),
    ("packing/*.nc", lambda path: forge_origin(path, commit=None), "does not note its commit"),
    ("packing/*.nc", lambda path: forge_origin(path, fingerprint=None), "its fingerprint"),
    ("ageing/*.nc", lambda path: forge_origin(path, parent_records=[]), "record"),
    ("ageing/*.nc", lambda path: forge_origin(path, started="2100-01-01T00:00:00Z"), "before it"),
    ("ageing/*.nc", lambda path: forge_origin(path, ended="yesterday"), "its time ended"),
    ("ageing/*.nc", lambda path: forge_origin(path, ended="2020-01-01T00:00:00"), "its time ended"),
    ("ageing/*.nc", lambda path: forge_origin(path, core_seconds="much"), "its core_seconds"),
]
"""A file, how it is forged although its digests and seal are right, and what is said of it."""


@pytest.mark.parametrize(("pattern", "forge", "sentence"), CLAIMS)
def test_claims_that_contradict_themselves_are_named(
    results: Path, pattern: str, forge: Callable[[Path], None], sentence: str
) -> None:
    path = only(results, pattern)
    forge(path)
    said = [each for each in verified(results).problems if each.startswith(f"{path}: ")]
    assert any(sentence in each for each in said), said


def test_a_child_that_ended_before_its_parent_is_named(results: Path) -> None:
    path = only(results, "shear/*.nc")
    forge_origin(path, started="2019-01-01T00:00:00Z", ended="2020-01-01T00:00:00Z")
    assert any(f"{path}: ended before its parent" in each for each in verified(results).problems)


@pytest.mark.parametrize(
    ("attributes", "sentence"),
    [
        ({"mean_radius": 0.1}, "its mean_radius is 0.1"),
        ({"area_fraction": 0.5}, "its area_fraction is 0.5"),
        ({"parent": "f" * 16}, "its parent is"),
        ({"parents": "[]"}, "its one parent"),
    ],
)
def test_marks_that_contradict_the_parameters_are_named(
    results: Path, attributes: dict[str, Any], sentence: str
) -> None:
    path = only(results, "ageing/*.nc")
    edit(path, attributes)
    redigest(path)
    said = [each for each in verified(results).problems if each.startswith(f"{path}: ")]
    assert any(sentence in each for each in said), said


def test_a_table_that_mixes_runs_up_is_named(results: Path) -> None:
    path = results / "creep.nc"
    with netCDF4.Dataset(path, "a") as dataset:
        runs = dataset["run_id"]
        runs[...] = runs[...][::-1]
    redigest(path)
    said = [each for each in verified(results).problems if each.startswith(f"{path}: ")]
    assert len([each for each in said if "rheometer.stress" in each]) == 2, said


def test_a_table_that_names_a_run_it_was_not_made_from_is_named(results: Path) -> None:
    path = results / "creep.nc"
    with netCDF4.Dataset(path, "a") as dataset:
        dataset["run_id"][0] = "f" * 16
    redigest(path)
    assert any(f"{path}: its run_id" in each for each in verified(results).problems)


def test_a_table_over_a_part_of_the_runs_is_sound(results: Path, tmp_path: Path) -> None:
    partial_table(results, tmp_path)
    found = verified(results)
    assert not any("creep.nc" in each for each in found.problems if "figures" not in each)


def partial_table(results: Path, folder: Path) -> Path:
    """Regather creep as it was before the second run was done."""
    before, after = folder / "before", results / "creep.nc"
    shutil.copytree(results, before)
    sorted(before.glob("shear/*.nc"))[1].unlink()
    words = ["gather", "creep", small_results.source(results), "--results", before]
    assert call([*words, "--output", after]) == ""
    for name in ("figures/fig8.png", "explorer.html"):
        (results / name).unlink()
    return after


# --- comparisons -------------------------------------------------------------------------------


@pytest.fixture
def twin(results: Path, tmp_path: Path) -> Path:
    """Return a copy of a run's dataset outside the results."""
    path = tmp_path / "twin.nc"
    shutil.copyfile(only(results, "shear/*.nc"), path)
    return path


def change(path: Path, name: str, factor: float, place: int = 0) -> None:
    with netCDF4.Dataset(path, "a") as dataset:
        dataset.set_auto_mask(False)
        values = dataset[name][...]
        values.flat[place] *= factor
        dataset[name][...] = values
    redigest(path)


def test_a_result_is_equal_to_its_copy(results: Path, twin: Path) -> None:
    assert compare(only(results, "shear/*.nc"), twin) == Agreement(EQUAL, (), ())


def test_another_machine_alone_makes_no_difference(results: Path, twin: Path) -> None:
    forge_origin(twin, **PROCESSOR)
    assert compare(only(results, "shear/*.nc"), twin) == Agreement(EQUAL, ("processor",), ())


def test_the_same_machine_gives_the_same_bytes(results: Path, twin: Path) -> None:
    change(twin, "shear_rate_wall", 1 + 1e-15)
    found = compare(only(results, "shear/*.nc"), twin)
    assert found.verdict == DIFFERS
    assert found.quantities[0].difference < 1e-14


@pytest.mark.parametrize(("factor", "verdict"), [(1 + 1e-4, WITHIN), (1.5, DIFFERS)])
@pytest.mark.parametrize("key", ["processor", "environment", "fingerprint"])
def test_another_machine_may_round_otherwise(
    results: Path, twin: Path, key: str, factor: float, verdict: str
) -> None:
    forge_origin(twin, **{key: "another one"})
    change(twin, "shear_rate_wall", factor)
    found = compare(only(results, "shear/*.nc"), twin)
    assert (found.verdict, found.other) == (verdict, (key,))
    assert found.quantities[0].name.startswith("shear_rate_wall") or verdict == WITHIN
    assert all(each.reason for each in found.quantities)


def test_no_machine_changes_words_or_counts(results: Path, twin: Path) -> None:
    forge_origin(twin, **PROCESSOR)
    with netCDF4.Dataset(twin, "a") as dataset:
        dataset["stress"].units = "furlong"
        dataset.particles = 7
    redigest(twin)
    found = compare(only(results, "shear/*.nc"), twin)
    different = {each.name for each in found.quantities if not each.fits}
    assert found.verdict == DIFFERS
    assert "particles (attribute)" in different
    assert any(name.startswith("stress.") for name in different)


def series(key: int, *, mean: float = 1.0, parted: float = 0.5) -> xr.Dataset:
    """Return a flow that is the same for all keys up to a strain, and noise about a mean after."""
    time = np.arange(1, 401) / 10
    strain = 0.1 * time
    noise = np.where(strain > parted, scenes.generator(key).standard_normal(time.size), 0.3)
    return xr.Dataset(
        {
            "strain": ("time", strain),
            "interval": ("time", np.full(time.size, 0.1)),
            "shear_rate_wall": ("time", mean + 0.2 * noise),
        },
        coords={"time": time},
        attrs={"stage": "shear", "mean_radius": 0.01},
    )


def misfits(first: xr.Dataset, second: xr.Dataset) -> list[str]:
    found = agreement._number_quantities(first, second)
    return [each.name for each in found if not each.fits]


@pytest.mark.parametrize("key", range(5))
def test_runs_that_part_late_are_compared_by_their_means(key: int) -> None:
    assert misfits(series(key), series(key + 100)) == []
    (name,) = misfits(series(key), series(key + 100, parted=0.4))
    assert "strain" in name
    names = misfits(series(key), series(key + 100, mean=1.2))
    assert "shear_rate_wall (mean of the second half)" in names


def test_what_is_not_known_must_be_unknown_in_both() -> None:
    first, second = series(1), series(1)
    second["shear_rate_wall"][3] = np.nan
    assert len(misfits(first, second)) == 1
    first["shear_rate_wall"][3] = np.nan
    assert misfits(first, second) == []


def test_a_variable_of_one_alone_or_of_another_type_differs() -> None:
    first = series(1)
    (name,) = misfits(first, first.drop_vars("interval"))
    assert "interval" in name
    (name,) = misfits(first, first.assign(interval=first["interval"].astype(int)))
    assert "interval" in name


def drawing(path: Path, bend: float, **provenance: Any) -> Path:
    figure = matplotlib.figure.Figure()
    figure.subplots().plot([0, 1, 2], [0, bend, 1])
    labels = {"title": "creep", "stage": "figure", "run": "small", "parameters": {}, "parents": []}
    save_figure(figure, path, labels, provenance)
    return path


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_figures_are_equal_whenever_they_were_drawn(tmp_path: Path, suffix: str) -> None:
    first = drawing(tmp_path / f"first{suffix}", 1.0, commit="abc", ended="early")
    second = drawing(tmp_path / f"second{suffix}", 1.0, commit="abcdef", ended="late")
    assert first.read_bytes() != second.read_bytes()
    assert compare(first, second).verdict == EQUAL
    third = drawing(tmp_path / f"third{suffix}", 1.5, commit="abc", ended="early")
    assert compare(first, third).verdict == DIFFERS


@pytest.mark.parametrize("suffix", [".svg", ".pdf"])
def test_a_drawing_that_lies_about_its_picture_differs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    from softslip.analysis.figures import saving as module

    true = module.content_digest
    monkeypatch.setattr(module, "content_digest", lambda picture, labels: true(kept, labels))
    (tmp_path / "kept.png").touch()
    kept = drawing_bytes(tmp_path)
    first = drawing(tmp_path / f"first{suffix}", 1.0)
    second = drawing(tmp_path / f"second{suffix}", 1.5)
    assert compare(first, second).verdict == DIFFERS


def drawing_bytes(folder: Path) -> bytes:
    figure = matplotlib.figure.Figure()
    figure.savefig(folder / "kept.png")
    return (folder / "kept.png").read_bytes()


def test_letters_may_be_drawn_otherwise_elsewhere(results: Path, tmp_path: Path) -> None:
    recorded = results / "figures" / "fig8.png"
    labels = small_results.stamps.read_labels(recorded)
    elsewhere = {"provenance": labels["provenance"] | PROCESSOR}

    def dot(size: int) -> Callable[[Any], Any]:
        def paint(pixels: Any) -> Any:
            pixels[:size, :size, :3] = 0
            return pixels

        return paint

    for size, verdict in ((20, WITHIN), (400, DIFFERS)):
        twin = tmp_path / f"{size}.png"
        shutil.copyfile(recorded, twin)
        small_results.forge_figure(twin, elsewhere, dot(size))
        assert compare(recorded, twin).verdict == verdict
        small_results.forge_figure(twin, {"provenance": labels["provenance"]}, dot(size))
        assert compare(recorded, twin).verdict == DIFFERS


def movie(path: Path, shades: list[int], **provenance: Any) -> Path:
    """A movie of one shade after the other."""
    drawn = matplotlib.figure.Figure(figsize=(1, 1), dpi=64)
    moving = functools.partial(shade, drawn.patch, shades)
    labels = {"title": "movie", "stage": "figure", "run": "small", "parameters": {}, "parents": []}
    save_figure(Movie(drawn, len(shades), (drawn.patch,), moving), path, labels, provenance)
    return path


def shade(patch: Any, shades: list[int], number: int) -> None:
    patch.set_facecolor((shades[number] / 255,) * 3)


def test_movies_are_compared_by_their_pictures(tmp_path: Path) -> None:
    made = functools.partial(movie, tmp_path / "first.mp4", [40, 90, 200])
    first = made(commit="abc", environment="one")
    again = movie(tmp_path / "again.mp4", [40, 90, 200], commit="def", environment="one")
    assert first.read_bytes() != again.read_bytes()
    assert compare(first, again).verdict == EQUAL
    # Other software may shift a colour by a little, and not by much.
    for shades, verdict in (([40, 90, 204], WITHIN), ([40, 90, 250], DIFFERS)):
        other = movie(tmp_path / "other.mp4", shades, environment="two")
        found = compare(first, other)
        assert found.verdict == verdict
        assert found.quantities[0].name == "pixels"
    for shades, said in (([40, 90], "number of pictures"), ([40] * 30, "moments")):
        other = movie(tmp_path / "other.mp4", shades, environment="two")
        assert said in compare(first, other).quantities[0].name


# --- reruns -----------------------------------------------------------------------------------


def contents(folder: Path) -> dict[Path, tuple[bytes, int]]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in files}


def reruns(results: Path, *names: str, stretch: bool = False) -> list[RerunOutcome]:
    """Rerun what made products, by default all."""
    possible = possible_reruns(verified(results), stretch)
    wanted = [each for each in possible if not names or each.name in names]
    assert len(wanted) == len(names or possible)
    return list(reexecute(wanted, small_results.source(results), results, call))


def test_every_product_comes_out_again_and_none_is_touched(results: Path) -> None:
    before = contents(results)
    outcomes = reruns(results)
    assert {each.verdict for each in outcomes} == {EQUAL}, [each.problem for each in outcomes]
    assert len(outcomes) == small_results.count()
    assert {each.how for each in outcomes} == {WHOLE}
    assert contents(results) == before


def test_a_forged_last_figure_does_not_come_out_again(results: Path) -> None:
    path = results / "figures" / "fig8.png"

    def paint(pixels: Any) -> Any:
        pixels[100, 100, 0] ^= 1
        return pixels

    small_results.forge_figure(path, {}, paint)
    assert verified(results).problems == (), "only a rerun can reveal it"
    (outcome,) = reruns(results, "figures/fig8.png")
    assert outcome.verdict == DIFFERS
    assert outcome.problem.startswith(f"{path}: is not reproduced: pixels")


def test_forged_last_fits_do_not_come_out_again(results: Path) -> None:
    path = results / "fits.nc"
    (results / "comparison.nc").unlink()
    for name in drawn_from("fits"):
        (results / "figures" / f"{name}.png").unlink()
    with netCDF4.Dataset(path, "a") as dataset:
        dataset["points"][...] = dataset["points"][...] + 1
    redigest(path)
    assert verified(results).problems == (), "only a rerun can reveal it"
    (outcome,) = reruns(results, "fits.nc")
    assert outcome.verdict == DIFFERS
    assert outcome.problem.startswith(f"{path}: is not reproduced: points")


def test_a_forged_last_run_does_not_come_out_again(results: Path) -> None:
    path = only(results, "shear/*.nc")
    for other in (*results.glob("*.nc"), *results.glob("*.html"), *drawn_in(results)):
        other.unlink()
    change(path, "shear_rate_wall", 1 + 1e-15, place=3)
    assert verified(results).problems == (), "only a rerun can reveal it"
    (outcome,) = reruns(results, f"shear/{path.name}")
    assert outcome.verdict == DIFFERS
    assert "same kind of processor" in outcome.problem


def test_a_table_is_gathered_again_from_its_own_runs(results: Path, tmp_path: Path) -> None:
    partial_table(results, tmp_path)
    (outcome,) = reruns(results, "creep.nc")
    assert outcome.verdict == EQUAL, outcome.problem


def test_what_cannot_be_made_is_named(results: Path) -> None:
    (task,) = (each for each in possible_reruns(verified(results)) if each.name == "fits.nc")
    (outcome,) = reexecute([task], small_results.source(results), results, lambda *_: "no disk")
    assert outcome.verdict == FAILED
    assert outcome.problem == f"{results / 'fits.nc'}: could not be rerun: no disk"


def test_only_sound_products_of_sound_parents_are_made_again(results: Path) -> None:
    path = only(results, "shear/*.nc")
    path.write_bytes(path.read_bytes()[:-1])
    named = {each.name for each in possible_reruns(verified(results))}
    other = sorted(results.glob("shear/*.nc"))[1].stem
    kept = {f"shear/{other}.nc", f"figures/snapshots/{other}.png", "fits.nc", "comparison.nc"}
    kept |= {f"figures/{name}" for name in drawn_of(other)}
    drawn = {f"figures/{name}.png" for name in drawn_from(*DATASETS)}
    chain = {each for each in named if each.startswith(("packing", "expansion", "ageing"))}
    assert named == kept | drawn | chain
    assert len(chain) == 3


def test_a_sample_is_a_function_of_its_seed(results: Path) -> None:
    possible = possible_reruns(verified(results))
    order = [each.name for each in possible]
    drawn = [sampled(possible, 3, seed) for seed in range(40)]
    assert drawn[7] == sampled(possible, 3, 7)
    for sample in drawn:
        places = [order.index(each.name) for each in sample]
        assert places == sorted(set(places))
        assert len(places) == 3
    # Each product is left out of forty samples once in ten thousand times.
    assert {each.name for sample in drawn for each in sample} == set(order)
    assert sampled(possible, 99, 1) == possible
    assert sampled((), 3, 1) == ()


def test_the_estimate_is_what_it_took_before(results: Path) -> None:
    found = verified(results)
    told = {"core_seconds": 30.0, "threads": 2}
    slow = tuple(
        replace(
            each, examined=replace(each.examined, product=replace(each.product, provenance=told))
        )
        for each in found.verdicts
        if each.product is not None
    )
    assert {each.seconds for each in possible_reruns(replace(found, verdicts=slow))} == {15.0}


@pytest.fixture
def kept(results: Path) -> Path:
    """Rerun a run that leaves its last checkpoint, and return that."""
    path = only(results, "shear/*.nc")
    (parent,) = results.glob("ageing/*.nc")
    words = ["shear", small_results.source(results), path.stem, "--parent", parent]
    assert call([*words, "--output", path, "--checkpoint-interval", 0]) == ""
    (checkpoint,) = results.glob("shear/checkpoints/*.checkpoint")
    return checkpoint


def test_the_last_stretch_of_a_run_comes_out_again(results: Path, kept: Path) -> None:
    before = contents(results)
    name = f"shear/{kept.name.partition('.')[0]}.nc"
    whole = next(each.seconds for each in possible_reruns(verified(results)) if each.name == name)
    (outcome,) = reruns(results, name, stretch=True)
    assert (outcome.verdict, outcome.how) == (EQUAL, STRETCH), outcome.problem
    assert outcome.rerun.seconds < whole
    assert contents(results) == before


def test_a_forged_last_stretch_does_not_come_out_again(results: Path, kept: Path) -> None:
    name = kept.name.partition(".")[0]
    path = results / "shear" / f"{name}.nc"
    for other in (*results.glob("*.nc"), *drawn_in(results)):
        other.unlink()
    change(path, "shear_rate_wall", 1 + 1e-15, place=-1)
    (outcome,) = reruns(results, f"shear/{name}.nc", stretch=True)
    assert (outcome.verdict, outcome.how) == (DIFFERS, STRETCH)


@pytest.mark.parametrize("damage", ["removed", "damaged"])
def test_without_its_checkpoint_a_run_is_made_as_a_whole(
    results: Path, kept: Path, damage: str
) -> None:
    if damage == "removed":
        kept.unlink()
    else:
        kept.write_bytes(b"nothing")
    (outcome,) = reruns(results, f"shear/{kept.name.partition('.')[0]}.nc", stretch=True)
    assert (outcome.verdict, outcome.how) == (EQUAL, WHOLE)


def test_commands_run_in_a_process_of_their_own(results: Path, tmp_path: Path) -> None:
    assert run_command(["fit", str(results / "flow_curve.nc"), "--output", "f.nc"], tmp_path) == ""
    assert read_dataset(tmp_path / "f.nc", stage="fits").attrs["run"] == "small"
    said = run_command(["fit", "missing.nc", "--output", "f.nc"], tmp_path)
    assert said.startswith("DatasetError: missing.nc")
    assert os.listdir(tmp_path) == ["f.nc"]


def test_a_written_dataset_is_sealed(tmp_path: Path) -> None:
    path = tmp_path / "toy.nc"
    write_dataset(xr.Dataset({"one": ((), 1.0)}), path, stage="toy", run="a", title="A toy")
    check_seal(path)
    assert float(read_dataset(path, stage="toy")["one"]) == 1.0
