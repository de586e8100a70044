from softslip.studies.validation import sweep
from softslip.studies.validation.errors_markdown import errors_table
from softslip.studies.validation.friction import Friction


def test_each_level_has_its_largest_error():
    axes = {"fidelity": ["preview", "paper"], "separation": [0.7, 0.9]}
    dataset = sweep(Friction, axes, {"offsets": 4}).assign_attrs(run="mine")
    row = errors_table([dataset]).splitlines()[2]
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    worst = dataset["friction_error"].max("separation")
    assert cells[:2] == ["mine", "separation 0.7 … 0.9"]
    assert cells[3:] == ["", f"{float(worst[0]):.2g}", "", f"{float(worst[1]):.2g}", "", "0.01"]


def test_a_sweep_at_one_level_stands_in_its_column():
    dataset = sweep(Friction, {"separation": [0.8]}, {"fidelity": "standard", "offsets": 4})
    row = errors_table([dataset.assign_attrs(run="mine")]).splitlines()[2]
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert [bool(cell) for cell in cells[3:8]] == [False, False, True, False, False]
