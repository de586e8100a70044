"""What each element of a scene costs: the same scene with it and without it, side by side."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from operator import attrgetter
from typing import Any

import numpy as np

from softslip.config.parameters import Parameters
from softslip.simulation import assembly
from softslip.simulation.observer import Observer
from softslip.solver.geometry import FloatArray
from softslip.studies import boxes, scenes
from softslip.studies.bench.elements_scenes import DILUTE, MARGIN, ROUGHNESS, Scenes
from softslip.studies.timing import Tell, alternately, cheapest, silent

DURATION = 4.0
"""Time over which costs are taken: many of a run's steps [time unit]."""

FIELDS = 1.0
"""Velocity fields that a run with them keeps [1 / time unit]."""


@dataclass(frozen=True)
class Element:
    """One element of a scene, in words.

    Attributes
    ----------
    present, absent
        The two scenes that are compared.
    idle
        What is switched off in the second.
    """

    present: str
    absent: str
    idle: str


_EMPTY = "channel between flat walls without particles"

ELEMENTS = {
    "particles": Element(
        f"φ = {boxes.AREA_FRACTION:g}",
        "no particles",
        "membranes, contacts and their lists, near pairs but the walls' constant ones, areas, "
        "stress carried by bodies",
    ),
    "close packing": Element(
        f"φ = {boxes.AREA_FRACTION:g}",
        f"φ = {DILUTE:g}",
        "contact points and forces where nothing touches (the list stays nearly empty); fewer "
        "membranes and near pairs",
    ),
    "bumps": Element(
        f"β = {ROUGHNESS:g}", "β = 0", "nodes of bumps: a flat wall is a line of nodes"
    ),
    "bumps, no particles": Element(
        f"β = {ROUGHNESS:g}, channel without particles",
        f"β = 0, {_EMPTY}",
        "nodes of bumps",
    ),
    "wall drive": Element(
        f"σ = {boxes.STRESS:g}",
        "σ = 0",
        "traction on the walls (in the paper's periodic box it stays, to cancel the packing's own "
        "stress); a packing at rest takes longer steps",
    ),
    "wall drive, no particles": Element(
        f"σ = {boxes.STRESS:g}, {_EMPTY}",
        f"σ = 0, {_EMPTY}",
        "every flow solution but those of the spectral radius: nothing pushes",
    ),
    "outer gap": Element(
        f"gap {boxes.PAPER_GAP:g}, as the paper",
        f"gap {boxes.GAP:g} or a little more",
        "mesh lines in the solvent outside, which is at rest",
    ),
    "velocity fields": Element(
        f"{FIELDS:g} a time unit", "none", "velocities off the nodes: two-dimensional fields"
    ),
    "bulk observables": Element(
        f"bulk_margin {MARGIN:g}", "bulk_margin null", "line through the mean velocity profile"
    ),
    "observables": Element(
        "all of them, every stride",
        "none, as while ageing",
        "mean flow, stress at every height, areas",
    ),
}
"""Elements of a scene and what a scene without them leaves out."""


@dataclass(frozen=True)
class Cost:
    """What a scene takes.

    Attributes
    ----------
    seconds, evaluations
        Core-seconds, and evaluations of the equations of motion, per time unit.
    nodes, pairs, contacts
        Nodes, near pairs of the mobility, and pairs of contact points that may touch.
    """

    seconds: float
    evaluations: float
    nodes: int
    pairs: int
    contacts: int

    @property
    def each(self) -> float:
        """Core-seconds per evaluation, with all that goes with it."""
        return self.seconds / self.evaluations

    def with_work(self, seconds: float) -> "Cost":
        """Return the cost with so many more core-seconds per time unit."""
        return replace(self, seconds=self.seconds + seconds)


Pair = tuple[Cost, Cost]
"""What a scene takes with an element, and without it."""


def bench_elements(
    particles: int = 100,
    fidelity: str = "standard",
    *,
    ageing: float = scenes.AGEING,
    shearing: float = scenes.SHEARING,
    duration: float = DURATION,
    budget: float = 2.0,
    tell: Tell = silent,
) -> dict[str, Any]:
    """Measure what each element of a scene costs, and what is saved where it is absent.

    The scene has N particles between smooth walls under stress; one element at a time is added or
    taken away; between rough walls are the same particles. Every scene has moved under its own
    conditions before it is measured, but for the two outer gaps, which have the same nodes.
    Motions are run in turns over the same time; what is recorded is timed by itself and counted
    as often as a run does it.

    Parameters
    ----------
    particles
        N at the area fraction of the paper; all scenes have its channel.
    fidelity
        Level.
    ageing, shearing
        Times at rest and under stress before anything is measured [time unit].
    duration
        Of the runs [time unit].
    budget
        Time for the repeats of each comparison [s].

    Returns
    -------
    dict
        For each of `ELEMENTS` ``..._with`` and ``..._without`` of each figure of `Cost`, the
        shares ``saved_share`` of the core-seconds and ``saved_per_evaluation``, and in words
        ``scene_with``, ``scene_without`` and ``switched_off``; ``duration``.

    Raises
    ------
    SoftslipError
        When there is no such scene, or a run fails.
    """
    prepare = Scenes(particles, fidelity, ageing, shearing)
    pairs: dict[str, Pair] = {}
    for name, scene in prepare.motions(tell).items():
        tell(f"running with and without: {name}")
        pairs[name] = _of_motion(*scene, duration, budget)
    tell("timing what is recorded")
    pairs |= _of_records(prepare.dense, pairs["particles"][0], duration, budget)
    costs = {name: pairs[name] for name in ELEMENTS}
    figures = {
        f"{key}_{word}": {name: asdict(pair[place])[key] for name, pair in costs.items()}
        for place, word in enumerate(("with", "without"))
        for key in ("seconds", "evaluations", "nodes", "pairs", "contacts")
    }
    return {
        "bench": "elements",
        "particles": particles,
        "fidelity": fidelity,
        "duration": duration,
        **figures,
        "saved_share": {
            name: 1 - absent.seconds / present.seconds for name, (present, absent) in costs.items()
        },
        "saved_per_evaluation": {
            name: 1 - absent.each / present.each for name, (present, absent) in costs.items()
        },
        "scene_with": {name: element.present for name, element in ELEMENTS.items()},
        "scene_without": {name: element.absent for name, element in ELEMENTS.items()},
        "switched_off": {name: element.idle for name, element in ELEMENTS.items()},
    }


def _of_motion(present: scenes.Scene, absent: scenes.Scene, duration: float, budget: float) -> Pair:
    """Return what two scenes take, run in turns."""
    pair = {"with": present, "without": absent}
    works = {name: partial(scenes.advance, scene, duration) for name, scene in pair.items()}
    runs = cheapest(works, attrgetter("core_seconds"), budget)
    return _cost(present, runs["with"]), _cost(absent, runs["without"])


def _cost(scene: scenes.Scene, stretch: scenes.Stretch) -> Cost:
    """Return what a stretch of a scene took, with the pairs at the scene's instant."""
    evaluation = scene.suspension.evaluate(scene.state)
    solver = scenes.plain_sum(scene.parameters, scene.layout)
    solver.velocities(evaluation.positions, evaluation.forces)
    contacts = assembly.contacts_of(scene.parameters, scene.layout)
    return Cost(
        seconds=stretch.core_seconds / stretch.duration,
        evaluations=stretch.evaluations / stretch.duration,
        nodes=scene.layout.nodes,
        pairs=solver.pairs,
        contacts=contacts.listed(evaluation.positions),
    )


def _of_records(
    scene: scenes.Scene, bare: Cost, duration: float, budget: float
) -> Mapping[str, Pair]:
    """Return what records add to a motion, from the time of one and how many a run makes."""
    given, state = scene.parameters, scene.state
    evaluation, flow = scene.suspension.evaluate(state), assembly.mean_flow(given)
    without = given.model_copy(
        update={"recording": given.recording.model_copy(update={"bulk_margin": None})}
    )
    full, plain = (Observer(each, scene.layout, flow) for each in (given, without))
    points = field_points(given)
    seconds = alternately(
        {
            "field": lambda: scene.suspension.velocities_at(points, evaluation),
            "full": lambda: full.measure(state, evaluation),
            "plain": lambda: plain.measure(state, evaluation),
        },
        budget,
    )
    steps = scenes.advance(scene, duration).steps / duration
    samples = steps / given.recording.stride
    return {
        "velocity fields": (bare.with_work(FIELDS * seconds["field"]), bare),
        "bulk observables": (
            bare.with_work(samples * seconds["full"]),
            bare.with_work(samples * seconds["plain"]),
        ),
        "observables": (bare.with_work(samples * seconds["full"]), bare),
    }


def field_points(parameters: Parameters) -> FloatArray:
    """Return the points of a kept velocity field, shape (points, 2) [length unit]."""
    channel = parameters.channel
    spacing = parameters.recording.field_spacing * parameters.suspension.mean_radius
    sides = [
        (np.arange(count) + 0.5) * (size / count)
        for size in (channel.length, channel.height)
        for count in [max(round(size / spacing), 1)]
    ]
    return np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)
