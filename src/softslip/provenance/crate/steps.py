"""The steps of the workflow, as a research object describes them."""

from collections.abc import Mapping
from dataclasses import dataclass

from softslip.files.products import rules_before


@dataclass(frozen=True)
class WorkflowStep:
    """A step of the workflow, by the name of its rule.

    Attributes
    ----------
    command
        What it calls.
    purpose
        What it does, for people.
    reads
        The rules whose results it reads.
    takes_scenario
        Whether it reads the scenario too.
    is_output
        Whether its results are what the workflow is run for, not only what later steps need.
    """

    command: str
    purpose: str
    reads: tuple[str, ...] = ()
    takes_scenario: bool = False
    is_output: bool = True


def _step(
    rule: str, purpose: str, command: str = "", *, takes_scenario: bool = False, **others: bool
) -> tuple[str, WorkflowStep]:
    step = WorkflowStep(command or rule, purpose, rules_before(rule), takes_scenario, **others)
    return rule, step


STEPS: Mapping[str, WorkflowStep] = dict(
    (
        _step("packing", "Packs discs with LAMMPS", takes_scenario=True, is_output=False),
        _step("expansion", "Grows discs into membranes", takes_scenario=True, is_output=False),
        _step("ageing", "Relaxes membranes at zero stress", takes_scenario=True, is_output=False),
        _step("shear", "Shears an aged packing", takes_scenario=True),
        _step("gather", "Gathers the runs of the scenario into a table", takes_scenario=True),
        _step("fit", "Fits flow and slip laws to the flow curve"),
        _step("compare", "Holds the results against the paper's numbers"),
        _step("figure", "Draws a figure from tables", "draw"),
        _step("snapshot", "Draws the particles of a run", "draw"),
        _step("movie", "Shows the particles of a run as they move", "draw"),
        _step("explorer", "Writes a page that shows all runs", takes_scenario=True),
    )
)
"""Steps of the workflow, each after those whose results it reads."""
