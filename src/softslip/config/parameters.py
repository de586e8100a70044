"""The tree of a scenario's parameters, checked as a whole, and single values and keys of it."""

from collections.abc import Mapping
from typing import Any, Self

from pydantic import BaseModel, ValidationError, model_validator

from softslip.config.checks import CHECKS
from softslip.config.fidelity import with_level
from softslip.config.fields import owner, refusal, value_at
from softslip.config.sections import Tree
from softslip.errors import ConfigError
from softslip.messages import NOTHING, brief


class Parameters(Tree):
    """Everything that determines a run.

    Raises
    ------
    ConfigError
        When two values contradict each other.
    """

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for check in CHECKS:
            check(self)
        return self

    @classmethod
    def from_mapping(cls, tree: Mapping[str, Any]) -> "Parameters":
        """Validate a nested mapping, as read from YAML or JSON.

        Parameters
        ----------
        tree
            Any subset of the tree; groups are mappings or already validated models.

        Raises
        ------
        ConfigError
            Naming the first offending key, its value, the limit and a remedy.
        """
        try:
            return cls.model_validate(with_level(tree))
        except ValidationError as error:
            raise refusal(cls, error.errors()[0]) from None

    @classmethod
    def from_json(cls, text: str) -> "Parameters":
        """Validate the JSON of a whole tree, as `model_dump_json` writes it.

        Nothing is filled in for its fidelity or accuracy, whose settings the tree already has.

        Raises
        ------
        ConfigError
            Naming the first offending key, its value, the limit and a remedy.
        """
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            detail = error.errors()[0]
            if detail["type"] in {"json_invalid", "string_unicode"}:
                limit, remedy = "is not valid JSON", "leave it out to use the scenario's"
                raise ConfigError("parameters", brief(text), limit, remedy) from None
            raise refusal(cls, detail) from None


def check_fields(tree: Mapping[str, Any]) -> None:
    """Check the keys and values of a nested mapping by themselves, not against one another.

    Raises
    ------
    ConfigError
        Naming the first offending key, its value, the limit and a remedy.
    """
    try:
        Tree.model_validate(dict(tree))
    except ValidationError as error:
        raise refusal(Tree, error.errors()[0]) from None


def check_value(path: str, value: object) -> Any:
    """Return one value as the tree would hold it, such as 0.0 for 0 where a float belongs.

    Raises
    ------
    ConfigError
        When there is no such parameter, or when the value is not one that it can take.
    """
    _, name = field_at(path, value)
    *sections, _ = path.split(".")
    tree: dict[str, Any] = {name: value}
    for section in reversed(sections):
        tree = {section: tree}
    try:
        held: Any = Tree.model_validate(tree)
    except ValidationError as error:
        raise refusal(Tree, error.errors()[0]) from None
    return value_at(held, path)


def field_at(path: str, value: object = NOTHING) -> tuple[type[BaseModel], str]:
    """Return the model and the field name that a dotted parameter path names.

    ``value`` is what an error message shows as given for the path.

    Raises
    ------
    ConfigError
        When there is no such parameter, or when it is a group of parameters.
    """
    return owner(Parameters, path, value)
