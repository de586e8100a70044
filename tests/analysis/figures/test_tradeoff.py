import numpy as np
import pytest
import tradeoff_synthetic as synthetic

from softslip.analysis.figures import save_figure
from softslip.analysis.figures.tradeoff import extrapolation, tradeoff
from softslip.studies.tradeoff.table import gather


@pytest.fixture(scope="module")
def table():
    return gather(synthetic.members(), synthetic.long_runs())


def points(axes):
    return {
        (float(x), float(y))
        for line in axes.lines
        for x, y in zip(line.get_xdata(), line.get_ydata(), strict=True)
    }


def test_every_member_with_an_error_is_a_point(table):
    left, right = tradeoff(table).axes
    for axes, name in ((left, "total_error"), (right, "numerical_error")):
        shown = points(axes)
        for kind in ("factorial", "level", "variant"):
            here = table.isel(member=np.flatnonzero(table["kind"].values == kind))
            for cost, error in zip(here["cost_ratio"].values, here[name].values, strict=True):
                if error > 0:
                    assert (float(cost), float(error)) in shown, (kind, name)


def test_levels_and_meshes_are_named(table):
    texts = {text.get_text() for axes in tradeoff(table).axes for text in axes.texts}
    assert {"standard", "1/4096"} <= texts


def test_the_scatter_between_packings_is_a_band_where_it_was_measured(table):
    with_runs = tradeoff(table)
    without = tradeoff(gather(synthetic.members(), []))
    assert len(with_runs.axes[0].patches) == len(without.axes[0].patches) + 1


def test_the_line_goes_through_the_limit(table):
    axes = extrapolation(table).axes[0]
    starts = [
        float(line.get_ydata()[0])
        for line in axes.lines
        if len(line.get_xdata()) == 2 and line.get_xdata()[0] == 0.0 and line.get_marker() == "None"
    ]
    assert starts.count(1.0) >= 4


def test_what_lies_outside_of_the_panels_is_said():
    members = synthetic.members()
    members[-1] = synthetic.member(
        "mesh-2048",
        "variant",
        rates=3 * synthetic.level_rates(),
        tree=synthetic.parameters(None, 1.42, 2e-3, resolution=2048, mobility="grid"),
        level="literal",
    )
    figure = extrapolation(gather(members, []))
    assert "mesh-2048" in figure.get_supxlabel()


def test_figures_are_saved_with_and_without_long_runs(table, tmp_path):
    short = gather(synthetic.members(), [])
    for number, (dataset, draw) in enumerate(
        (dataset, draw) for dataset in (table, short) for draw in (tradeoff, extrapolation)
    ):
        path = tmp_path / f"{number}.png"
        save_figure(draw(dataset), path, {})
        assert path.stat().st_size > 10_000
