"""What all groups of parameters share."""

from collections.abc import Mapping
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from softslip.config.fields import refusal
from softslip.errors import ConfigError


class Section(BaseModel):
    """A group of parameters: frozen, and strict about what it is given."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


class Standalone(Section):
    """A group that is read by itself, not as a part of a scenario's tree."""

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Self:
        """Return the group with the values of a mapping, as read from YAML, and defaults besides.

        Raises
        ------
        ConfigError
            Naming the first offending key, its value, the limit and a remedy.
        """
        try:
            return cls.model_validate(dict(values))
        except ValidationError as error:
            raise cls.refused(error.errors()[0]) from None

    @classmethod
    def refused(cls, detail: ErrorDetails) -> ConfigError:
        """Return the error that one of pydantic's stands for, in one sentence."""
        return refusal(cls, detail)
