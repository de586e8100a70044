import pytest

from softslip.errors import ConfigError
from softslip.studies.tradeoff.tradeoff_design import TradeoffDesign


def test_lists_are_replaced_and_the_rest_stays():
    design = TradeoffDesign.of({"node_spacings": [4.0], "regularisations": [0.2, None]})
    assert design.node_spacings == (4.0,)
    assert design.regularisations == (0.2, None)
    assert design.tolerances == TradeoffDesign().tolerances


def test_windows_count_the_records_that_are_skipped():
    design = TradeoffDesign.of({"skipped": 2, "records": 5, "short_records": 3})
    assert design.window == (7, 5)
    assert TradeoffDesign.of({"skipped": 0, "records": 1, "short_records": 4}).window == (1, 1)


@pytest.mark.parametrize(
    ("values", "key"),
    [
        ({"particels": 44}, "particels"),
        ({"node_spacings": []}, "node_spacings"),
        ({"node_spacings": [4.0, -1.0]}, "node_spacings[1]"),
        ({"regularisations": [0.0]}, "regularisations[0]"),
        ({"interval": 0.0}, "interval"),
        ({"steady": {"duration": "long"}}, "steady.duration"),
        ({"variants": {"a/b": {}}}, "variants.a/b"),
        ({"variants": {"fine": {"precision": "half"}}}, "variants.fine.precision"),
        ({"variants": {"fine": {"speed": 1}}}, "variants.fine.speed"),
        ({"variants": {"fine": {"settings": {"steric": 1}}}}, "variants.fine.settings.steric"),
    ],
)
def test_what_is_no_plan_is_refused_by_its_key(values, key):
    with pytest.raises(ConfigError) as refused:
        TradeoffDesign.of(values)
    assert refused.value.key == key
