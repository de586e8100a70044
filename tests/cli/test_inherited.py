"""What is withheld from libraries, and what is left alone."""

import os
import subprocess
import sys

import pytest

from softslip.cli.inherited import FAMILIES, KEPT, withhold


def test_only_what_libraries_read_is_withheld() -> None:
    others = {"HOME": "/home/x", "OPEN": "1", "NUMB": "2", "SLURM_JOB_ID": "3", "TMPDIR": "/tmp"}
    variables = {**others, **{f"{family}X": "1" for family in FAMILIES}}
    withhold(variables)
    assert {name: variables[name] for name in others} == others
    assert set(variables) - set(others) == {"OPENBLAS_NUM_THREADS", "MPLBACKEND", "MATPLOTLIBRC"}
    assert os.path.isfile(variables["MATPLOTLIBRC"])
    before = dict(variables)
    withhold(variables)
    assert variables == before


@pytest.mark.parametrize("name", KEPT)
def test_settings_that_change_no_result_are_left_alone(name: str) -> None:
    for value in KEPT[name] or ("/anywhere",):
        variables = {name: value}
        withhold(variables)
        assert variables[name] == value
    if KEPT[name]:
        variables = {name: "foo"}
        withhold(variables)
        assert name not in variables


def test_no_file_gets_the_number_of_a_closed_stream() -> None:
    code = (
        "import os; from softslip.cli.inherited import put_right; put_right(); "
        "raise SystemExit(0 if os.open('/dev/null', os.O_RDONLY) > 2 else 1)"
    )
    line = ["/bin/sh", "-c", '"$@" <&- >&- 2>&-', "sh", sys.executable, "-c", code]
    assert subprocess.run(line, check=False).returncode == 0
