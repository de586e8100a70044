"""What has no units in the model has none in the laboratory, and the equations agree."""

import math

import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st

from softslip.errors import ConfigError
from softslip.files.quantities import QUANTITIES
from softslip.provenance.export.lab_units import MICRO, LabUnits
from softslip.simulation.assembly import assemble, layout_of
from softslip.solver.state import State

BASE = {
    "base": {
        "solvent": {"viscosity": 1.0},
        "membrane": {"elastic_constant": 1.0},
        "suspension": {"mean_radius": 0.00846},
    },
    "axes": {},
}

POSITIVE = st.floats(1e-6, 1e6)


def laboratory(viscosity: float, elastic: float, radius: float) -> dict[str, float | None]:
    return {"viscosity": viscosity, "elastic-constant": elastic, "radius": radius}


@given(POSITIVE, POSITIVE, POSITIVE, POSITIVE, POSITIVE)
def test_reduced_stress_and_rate_are_the_same_in_the_laboratory(
    viscosity, elastic, radius, own_viscosity, own_elastic
):
    tree = {
        "base": BASE["base"]
        | {
            "solvent": {"viscosity": own_viscosity},
            "membrane": {"elastic_constant": own_elastic},
        }
    }
    units = LabUnits.of(tree, laboratory(viscosity, elastic, radius))
    own_radius, metres = 0.00846, radius * MICRO
    # σ R/K_e and η γ̇ R/K_e of one unit each.
    assert math.isclose(own_radius / own_elastic, units.stress * metres / elastic, rel_tol=1e-12)
    own_rate = own_viscosity * own_radius / own_elastic
    assert math.isclose(own_rate, viscosity / units.time * metres / elastic, rel_tol=1e-12)


def test_a_known_emulsion_has_known_units() -> None:
    # Drops of 1 µm in water with K_e of 10 mN/m: K_e/R is 10 kPa.
    units = LabUnits.of(BASE, laboratory(1e-3, 1e-2, 1.0))
    assert math.isclose(units.length, 1 / 0.00846)
    assert math.isclose(units.stress, 84.6)
    assert math.isclose(units.time, 1e-3 / 84.6)


def test_the_equations_of_motion_agree_with_the_mapping() -> None:
    """Velocities of a foam scale as the mapping says when lengths, K_e and viscosity change."""
    length, elastic, viscosity = 2.0, 3.0, 0.25
    ours = scenes.parameters(rheometer={"stress": 0.5})
    foam = scenes.foam(ours)
    tree = {"base": ours.model_dump()}
    radius = ours.suspension.mean_radius
    units = LabUnits.of(tree, laboratory(viscosity, elastic, length * radius / 1.0))
    # In metres, as the laboratory's numbers stand beside the model's without micrometres.
    stress, time = units.stress * MICRO, units.time / MICRO
    theirs = scenes.parameters(
        solvent={"viscosity": viscosity},
        channel={key: length * ours.channel.model_dump()[key] for key in ("length", "height")}
        | {"outer_gap": length * ours.channel.outer_gap},
        suspension={"mean_radius": length * radius},
        membrane={"elastic_constant": elastic},
        wall={"stiffness": ours.wall.stiffness * stress / length},
        # A pair's energy at a fixed spacing of nodes: a stress times a length squared, over the
        # square of spacings that are `length` times as long.
        steric={"length": length * ours.steric.length, "energy": ours.steric.energy * stress},
        hydrodynamics={"resolution": round(ours.hydrodynamics.resolution / length)},
        rheometer={"stress": 0.5 * stress},
        expansion={"contact_length": length * ours.expansion.contact_length},
    )

    def velocities(given, packing):
        layout = layout_of(packing.rename(area="reference_area"), given)
        suspension = assemble(given, layout, stress=given.rheometer.stress)
        state = State.at_rest(packing["node_position"].values, layout)
        return state.like(suspension.evaluate(state).rate).node_position

    larger = foam.assign(
        node_position=foam["node_position"] * length,
        area=foam["area"] * length**2,
    )
    own, other = velocities(ours, foam), velocities(theirs, larger)
    assert np.abs(own).max() > 0
    np.testing.assert_allclose(other, own * length / time, rtol=0, atol=1e-9 * np.abs(other).max())


@pytest.mark.parametrize(
    ("unit", "factor", "spelt"),
    [
        ("length unit", 2.0, "µm"),
        ("1 / time unit", 1 / 3.0, "1/s"),
        ("stress unit", 5.0, "Pa"),
        ("length unit / time unit", 2 / 3.0, "µm/s"),
        ("length unit squared", 4.0, "µm^2"),
        ("length unit / time unit / stress unit", 2 / 15.0, "µm/s/Pa"),
        ("viscosity unit", 15.0, "Pa s"),
        ("1", 1.0, "1"),
        ("degree", 1.0, "degree"),
    ],
)
def test_units_are_converted_by_their_powers(unit: str, factor: float, spelt: str) -> None:
    found, name = LabUnits(length=2.0, time=3.0, stress=5.0).factor(unit)
    assert math.isclose(found, factor)
    assert name == spelt


def test_every_unit_of_the_datasets_is_converted_but_that_of_a_power_law() -> None:
    units, refused = LabUnits(1.0, 1.0, 1.0), set()
    for name, quantity in QUANTITIES.items():
        try:
            units.factor(quantity.unit)
        except ConfigError:
            refused.add(name)
    assert refused == {"consistency", "covariance"}


@pytest.mark.parametrize("name", ["viscosity", "elastic-constant", "radius"])
@pytest.mark.parametrize("value", [None, 0.0, -1.0, math.nan, math.inf])
def test_what_is_missing_or_not_positive_is_refused(name: str, value: float | None) -> None:
    given = laboratory(1.0, 1.0, 1.0) | {name: value}
    with pytest.raises(ConfigError, match=f"^{name}: .*give it in"):
        LabUnits.of(BASE, given)


def test_a_sweep_over_what_makes_the_units_is_refused() -> None:
    swept = BASE | {"axes": {"membrane.elastic_constant": [1.0, 2.0]}}
    with pytest.raises(ConfigError, match=r"membrane\.elastic_constant: .*is swept"):
        LabUnits.of(swept, laboratory(1.0, 1.0, 1.0))
