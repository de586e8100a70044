"""What a member does on every scene, and what that takes beside the reference in the same job."""

import json
import time
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from softslip.errors import SoftslipError
from softslip.files.quantities import QUANTITIES as OF_DATASETS
from softslip.solver.geometry import FloatArray
from softslip.studies.interval_means import QUANTITIES
from softslip.studies.meanings import attributes
from softslip.studies.timing import Tell, alternately, silent
from softslip.studies.tradeoff.member_run import COUNTS, MARKERS, PLACES, MemberRun, run_of
from softslip.studies.tradeoff.members import Member, parameters_of, reference_of
from softslip.studies.tradeoff.precision import in_single_precision
from softslip.studies.tradeoff.tradeoff_design import TradeoffDesign
from softslip.studies.tradeoff.tradeoff_scenes import on_member, scene_of

DONE = "done"
"""Status of a scene that ran to its end; any other says why it did not."""

REFERENCE = {
    "cost": "reference_cost",
    "evaluations": "reference_evaluations",
    "evaluation_time": "reference_evaluation_time",
}
"""What is kept of the reference in the same job, and its name."""

ROUNDS_FOR = 0.15
"""Time for which the evaluations of a member and the reference are timed in turn [s]."""

FEWEST_ROUNDS = 5
"""Evaluations of each at least, of which the quickest counts."""


def measure_member(
    dataset: xr.Dataset, member: Member, design: TradeoffDesign, tell: Tell = silent
) -> xr.Dataset:
    """Run a member over every scene, each followed by the reference, and return what came out.

    Parameters
    ----------
    dataset
        Of `studies.tradeoff.tradeoff_scenes.prepare`.
    member
        Of the design.
    design
        Its scenes and windows.

    Returns
    -------
    xarray.Dataset
        Along ``stress``, ``roughness``: the means of `QUANTITIES` over the records (``time``, NaN
        beyond the window of a short member), `COUNTS`, ``status``, and `PLACES` at the markers of
        all scenes (``marker_node``, ``axis``). A scene that stops has NaN and says why.
    """
    results: dict[tuple[float, float], MemberRun | str] = {}
    references: dict[tuple[float, float], dict[str, float]] = {}
    # The first run in a process compiles, which is no part of the cost of either.
    _warm(dataset, member, design)
    for roughness in design.roughnesses:
        for stress in design.stresses:
            tell(f"{member.name}: stress {stress:g}, roughness {roughness:g}")
            scene = scene_of(dataset, stress, roughness)
            results[stress, roughness] = _attempt(scene, member, design, stress, roughness)
            beside = _attempt(scene, reference_of(design), design, stress, roughness, short=True)
            if isinstance(beside, str):
                raise SoftslipError(f"the reference stopped: {beside}")
            _time_in_turn(results[stress, roughness], beside)
            references[stress, roughness] = beside.counts
    return _assembled(dataset, member, design, results, references)


def _time_in_turn(result: MemberRun | str, beside: MemberRun) -> None:
    """Add the times of an evaluation to the counts of a member and of the reference."""
    runs = {"reference": beside} | ({"member": result} if isinstance(result, MemberRun) else {})
    works = {
        name: partial(run.last.suspension.evaluate, run.last.state) for name, run in runs.items()
    }
    # The processor's time, as others may use the machine meanwhile.
    least = alternately(works, ROUNDS_FOR, FEWEST_ROUNDS, time.process_time)
    for name, run in runs.items():
        run.counts["evaluation_time"] = least[name]


def _warm(dataset: xr.Dataset, member: Member, design: TradeoffDesign) -> None:
    """Evaluate both members once."""
    stress, roughness = design.stresses[0], design.roughnesses[0]
    for each in (member, reference_of(design)):
        try:
            parameters = parameters_of(each, design, stress, roughness)
            scene = on_member(scene_of(dataset, stress, roughness), parameters)
            scene.suspension.closing_rate(scene.suspension.evaluate(scene.state))
        except SoftslipError:
            continue  # Where it is run, its status says why.


def _attempt(
    scene: xr.Dataset,
    member: Member,
    design: TradeoffDesign,
    stress: float,
    roughness: float,
    *,
    short: bool = False,
) -> MemberRun | str:
    """Return what a member does on a scene, or why it cannot."""
    try:
        parameters = parameters_of(member, design, stress, roughness)
        moved = design.perturbation * parameters.steric.length if member.kind == "twin" else 0.0
        given = on_member(scene, parameters, moved)
        if member.precision == "single":
            given = in_single_precision(given)
        return run_of(given, design, short=short or member.short)
    except SoftslipError as error:
        return str(error)


def _assembled(
    dataset: xr.Dataset,
    member: Member,
    design: TradeoffDesign,
    results: dict[tuple[float, float], MemberRun | str],
    references: dict[tuple[float, float], dict[str, float]],
) -> xr.Dataset:
    """Return the dataset of a member from what its runs gave."""
    long_window, _ = design.window
    shape = (len(design.stresses), len(design.roughnesses))
    series = {name: np.full((*shape, long_window), np.nan) for name in QUANTITIES}
    counts = {name: np.full(shape, np.nan) for name in (*COUNTS, *REFERENCE.values())}
    status = np.full(shape, DONE, dtype=object)
    places: dict[str, list[FloatArray]] = {name: [] for name in PLACES}
    for (stress, roughness), result in results.items():
        here = design.stresses.index(stress), design.roughnesses.index(roughness)
        for name, own in REFERENCE.items():
            counts[own][here] = references[stress, roughness][name]
        if isinstance(result, str):
            status[here] = result
            particles = scene_of(dataset, stress, roughness).sizes["particle"]
            lost = np.full((particles * MARKERS, 2), np.nan)
            for name in PLACES:
                places[name].append(lost)
            continue
        for name, value in result.counts.items():
            counts[name][here] = value
        for name, means in result.series.items():
            series[name][here][: len(means)] = means
        for name in PLACES:
            places[name].append(getattr(result, name).reshape(-1, 2))
    return _described(member, design, series, counts, status, places)


def _described(
    member: Member,
    design: TradeoffDesign,
    series: dict[str, FloatArray],
    counts: dict[str, FloatArray],
    status: np.ndarray[Any, Any],
    places: dict[str, list[FloatArray]],
) -> xr.Dataset:
    """Return the variables with their dimensions, units and meanings."""
    scene = ("stress", "roughness")
    long_window, short_window = design.window
    edges = design.interval * np.arange(long_window + 1.0)
    variables: dict[str, Any] = {
        **{
            name: ((*scene, "time"), series[name], OF_DATASETS[name].attributes)
            for name in QUANTITIES
        },
        **{name: (scene, counts[name], attributes(*COUNTS[name])) for name in COUNTS},
        **{own: (scene, counts[own], _of_reference(name)) for name, own in REFERENCE.items()},
        **{
            name: (("marker_node", "axis"), np.concatenate(places[name]), attributes(*PLACES[name]))
            for name in PLACES
        },
        "marker_scene": (
            "marker_node",
            np.repeat(np.arange(len(places["marker"])), [len(part) for part in places["marker"]]),
            attributes("1", "scene of each marker, stress by stress at each roughness"),
        ),
        "status": (scene, status.astype(str), attributes("1", "done, or why not")),
    }
    return xr.Dataset(
        variables,
        coords={
            "stress": (
                "stress",
                list(design.stresses),
                attributes("stress unit", "imposed stress"),
            ),
            "roughness": ("roughness", list(design.roughnesses), attributes("1", "wall roughness")),
            "time": ("time", edges[1:], attributes("time unit", "end of a record")),
        },
        attrs={
            "member": member.name,
            "kind": member.kind,
            "effect": member.effect,
            "precision": member.precision,
            "level": member.level or "literal",
            "parameters": _parameters(member, design),
            "settings": json.dumps(member.settings, sort_keys=True),
            "skipped": design.skipped,
            "short_window": short_window,
        },
    )


def _of_reference(name: str) -> dict[str, str]:
    unit, meaning = COUNTS[name]
    return attributes(unit, f"{meaning}: of the reference in the same job")


def _parameters(member: Member, design: TradeoffDesign) -> str:
    """Return the settings as JSON, those of the level included; empty where they contradict."""
    try:
        given = parameters_of(member, design, design.stresses[0], design.roughnesses[0])
    except SoftslipError:
        return "{}"
    return json.dumps(given.model_dump(mode="json"), sort_keys=True)
