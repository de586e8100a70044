"""What a run shows of itself."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from synthetic import shear_run

from softslip.analysis.observables import steady_state
from softslip.errors import DatasetError
from softslip.workbench import accessor, notebook_figures

PROVENANCE = '{"commit": "0123abc", "ended": "2026-01-01T00:00:00.000000Z"}'


@pytest.fixture(scope="module")
def run() -> xr.Dataset:
    return shear_run(0.3, duration=60.0, profiles=4, snapshots=(20.0, 60.0)).assign_attrs(
        stage="shear", run="0" * 16, ended_by="time", particles=12, provenance=PROVENANCE
    )


@pytest.mark.parametrize("name", ["creep", "profile", "snapshot"])
def test_a_run_draws_figures(run: xr.Dataset, name: str) -> None:
    figure = getattr(run.softslip, name)()
    assert isinstance(figure, Figure)
    assert figure.axes


def test_a_snapshot_is_the_nearest_to_a_time(run: xr.Dataset) -> None:
    titles = [run.softslip.snapshot(time).axes[0].get_title(loc="left") for time in (25.0, None)]
    assert "= 20" in titles[0]
    assert "= 60" in titles[1]


def test_averages_are_those_of_the_flow_curve(run: xr.Dataset) -> None:
    averages, steady = run.softslip.averages(), steady_state(run)
    for name in ("shear_rate_wall", "shear_rate_bulk_error", "slip_velocity"):
        np.testing.assert_array_equal(averages[name].values, steady[name].values)
    assert averages["yielding_time"].attrs["units"] == "time unit"


def test_a_run_says_what_it_is_in_text_and_as_a_table(run: xr.Dataset) -> None:
    text, table = repr(run.softslip), run.softslip._repr_html_()
    for part in ("stress 0.3", "12 particles", "shear_rate_bulk", "steady", "0123abc"):
        assert part in text
        assert part in table
    assert table.count("<tr>") == len(text.splitlines()) - 1


def test_text_of_a_file_is_no_markup(run: xr.Dataset) -> None:
    forged = run.assign_attrs(ended_by="<script>alert(1)</script>")
    assert "<script>" not in forged.softslip._repr_html_()


def test_parameters_are_at_hand(run: xr.Dataset) -> None:
    assert run.softslip.parameters.rheometer.stress == 0.3


@pytest.mark.parametrize("ask", ["creep", "profile", "snapshot", "averages"])
def test_other_datasets_are_refused(ask: str) -> None:
    other = xr.Dataset(attrs={"stage": "ageing"})
    with pytest.raises(DatasetError, match="stage: 'ageing' is not shear"):
        getattr(other.softslip, ask)()


class Pictures:
    """Stands for IPython's formatter of PNG."""

    def __init__(self, known: dict[type, object]) -> None:
        self.known = known

    def lookup_by_type(self, kind: type) -> object:
        return self.known[kind]

    def for_type(self, kind: type, function: object) -> None:
        self.known[kind] = function


def notebook(known: dict[type, object]) -> SimpleNamespace:
    formatters = {"image/png": Pictures(known)}
    shell = SimpleNamespace(display_formatter=SimpleNamespace(formatters=formatters))
    return SimpleNamespace(get_ipython=lambda: shell, version_info=(9, 0))


def test_a_notebook_shows_figures(run: xr.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    known: dict = {}
    monkeypatch.setitem(sys.modules, "IPython", notebook(known))
    figure = run.copy().softslip.profile()
    assert known[Figure](figure).startswith(b"\x89PNG")


def test_what_a_notebook_knew_of_figures_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    known: dict[type, object] = {Figure: "its own"}
    monkeypatch.setitem(sys.modules, "IPython", notebook(known))
    notebook_figures.show_figures()
    assert known == {Figure: "its own"}


def test_the_accessor_has_the_name_of_the_package() -> None:
    assert isinstance(xr.Dataset(attrs={"stage": "shear"}).softslip, accessor.RunAccessor)
