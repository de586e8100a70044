import numpy as np
import pytest

from softslip.errors import ConfigError
from softslip.files.storage import read_dataset, write_dataset
from softslip.studies.validation import CASES, sweep
from softslip.studies.validation.case import Case
from softslip.studies.validation.film import Film


@pytest.fixture(scope="module")
def films():
    axes = {"fidelity": ["literal", "standard"], "regularisation": [None, 0.5]}
    return sweep(Film, axes, {"thickness": 0.9})


def test_each_axis_is_a_dimension(films):
    assert films["film_result"].dims == ("fidelity", "regularisation")
    assert films["fidelity"].values.tolist() == ["literal", "standard"]
    assert np.isnan(films["regularisation"].values[0])
    assert films["regularisation"].values[1] == 0.5


def test_each_combination_is_that_of_the_case(films):
    alone = Film(fidelity="standard", regularisation=0.5, thickness=0.9).solve()
    found = films.isel(fidelity=1, regularisation=1)
    assert float(found["film_result"]) == alone.result["film"]
    assert float(found["film_reference"]) == alone.reference["film"]
    assert float(found["film_error"]) == alone.error
    assert float(found["film_tolerance"]) == alone.tolerances["film"]
    assert bool(found["passed"]) == alone.passed


def test_what_is_refused_is_kept_with_its_message(films):
    """The mesh has no regularisation of its own; all other combinations are solved."""
    refused = films["refusal"].values != ""
    assert refused.tolist() == [[False, True], [False, False]]
    message = str(films["refusal"].values[0, 1])
    assert message.startswith("hydrodynamics.regularisation: 0.5 has no meaning on the mesh")
    for name in ("film_result", "film_reference", "film_error", "film_tolerance"):
        assert np.array_equal(np.isnan(films[name].values), refused), name
    assert not films["passed"].values[refused].any()


def test_values_that_are_no_parameters_are_kept_too():
    found = sweep(Film, {"thickness": [-1.0, 0.75]}, {"fidelity": "standard"})
    assert "thickness: -1.0" in str(found["refusal"].values[0])
    assert bool(found["passed"].values[1])


def test_nothing_but_refusals_still_makes_a_dataset():
    found = sweep(Film, {"thickness": [-1.0, -2.0]})
    assert (found["refusal"].values != "").all()
    assert found.attrs["leading"] == ""


def test_other_parameters_are_attributes(films):
    assert films.attrs["case"] == "film"
    assert films.attrs["thickness"] == 0.9
    assert films.attrs["leading"] == "film"
    assert "regularisation" not in films.attrs


def test_every_number_has_a_unit_and_a_meaning(films):
    for name, variable in films.data_vars.items():
        assert variable.attrs["long_name"], name
        assert name == "refusal" or variable.attrs["units"], name
    assert films["film_result"].attrs["units"] == "length unit"
    assert films["film_error"].attrs["units"] == "1"


def test_a_sweep_survives_its_file(films, tmp_path):
    path = tmp_path / "film.nc"
    write_dataset(films, path, stage="validation", run="film", title="film")
    kept = read_dataset(path, stage="validation")
    assert np.array_equal(kept["refusal"].values.astype(str), films["refusal"].values.astype(str))
    assert np.array_equal(kept["film_error"], films["film_error"], equal_nan=True)
    assert kept["passed"].dtype == bool


@pytest.mark.parametrize(
    ("axes", "fixed", "said"),
    [
        ({"thickness": []}, {}, "without values"),
        ({"thicknes": [1.0]}, {}, "did you mean 'thickness'"),
        ({"thickness": [1.0]}, {"epsilon": 1.0}, "epsilon"),
        ({"thickness": [1.0]}, {"thickness": 1.0}, "axis too"),
    ],
)
def test_axes_that_make_no_sense_are_refused(axes, fixed, said):
    with pytest.raises(ConfigError, match=said):
        sweep(Film, axes, fixed)


@pytest.mark.parametrize("name", CASES)
def test_every_case_says_what_it_is(name):
    case = CASES[name]
    assert issubclass(case, Case)
    assert case.name == name
    assert case.summary
    assert all(len(words) == 2 and all(words) for words in case.units.values())
    case()
