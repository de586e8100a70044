import re

import pytest

from softslip.analysis.against_paper import COMPARED
from softslip.operations.report.html_parts import from_markdown, html_table, page, paragraph


def test_plain_text_stays_plain() -> None:
    hostile = "<script>alert(1)</script> & more"
    for written in (paragraph(hostile), html_table((hostile,), [(hostile,)])):
        assert "<script>" not in written
        assert "&lt;script&gt;" in written
        assert "&amp; more" in written
    assert b"<title>a &amp; b</title>" in page("a & b", "")


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        (r"$\sigma_y$", "<i>σ<sub>y</sub></i>"),
        (r"$\delta_{het}$", "<i>δ<sub>het</sub></i>"),
        (r"$\beta^*$", "<i>β<sup>*</sup></i>"),
        ("$n$", "<i>n</i>"),
    ],
)
def test_a_symbol_is_set_with_its_indices(formula: str, expected: str) -> None:
    assert f"<td>the {expected}</td>" in html_table(("",), [(f"the {formula}",)])


@pytest.mark.parametrize("name", COMPARED)
def test_no_symbol_of_the_comparison_is_left_in_tex(name: str) -> None:
    written = html_table(("",), [(f"${COMPARED[name].reported.symbol}$",)])
    assert not re.search(r"[\\${}^_]", written), written


def test_a_table_in_markdown_becomes_one_that_can_be_scrolled() -> None:
    written = from_markdown("text\n\n| a | b |\n| --- | ---: |\n| 1 \\| 2 | `c` |\n")
    assert '<div class="wide"><table>' in written
    assert "<td>1 | 2</td>" in written
    assert "<code>c</code>" in written
    assert written.count("<table>") == written.count("</table></div>") == 1
