import pytest

from softslip.errors import ConfigError
from softslip.studies.validation.manufactured import Manufactured


@pytest.mark.parametrize("fidelity", ["literal", "paper", "converged"])
def test_errors_fall_at_second_order(fidelity):
    outcome = Manufactured(fidelity=fidelity).solve()
    assert outcome.passed, outcome.errors
    assert 1.9 < outcome.result["order"] < 2.1
    assert outcome.result["finest"] == 256
    assert set(outcome.result) | set(outcome.errors) == set(Manufactured.units)


def test_order_is_closer_on_finer_meshes():
    coarse, fine = (
        Manufactured(fidelity="literal", coarsest=n, refinements=1).solve() for n in (32, 128)
    )
    assert fine.error < 0.2 * coarse.error
    assert coarse.result["velocity"] > fine.result["coarse_velocity"]


@pytest.mark.parametrize("coarsest", [16, 33, 1024])
def test_meshes_that_do_not_fit_are_refused(coarsest):
    with pytest.raises(ConfigError, match="coarsest"):
        Manufactured.of({"coarsest": coarsest})
