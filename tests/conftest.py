"""Scenes that are expensive enough to be made once."""

from pathlib import Path

import hypothesis
import pytest
import runs_synthetic
import scenes
from runs_synthetic import Work

from softslip.config.scenario import Scenario
from softslip.simulation import hydrodynamics

# Compiling takes longer than any deadline; the same examples every time make failures repeat.
hypothesis.settings.register_profile(
    "softslip", deadline=None, derandomize=True, database=None, max_examples=40
)
hypothesis.settings.load_profile("softslip")


@pytest.fixture(scope="session")
def smooth():
    """Parameters of a small channel with smooth walls under a stress well above yield."""
    return scenes.parameters(rheometer={"stress": 0.5})


@pytest.fixture(scope="session")
def foam(smooth):
    """Dense packing of two dozen membranes, in the schema of the expansion stage."""
    return scenes.foam(smooth)


@pytest.fixture(scope="session")
def aged(foam, smooth):
    """The foam after a short ageing."""
    return hydrodynamics.age(foam, smooth)


@pytest.fixture(scope="session")
def sheared(aged, smooth):
    """A short sheared run of the aged foam."""
    return hydrodynamics.shear(aged, smooth)


@pytest.fixture
def scenario(tmp_path: Path) -> Scenario:
    """Four runs, of which no stage is done."""
    return runs_synthetic.scenario(tmp_path)


@pytest.fixture
def work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Work:
    """What leaves made-up results of these runs."""
    return Work(tmp_path / "results", monkeypatch)
