"""In which order the runs of a sweep are worked on, so that a useful part of them is done first."""

from collections.abc import Mapping

from softslip.config.scenario import Scenario
from softslip.config.stages import STAGES

REPLICAS = "seed"
"""Path of the axis whose values are samples of one condition: every condition has one first."""


def priorities(scenario: Scenario) -> dict[str, Mapping[str, int]]:
    """Return the priority of each run of each stage, the highest first to be worked on.

    The first sample of every condition comes before the second of any. Among conditions the ends
    of each axis come first, then its middle, then the quarters: whenever the sweep is stopped, what
    is done covers all of its range evenly. A run of an early stage has the priority of the first
    run that needs it.

    Returns
    -------
    dict
        By stage and run; whole numbers from 1 on.
    """
    runs = scenario.runs()
    lengths = [len(axis.values) for axis in scenario.axes]
    order = sorted(range(len(runs)), key=lambda place: _urgency(scenario, place, lengths))
    found: dict[str, dict[str, int]] = {stage: {} for stage in STAGES}
    for rank, place in enumerate(order):
        for stage, run in runs[place].ids.items():
            found[stage].setdefault(run, len(runs) - rank)
    return dict(found)


def _urgency(scenario: Scenario, place: int, lengths: list[int]) -> tuple[int, int, int, int]:
    """Return what runs are sorted by: sample, finest level, all levels, place in the scenario."""
    sample, levels, rest = 0, list[int](), place
    for axis, length in zip(reversed(scenario.axes), reversed(lengths), strict=True):
        rest, index = divmod(rest, length)
        if axis.path == REPLICAS:
            sample = index
        else:
            levels.append(halvings(index, length))
    return sample, max(levels, default=0), sum(levels), place


def halvings(index: int, length: int) -> int:
    """Return how often a range of values has been halved when a value of it is reached.

    The first and the last are there from the start.
    """
    low, high, count = 0, length - 1, 0
    while index not in (low, high):
        middle = (low + high) // 2
        count += 1
        if index == middle:
            return count
        low, high = (low, middle) if index < middle else (middle, high)
    return count
