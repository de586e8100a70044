import numpy as np
import xarray as xr

from softslip.studies.stability.map_markdown import limits_table, verdicts_table, wrong_cells

ERROR = "NumericalError: node_position[3] at step 0: is not right; use another"


def cells(*rows):
    names = ("group", "label", "scheme", "verdict", "message")
    columns = zip(*rows, strict=True)
    return xr.Dataset(
        {
            name: ("cell", np.array(values, dtype=object))
            for name, values in zip(names, columns, strict=True)
        }
    )


MAP = cells(
    ("stress", "0.1", "standard", "correct", ""),
    ("stress", "1", "standard", "correct", ""),
    ("stress", "5", "standard", "stopped", ERROR),
    ("stress", "9", "standard", "stopped", ERROR),
    ("printed_control", "exact, still", "literal", "wrong", "moved"),
    ("area_fraction", "0.95", "literal", "stopped", "ExpansionError: no room at all: alas"),
)


def test_cells_of_an_axis_stand_together_with_how_they_stopped():
    lines = verdicts_table(MAP).splitlines()
    assert lines[0] == "6 cells: 2 correct, 3 stopped, 1 wrong."
    assert "| stress | standard | 0.1, 1 | 5, 9: NumericalError, `node_position` |  |" in lines
    assert "| printed control | literal |  |  | exact still |" in lines
    assert "| area fraction | literal |  | 0.95: ExpansionError |  |" in lines


def test_wrong_cells_are_named():
    assert wrong_cells(MAP) == ["printed_control exact, still (literal): moved"]
    assert wrong_cells(MAP.isel(cell=slice(4))) == []


def test_limits_are_given_over_theory():
    setting = {
        "regularisation": 0.2,
        "node_spacing": 5.0,
        "roughness": 0.0,
        "stiffness": 2e4,
        "spectral_radius": 1000.0,
        "euler_limit": 0.00202,
        "euler_theory": 0.002,
    }
    limits = xr.Dataset(
        {name: ("setting", [value]) for name, value in setting.items()}
        | {"rkc2_limit": ("stages", [0.2, 0.3]), "rkc2_theory": ("stages", [0.2, 0.25])},
        {"stages": [2, 3], "mobility": ("setting", ["ewald"])},
    )
    text = limits_table(limits)
    assert "| `ewald` | 0.2 | 5 | 0 | 2e+04 | 1e+03 | 0.00202 | 1.010 |" in text
    assert "| Longest step over theory | 1.000 | 1.200 |" in text
