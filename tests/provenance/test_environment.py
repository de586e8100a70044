import platform

import numpy as np

from softslip.provenance.environment import LIBRARIES, environment


def test_the_environment_names_python_and_every_library_that_computes():
    words = environment()
    assert words.startswith(f"python {platform.python_version()}, ")
    assert f"numpy {np.__version__}" in words
    assert all(f"{name} " in words for name in LIBRARIES)
    assert "/" not in words
    assert "\n" not in words
