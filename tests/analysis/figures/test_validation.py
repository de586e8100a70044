import matplotlib
import numpy as np
import pytest
from validation_synthetic import dataset

from softslip.analysis.figures.validation import LEVELS, PUBLISHED_DRAG, validation


def words(figure):
    figure.canvas.draw()
    found = [text.get_text() for text in figure.findobj(matplotlib.text.Text)]
    return "\n".join(text for text in found if text)


def curves(axes, figure):
    """Drawn lines by the fidelity whose colour they have; of several, the last."""
    names = {line.get_color(): line.get_label() for line in figure.legends[0].get_lines()}
    return {names.get(line.get_color(), str(line.get_label())): line for line in axes.get_lines()}


def test_each_dataset_has_a_panel_and_each_fidelity_a_line():
    axes = {"fidelity": ["preview", "paper"], "height": [0.1, 0.2, 0.4]}
    one, other = dataset("couette", axes), dataset("film", axes)
    figure = validation(one, other)
    assert len(figure.axes) == 2
    for panel in figure.axes:
        found = curves(panel, figure)
        assert found["paper"].get_xdata() == pytest.approx([0.1, 0.2, 0.4])
        assert found["paper"].get_ydata() == pytest.approx([4e-3, 5e-3, 6e-3])
        assert found["preview"].get_color() != found["paper"].get_color()
        dashed = [line for line in panel.get_lines() if line.get_linestyle() == "--"]
        assert dashed[0].get_ydata() == pytest.approx([5e-3] * 3)
    assert "error of speed" in words(figure)


def test_a_level_has_the_same_colour_in_every_panel():
    first = dataset("a", {"fidelity": ["paper"], "x": [1.0, 2.0]})
    second = dataset("b", {"fidelity": list(LEVELS), "x": [1.0, 2.0]})
    figure = validation(first, second)
    left, right = figure.axes
    assert curves(left, figure)["paper"].get_ydata() == pytest.approx([1e-3, 2e-3])
    assert curves(right, figure)["paper"].get_ydata() == pytest.approx([7e-3, 8e-3])
    assert [text.get_text() for text in figure.legends[0].get_texts()] == list(LEVELS)


def test_refused_combinations_leave_gaps_and_are_counted():
    axes = {"fidelity": ["paper"], "height": [0.1, 0.2, 0.4]}
    figure = validation(dataset("couette", axes, refused=[2]))
    assert np.isnan(curves(figure.axes[0], figure)["paper"].get_ydata()).tolist() == [
        False,
        True,
        False,
    ]
    said = words(figure)
    assert "couette: 1 of 3 refused" in said
    assert "2 of 2 solved within their tolerances" in said


def test_words_and_nulls_are_drawn_by_their_names():
    figure = validation(
        dataset("a", {"fidelity": ["paper"], "outside": ["still", "periodic"]}),
        dataset("b", {"fidelity": ["paper"], "epsilon": [np.nan, 0.2]}),
        dataset("c", {"fidelity": ["preview", "paper"]}),
    )
    labels = [[text.get_text() for text in panel.get_xticklabels()] for panel in figure.axes]
    assert labels == [["still", "periodic"], ["null", "0.2"], ["preview", "paper"]]
    for panel in figure.axes:
        line = next(line for line in panel.get_lines() if line.get_marker() == "o")
        assert np.isfinite(line.get_xydata()).all()
        assert line.get_linestyle() == "None", "there is nothing between words"


def test_any_further_dimension_is_named():
    axes = {"gap": [0.1, 0.2], "fidelity": ["paper"], "height": [0.1, 0.2, 0.4], "mode": ["a", "b"]}
    figure = validation(dataset("couette", axes))
    found = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert len(found) == 4
    assert "gap = 0.1, mode = b" in found


def test_a_dimension_of_one_value_neither_makes_the_axis_nor_needs_words():
    axes = {"halvings": [2.0], "vary": ["nodes", "mesh"], "fidelity": ["paper"]}
    (panel,) = validation(dataset("order", axes)).axes
    assert panel.get_xlabel() == "vary"
    assert panel.get_legend() is None


def test_without_fidelities_the_one_that_was_used_is_named():
    figure = validation(dataset("couette", {"height": [0.1, 0.2]}, fidelity="standard"))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["standard"]


def test_cylinders_have_their_drag_beside_the_published_one():
    axes = {"fidelity": ["literal", "paper"], "concentration": [0.1, 0.3, 0.5]}
    figure = validation(dataset("cylinders", axes, leading="drag"))
    errors, drag = figure.axes
    assert {line.get_linestyle() for line in errors.get_lines()} >= {"-", ":", "--"}
    found = curves(drag, figure)
    published = found["Sangani & Acrivos (1982)"]
    assert published.get_ydata() == pytest.approx(list(PUBLISHED_DRAG.values()))
    assert found["paper"].get_ydata() == pytest.approx([40.0, 50.0, 60.0])
    assert found["exact, without regularisation"].get_ydata() == pytest.approx([10.0] * 3)


def test_nothing_solved_is_drawn_as_nothing():
    lost = dataset("film", {"x": [1.0, 2.0]}, refused=[1, 2])
    lost = lost[["passed", "refusal"]].assign_attrs(leading="")
    assert "film: 2 of 2 refused" in words(validation(lost))


def test_a_case_without_any_error_shows_what_came_out():
    flawless = dataset("order", {"vary": ["step", "nodes"]})
    leading = flawless.attrs["leading"]
    flawless[f"{leading}_error"] *= 0.0
    flawless[f"{leading}_result"] = flawless[f"{leading}_error"] + 2.0
    flawless[f"{leading}_reference"] = flawless[f"{leading}_error"] + 1.0
    (panel,) = validation(flawless).axes
    heights = [line.get_ydata().tolist() for line in panel.get_lines()]
    assert heights == [[2.0, 2.0], [1.0, 1.0]]
    assert panel.get_yscale() == "linear"
