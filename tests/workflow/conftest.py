"""What tests of the workflow share."""

from pathlib import Path

import pytest
from tiny import made


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the project with every result of a tiny scenario; not to be changed."""
    return made(tmp_path_factory.mktemp("whole") / "copy")
