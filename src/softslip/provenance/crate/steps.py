"""The steps of the workflow, as a research object describes them."""

from collections.abc import Mapping
from dataclasses import dataclass


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


STEPS: Mapping[str, WorkflowStep] = {
    "packing": WorkflowStep("packing", "Packs discs with LAMMPS", (), True, False),
    "expansion": WorkflowStep("expansion", "Grows discs into membranes", ("packing",), True, False),
    "ageing": WorkflowStep(
        "ageing", "Relaxes membranes at zero stress", ("expansion",), True, False
    ),
    "shear": WorkflowStep("shear", "Shears an aged packing", ("ageing",), True),
    "gather": WorkflowStep(
        "gather", "Gathers the runs of the scenario into a table", ("shear",), True
    ),
    "fit": WorkflowStep("fit", "Fits flow and slip laws to the flow curve", ("gather",)),
    "figure": WorkflowStep("draw", "Draws a figure from tables", ("gather", "fit")),
    "snapshot": WorkflowStep("draw", "Draws the particles of a run", ("shear",)),
}
"""Steps of the workflow, each after those whose results it reads."""
