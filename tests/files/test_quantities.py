"""One table says the unit and the meaning of every quantity."""

import numpy as np
import pytest
import xarray as xr

from softslip.files.dataset_check import SCHEMAS
from softslip.files.faults import faults
from softslip.files.quantities import (
    FORMER_UNITS,
    QUANTITIES,
    dataset_quantity,
    described,
    unit_of,
)


@pytest.mark.parametrize("stage", SCHEMAS)
def test_a_quantity_has_one_unit_in_all_schemas(stage):
    for name, variable in SCHEMAS[stage].variables.items():
        found = dataset_quantity(name)
        assert found is not None, name
        assert (variable.units or "") == found.unit, name


def test_errors_have_the_unit_of_what_they_are_of_and_drifts_none():
    assert unit_of("slip_velocity_error") == unit_of("slip_velocity") == "length unit / time unit"
    assert unit_of("slip_velocity_drift") == "1"
    assert dataset_quantity("slip_velocity_error").meaning == (
        f"uncertainty of: {QUANTITIES['slip_velocity'].meaning}"
    )
    assert unit_of("slip_velocity_drift_error") == unit_of("slip_velocity_freedom") == "1"
    assert unit_of("yield_stress_interval") == unit_of("pooled_yield_stress_error") == "stress unit"
    assert dataset_quantity("pooled_fit_message").unit == "1"
    with pytest.raises(KeyError):
        unit_of("speed_of_sound")
    with pytest.raises(KeyError):
        unit_of("pooled_speed_of_sound")


def test_only_quantities_are_described():
    dataset = described(xr.Dataset({"area": ("particle", [1.0]), "other": ("particle", [2.0])}))
    assert dataset["area"].attrs == QUANTITIES["area"].attributes
    assert dataset["other"].attrs == {}


@pytest.mark.parametrize("former", FORMER_UNITS)
def test_files_with_a_former_spelling_are_read(former):
    schema = SCHEMAS["expansion"]
    dataset = described(
        xr.Dataset(
            {
                "node_position": (("node", "axis"), np.zeros((3, 2))),
                "nodes_per_particle": ("particle", [3]),
                "area": ("particle", [1.0]),
                "target_area": ("particle", [1.0]),
            },
            coords={"axis": ["x", "y"]},
        )
    )
    assert not list(faults(dataset, schema))
    dataset["area"].attrs["units"] = former
    assert not list(faults(dataset, schema))
    dataset["area"].attrs["units"] = "length unit cubed"
    assert any("area has the units" in fault for fault in faults(dataset, schema))
