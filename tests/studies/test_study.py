import itertools

import pytest
from projects import ROOT

from softslip.errors import ConfigError, DatasetError
from softslip.files.publication import blocks_in
from softslip.files.storage import read_dataset
from softslip.studies.publish import CHOICES, NUMERICS, blocks_of, choices_text
from softslip.studies.study import load_study
from softslip.studies.tradeoff.choices import choices
from softslip.studies.tradeoff.members import members_of
from softslip.studies.validation import CASES


@pytest.fixture
def project(monkeypatch):
    monkeypatch.chdir(ROOT)


@pytest.mark.parametrize("name", ["full", "ci"])
def test_every_combination_of_a_study_is_a_valid_case(project, name):
    for sweep in load_study(name).validation.values():
        for values in itertools.product(*sweep.axes.values()):
            CASES[sweep.case].of(dict(zip(sweep.axes, values, strict=True)))


@pytest.mark.parametrize("name", ["full", "ci"])
def test_every_member_of_a_study_has_a_name_of_its_own(project, name):
    assert members_of(load_study(name).tradeoff)


def test_the_full_study_solves_every_case(project):
    assert {sweep.case for sweep in load_study("full").validation.values()} == set(CASES)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("validations: {}", r"validations: .*the keys at the top are description, validation"),
        ("validation: {couette: 3}", r"validation.couette: 3 is no mapping"),
        ("validation: {couette: {stress: 0.3}}", r"validation.couette.stress: 0.3 is no list"),
        ("validation: {'../x': {stress: [0.3]}}", r"is no name for a file"),
        ("stability: {stresses: [a]}", r"stability.stresses\[0\]: 'a' is not a number"),
        ("tradeoff: {particle: 3}", r"tradeoff.particle: 3 .*did you mean 'particles'"),
        ("elements: {particles: 2.5}", r"elements.particles: 2.5 is no option"),
        ("coverage: {draws: 0}", r"coverage.draws: 0 is no number of draws"),
    ],
)
def test_a_study_that_makes_no_sense_is_refused_in_one_line(tmp_path, monkeypatch, text, message):
    folder = tmp_path / "config" / "numerics"
    folder.mkdir(parents=True)
    (folder / "own.yaml").write_text(text)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match=message) as caught:
        load_study("own")
    assert str(caught.value).startswith("config/numerics/own.yaml: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["missing", "../full", "", "a/b"])
def test_a_study_that_is_not_there_is_refused_with_those_that_are(project, name):
    with pytest.raises(ConfigError, match="use one of ci, full"):
        load_study(name)


def test_an_unfinished_study_is_not_published(tmp_path):
    with pytest.raises(DatasetError, match="is missing; first finish the study"):
        NUMERICS.write(tmp_path, tmp_path)
    assert not list(tmp_path.iterdir())


def test_the_document_has_the_tables_of_what_is_published():
    document = (ROOT / NUMERICS.document).read_text(encoding="utf-8")
    assert blocks_in(document) == blocks_of(ROOT / NUMERICS.folder)


def test_the_choices_are_those_of_the_published_trade():
    rows = choices(read_dataset(ROOT / NUMERICS.folder / "tradeoff.nc", stage="tradeoff"))
    assert (ROOT / CHOICES).read_text(encoding="utf-8") == choices_text(rows)


def test_no_cell_of_the_published_map_is_wrong():
    stability = read_dataset(ROOT / NUMERICS.folder / "stability_map.nc", stage="stability_map")
    assert set(stability["verdict"].values) == {"correct", "stopped"}
