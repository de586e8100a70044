"""`softslip validate`: a flow with a known solution, solved with settings of one's own."""

import inspect
import json
import sys
from collections.abc import Callable
from typing import Annotated, Any, Literal, get_args, get_origin

import typer
from pydantic.fields import FieldInfo
from rich.console import Console
from rich.table import Table

from softslip.cli.common import FAILURE_EXIT, AsJson, one_line_errors
from softslip.config.fields import bounds, extra


class _Cases(typer.core.TyperGroup):
    """The cases as commands; importing the solver waits until one of them is asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all cases."""
        from softslip.studies.validation import CASES

        return list(CASES)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command of a case, with an option for each of its parameters."""
        from softslip.studies.validation import CASES

        if cmd_name not in CASES:
            return super().get_command(ctx, cmd_name)
        case = CASES[cmd_name]
        single = typer.Typer(add_completion=False)
        single.command(name=cmd_name, help=case.summary)(_command(cmd_name, case.model_fields))
        return typer.main.get_command(single)


app = typer.Typer(
    cls=_Cases,
    no_args_is_help=True,
    help="Solve a flow whose solution is known, and compare; fails when the error is too large.",
)


@app.callback()
def cases() -> None:
    """Solve a flow whose solution is known, and compare; fails when the error is too large."""


def _command(name: str, fields: dict[str, FieldInfo]) -> Callable[..., None]:
    """Return a function whose options are a case's parameters."""

    def validate(as_json: bool, **values: Any) -> None:
        from softslip.studies.validation import CASES

        outcome = CASES[name].of(values).solve()
        if as_json:
            print(json.dumps(outcome.as_mapping()))
        else:
            _show(outcome)
        if not outcome.passed:
            raise typer.Exit(FAILURE_EXIT)

    keyword = inspect.Parameter.KEYWORD_ONLY
    options = [
        inspect.Parameter(key, keyword, default=field.default, annotation=_option(field))
        for key, field in fields.items()
    ]
    options.append(inspect.Parameter("as_json", keyword, default=False, annotation=AsJson))
    guarded = one_line_errors(validate)
    guarded.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]
    return guarded


def _option(field: FieldInfo) -> Any:
    """Return the annotation of the option of a field; its values are checked by the case."""
    unit, allowed = extra(field, "unit"), bounds(field)
    words = [field.description, f"[{unit}]" if unit != "1" else "", allowed and f"({allowed})"]
    return Annotated[_plain(field.annotation), typer.Option(help=" ".join(filter(None, words)))]


def _plain(annotation: Any) -> Any:
    """Return a type that options can have: words for choices, lists for tuples."""
    inner = [part for part in get_args(annotation) if part is not type(None)]
    if get_origin(annotation) is Literal:
        return str
    if get_origin(annotation) is tuple:
        return list[_plain(inner[0])]  # type: ignore[misc]
    return annotation


def _show(outcome: Any) -> None:
    """Print an outcome as a table."""
    words = ", ".join(f"{key} {value}" for key, value in outcome.parameters.items())
    table = Table("quantity", "result", "reference", title=f"{outcome.case}: {words}")
    for key, value in outcome.result.items():
        exact = outcome.reference.get(key)
        table.add_row(key, f"{value:.6g}", "" if exact is None else f"{exact:.6g}")
    for key, value in outcome.errors.items():
        limit = outcome.tolerances[key]
        mark = "✓" if value <= limit else "over"
        table.add_row(f"error: {key}", f"{value:.3g}", f"{mark} {limit:.3g}")
    Console(width=None if sys.stdout.isatty() else 120).print(table)
