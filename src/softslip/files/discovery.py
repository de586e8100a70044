"""What files say of themselves to those who look for data: the attributes of ACDD-1.3."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from softslip.files.conventions import MODEL_UNITS
from softslip.files.products import DATASETS


@dataclass(frozen=True)
class Description:
    """What the datasets of one stage are.

    Attributes
    ----------
    summary
        One or two sentences for people who look for data.
    level
        How far the data have come from the simulation.
    """

    summary: str
    level: str


OUTPUT, TEST = "output of a simulation", "test of the software"

DESCRIPTIONS: Mapping[str, Description] = {
    "packing": Description(
        "Centres and radii of soft discs that were packed without overlap between the two walls "
        "of a channel.",
        OUTPUT,
    ),
    "expansion": Description(
        "Nodes of the elastic membranes of soft particles that were grown between two walls to "
        "their final area fraction.",
        OUTPUT,
    ),
    "ageing": Description(
        "State of a dense suspension of soft particles after a time at rest between two walls: "
        "membranes, walls and the tractions that hold them.",
        OUTPUT,
    ),
    "shear": Description(
        "Shear rates, slip velocities, velocity profiles and snapshots of a dense suspension of "
        "soft particles under stress between two walls, as means over intervals of time.",
        OUTPUT,
    ),
    **{entry.name: Description(entry.summary, entry.level) for entry in DATASETS.values()},
    "effort": Description(
        "Processor time of the runs of a scenario beside its estimate, and what set the length of "
        "their time steps.",
        TEST,
    ),
    "reproduction": Description(
        "Steady shear rates and slip velocities of published runs of dense suspensions of soft "
        "particles beside those of the same runs made again.",
        TEST,
    ),
    "bench": Description(
        "Computing time, memory and accuracy of numerical schemes side by side.", TEST
    ),
    "coverage": Description(
        "How often verdicts on steady states err, and intervals of confidence hold the truth, on "
        "made-up data.",
        TEST,
    ),
    "elements": Description("Computing time of each element of a simulated scene.", TEST),
    "validation": Description("Solutions of a flow against what is known of it.", TEST),
    "stability": Description(
        "Which simulations at one kind of extreme stay right, stop or fail.", TEST
    ),
    "stability_map": Description("Which simulations at extremes stay right, stop or fail.", TEST),
    "limits": Description("Longest stable time steps of the integrators beside theory.", TEST),
    "scene": Description(
        "Sheared packings that numerical schemes of the trade-off of speed against accuracy "
        "start from.",
        TEST,
    ),
    "member": Description("Flow and cost of one numerical scheme of the trade-off.", TEST),
    "steady": Description("Long runs of one packing at several lengths of regularisation.", TEST),
    "tradeoff": Description(
        "Errors and costs of numerical schemes, and the limit that they tend to.", TEST
    ),
}
"""What the datasets of each stage are."""

OTHER = Description("Result of a simulation of a dense suspension of soft particles.", OUTPUT)
"""What the datasets of any further stage are."""

COMMENT = (
    "A channel in the scaled units of the paper, not a place on Earth: what is in a unit of the "
    f"model, named in the attribute {MODEL_UNITS}, has units of 1. The length unit is the height "
    "of the paper's periodic box, the stress unit the modulus of its membranes, and the time unit "
    "the viscosity of its solvent over the stress unit."
)
"""What the units in files mean."""

COMMON: Mapping[str, str] = {
    "keywords": "wall slip, yield stress, soft particle suspension, rheology, "
    "immersed boundary method, Stokes flow",
    "comment": COMMENT,
    "acknowledgement": "The model is that of the paper among the references.",
    "license": "MIT License",
    "creator_name": "The softslip developers",
    "creator_type": "group",
    "project": "softslip",
}
"""Attributes of ACDD that all files share."""


def discovery(stage: str, run: str) -> dict[str, str]:
    """Return the attributes of ACDD-1.3 that follow from what a dataset is of.

    Only files have them, see `without_discovery`.

    Parameters
    ----------
    stage, run
        Which stage and which run it is the result of.
    """
    description = DESCRIPTIONS.get(stage, OTHER)
    return {
        **COMMON,
        "id": ".".join(["softslip", stage, *run.split()]),
        "summary": description.summary,
        "processing_level": description.level,
    }


def without_discovery(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return a dataset's attributes without those that `discovery` gave it.

    What a dataset says of itself under the same name, as a validation does in ``summary``, stays.

    Parameters
    ----------
    attributes
        As a file has them.
    """
    given = discovery(str(attributes.get("stage", "")), str(attributes.get("run", "")))
    return {key: value for key, value in attributes.items() if given.get(key) != str(value)}
