"""Long runs: steady averages, whose error is statistical because trajectories part."""

import json
import time
from dataclasses import dataclass

import numpy as np
import xarray as xr

from softslip.analysis.observables.steady import steady_state
from softslip.config.parameters import Parameters
from softslip.errors import SoftslipError
from softslip.simulation import hydrodynamics
from softslip.studies.boxes import merged
from softslip.studies.meanings import attributes
from softslip.studies.timing import Tell, silent
from softslip.studies.tradeoff.member_dataset import DONE
from softslip.studies.tradeoff.members import LEVEL, Member, parameters_of
from softslip.studies.tradeoff.tradeoff_design import TradeoffDesign
from softslip.studies.tradeoff.tradeoff_scenes import aged_packing

RATES = ("slip_velocity", "shear_rate_wall", "shear_rate_bulk")
"""Observables that are judged."""

LONGEST_RECORD = 1.0
"""Longest record [time unit], so that averages over a few time units can be told apart."""


@dataclass(frozen=True)
class ShearedPacking:
    """One packing that is sheared for long.

    Attributes
    ----------
    name
        Unique, and safe in file names.
    roughness, seed
        Of its walls and of its packing.
    periods
        Its length along the flow over that of the design's scenes.
    """

    name: str
    roughness: float
    seed: int
    periods: int = 1


def sheared_packings(design: TradeoffDesign) -> dict[str, ShearedPacking]:
    """Return the packings of a design's long runs by name."""
    steady = design.steady
    found = [
        ShearedPacking(f"beta{roughness:g}-seed{seed}", roughness, seed)
        for roughness in steady.roughnesses
        for seed in steady.seeds
    ]
    if steady.wide_regularisations:
        found += [ShearedPacking(f"beta0-seed{seed}-wide", 0.0, seed, 2) for seed in steady.seeds]
    return {packing.name: packing for packing in found}


def measure_steady(
    packing: ShearedPacking, design: TradeoffDesign, tell: Tell = silent
) -> xr.Dataset:
    """Age one packing and shear it for long at every stress and regularisation length.

    The other settings are those of `LEVEL`.

    Returns
    -------
    xarray.Dataset
        Along ``regularisation`` (NaN is the mesh's own), ``stress``: the records of `RATES`
        (``time``), their averages, errors and steadiness by
        `analysis.observables.steady.steady_state`, ``cost`` and ``status``.

    Raises
    ------
    SoftslipError
        When there is no such packing.
    """
    steady = design.steady
    lengths = steady.regularisations if packing.periods == 1 else steady.wide_regularisations
    tell(f"{packing.name}: ageing")
    given = _wide(Member("start", "level", LEVEL), design, packing)
    aged = aged_packing(
        given,
        _design_of(design, packing),
        packing.roughness,
        seed=packing.seed,
        ageing=steady.ageing,
    )
    rows = []
    for length in lengths:
        row = []
        for stress in steady.stresses:
            tell(f"{packing.name}: stress {stress:g}, regularisation {length}")
            settings = {**given.settings, "hydrodynamics": {"regularisation": length}}
            member = Member("steady", "level", LEVEL, settings)
            row.append(_run(aged, member, design, packing, stress))
        rows.append(xr.concat(row, "stress", join="outer"))
    return _labelled(xr.concat(rows, "regularisation", join="outer"), design, packing, lengths)


def _design_of(design: TradeoffDesign, packing: ShearedPacking) -> TradeoffDesign:
    return design.model_copy(update={"particles": design.particles * packing.periods})


def _wide(member: Member, design: TradeoffDesign, packing: ShearedPacking) -> Member:
    """Return a member whose channel is several times as long, and as high."""
    if packing.periods == 1:
        return member
    narrow = parameters_of(member, design, design.stresses[0], packing.roughness).channel
    channel = {
        "length": narrow.length * packing.periods,
        "height": narrow.height,
        "outer_gap": narrow.outer_gap,
    }
    return Member(member.name, member.kind, member.level, {**member.settings, "channel": channel})


def _run(
    aged: xr.Dataset, member: Member, design: TradeoffDesign, packing: ShearedPacking, stress: float
) -> xr.Dataset:
    """Return records, averages and cost of one long run."""
    given = parameters_of(
        member, _design_of(design, packing), stress, packing.roughness, seed=packing.seed
    )
    timing = {
        "time_stepping": {"shear_time": design.steady.duration},
        "recording": {"longest_interval": LONGEST_RECORD},
    }
    timed = Parameters.from_mapping(merged(given.model_dump(), timing))
    core = time.process_time()
    try:
        run = hydrodynamics.shear(aged, timed)
    except SoftslipError as error:
        return xr.Dataset({"status": ((), str(error))})
    core = time.process_time() - core
    run = run.assign_attrs(parameters=json.dumps(timed.model_dump(mode="json"), sort_keys=True))
    averages = steady_state(run)
    kept = {name: run[name].drop_vars("wall", errors="ignore") for name in (*RATES, "interval")}
    found = xr.Dataset(kept).drop_vars("wall_distance", errors="ignore")
    for name in RATES:
        found[f"{name}_mean"] = averages[name]
        found[f"{name}_error"] = averages[f"{name}_error"]
    for flag in ("steady_wall", "steady_bulk", "steady_slip"):
        found[flag] = averages[flag].astype(np.int8)
    found["steady_from"] = averages["steady_from"]
    found["cost"] = (
        (),
        core / design.steady.duration,
        attributes("s / time unit", "processor time per simulated time"),
    )
    found["status"] = (), DONE, attributes("1", "done, or why not")
    return found


def _labelled(
    dataset: xr.Dataset,
    design: TradeoffDesign,
    packing: ShearedPacking,
    lengths: tuple[float | None, ...],
) -> xr.Dataset:
    values = [np.nan if length is None else length for length in lengths]
    stress = attributes("stress unit", "imposed stress")
    length = "regularisation length over the paper's mesh size, NaN its mesh's own"
    named = dataset.assign_coords(
        stress=("stress", list(design.steady.stresses), stress),
        regularisation=("regularisation", values, attributes("1", length)),
    )
    return named.assign_attrs(
        case=packing.name, roughness=packing.roughness, seed=packing.seed, periods=packing.periods
    )
