import pytest
from hypothesis import given
from hypothesis import strategies as st

from softslip.errors import ConfigError, NumericalError, SoftslipError


@given(st.text(), st.text(), st.text())
def test_a_config_error_is_one_line(value: str, limit: str, remedy: str) -> None:
    message = str(ConfigError("wall.roughness", value, limit, remedy))
    assert message.splitlines() == [message], repr(message)


def test_a_config_error_says_key_value_limit_and_remedy_in_this_order() -> None:
    error = ConfigError("wall.roughness", 5.0, "must be at most 3", "use less")
    assert str(error) == "wall.roughness: 5.0 must be at most 3; use less"
    assert error.key == "wall.roughness"


def test_a_numerical_error_says_where_and_when() -> None:
    error = NumericalError("node_position", 7, 12, "is not finite; use a smaller step")
    assert str(error).startswith("node_position[7] at step 12: is not finite")
    assert (error.field, error.index, error.step) == ("node_position", 7, 12)


@pytest.mark.parametrize("kind", SoftslipError.__subclasses__())
def test_every_error_can_be_caught_as_one(kind: type[SoftslipError]) -> None:
    assert issubclass(kind, SoftslipError)
