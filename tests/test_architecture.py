"""The map of the architecture is that of the code."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def drawing() -> ModuleType:
    spec = importlib.util.spec_from_file_location("architecture", ROOT / "docs" / "architecture.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_map_is_that_of_the_code(drawing: ModuleType) -> None:
    page = (ROOT / "ARCHITECTURE.md").read_text("utf-8")
    assert drawing.written(page) == page, "run make architecture"


def test_every_module_says_what_it_is(drawing: ModuleType) -> None:
    files = sorted((ROOT / "src" / "softslip").rglob("*.py"))
    assert not [file for file in files if not drawing.first_sentence(file)]
