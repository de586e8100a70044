"""The flow curve as a rheometer would have measured it, for programs that fit such tables.

One row a point of the flow curve, in the units of a laboratory, without any lines above the names
of the columns: programs that read tables of rheometers take the first line for these. Where the
numbers come from is written beside the table, see `metadata`.
"""

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import pandas as pd
import xarray as xr

from softslip.analysis.fits.likelihood import MOST_FREEDOM
from softslip.analysis.fits.points import DRIVES, with_stress
from softslip.analysis.observables import mean_over_seeds
from softslip.analysis.observables.steady import FLAGS
from softslip.analysis.observables.tables import DONE
from softslip.errors import ConfigError, DatasetError
from softslip.files.quantities import RATE, SPEED, STRESS
from softslip.files.storage import CONTENT_DIGEST, replacing
from softslip.messages import brief, counted
from softslip.provenance.catalogue.conditions import parse
from softslip.provenance.export.csv_file import cells
from softslip.provenance.export.lab_units import LabUnits
from softslip.provenance.export.stress_errors import BULK, carried_errors, with_moderated_errors

RATES = {"bulk": BULK, "wall": "shear_rate_wall"}
"""Shear rates of the flow curve: the true one, and the apparent one of a rheometer with slip."""

LAYOUTS: Mapping[str, Mapping[str, str]] = {
    "plain": {},
    "rheofit": {"shear_rate": "Shear rate / 1/s", "shear_stress": "Stress / Pa"},
}
"""Names of columns where a program asks for others than ours, by what `--layout` calls it: RheoFit
since 1.0 looks for these two. rheology-fit reads ours, and most programs ask for the columns."""

METADATA = "-metadata.json"
"""What the name of the file beside a table ends in, by the standard CSV on the Web."""

WORDS = {"bulk": "shear rate of the bulk", "wall": "apparent shear rate, of the walls"}
"""What these are called in a table's description."""

ROUGHNESS = "roughness"
"""Dimension on which the law of the bulk does not depend."""

_SLIP = ("slip_velocity", "slip_velocity_error")


@dataclass(frozen=True)
class LabColumn:
    """A column of numbers.

    Attributes
    ----------
    name
        In the table.
    unit, meaning
        Its unit in the laboratory and a few words.
    values
        Shape (points,).
    """

    name: str
    unit: str
    meaning: str
    values: Any


@dataclass(frozen=True)
class RheometerTable:
    """A flow curve in the units of a laboratory.

    Attributes
    ----------
    title
        One line.
    sources
        A line for each thing that it was made from.
    columns
        All of one length.
    remarks
        A sentence for each reason for which points are not in it, and on the errors of stresses.
    """

    title: str
    sources: tuple[str, ...]
    columns: tuple[LabColumn, ...]
    remarks: tuple[str, ...]

    def write(self, file: TextIO) -> int:
        """Write the table as CSV; return the number of its rows."""
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([column.name for column in self.columns])
        rows = list(zip(*(cells(np.asarray(each.values)) for each in self.columns), strict=True))
        writer.writerows(rows)
        return len(rows)

    def save(self, path: Path) -> int:
        """Write the table, and beside it what its columns and sources are (`metadata`).

        Raises
        ------
        StorageError
            When it cannot be written.
        """
        beside = path.with_name(f"{path.name}{METADATA}")
        with replacing(beside) as temporary:
            text = json.dumps(self.metadata(path.name), indent=2, ensure_ascii=False)
            temporary.write_text(f"{text}\n", encoding="utf-8")
        with (
            replacing(path) as temporary,
            temporary.open("w", encoding="utf-8", newline="") as file,
        ):
            return self.write(file)

    def metadata(self, name: str) -> dict[str, Any]:
        """Return what is in a table of some name, as CSV on the Web (W3C, 2015) has it."""
        return {
            "@context": "http://www.w3.org/ns/csvw",
            "url": name,
            "dc:title": self.title,
            "dc:source": list(self.sources),
            "dc:description": list(self.remarks),
            "tableSchema": {
                "columns": [
                    {
                        "titles": column.name,
                        "datatype": "string" if _is_text(column.values) else "number",
                        "dc:description": column.meaning,
                        "schema:unitText": column.unit,
                    }
                    for column in self.columns
                ]
            },
        }


def _is_text(values: Any) -> bool:
    return any(isinstance(value, str) for value in np.asarray(values).tolist())


def rheometer_table(
    flow_curve: xr.Dataset,
    measured: Mapping[str, float | None],
    *,
    rate: str = "bulk",
    where: str = "",
    layout: str = "plain",
) -> RheometerTable:
    """Return the points of a flow curve as a rheometer would have measured them.

    Seeds are averaged. Points are left out that are not steady, as no program that fits flow curves
    knows of that, or whose shear rate is not above 0, as they take its logarithm.

    ``shear_stress_std`` is the standard error of the stress: its own where the rate of the walls
    was imposed, together with that of the rate (`carried_errors`). Programs that fit stresses then
    weight points by what is known of them. Errors of rates are those of our own fits: each leans on
    those of the other points, as few seeds make a poor error (`with_moderated_errors`).

    Parameters
    ----------
    flow_curve
        Of a scenario.
    measured
        See `LabUnits.of`.
    rate
        One of `RATES`.
    where
        Condition on the swept parameters, in their units of the model; all points by default. See
        `provenance.catalogue.conditions`.
    layout
        One of `LAYOUTS`.

    Raises
    ------
    ConfigError
        When one of the arguments cannot be used.
    DatasetError
        When no point is left.
    """
    for key, value, choices in (("rate", rate, RATES), ("layout", layout, LAYOUTS)):
        if value not in choices:
            limit, remedy = "does not exist", f"use {' or '.join(choices)}"
            raise ConfigError(key, brief(value), limit, remedy)
    scenario = json.loads(flow_curve.attrs["parameters"])
    units = LabUnits.of(scenario, measured)
    points, remarks = _points(with_stress(mean_over_seeds(flow_curve)), rate, where)
    name = str(flow_curve.attrs.get("run", ""))
    known = ", ".join(f"{key} {value:g}" for key, value in measured.items() if value is not None)
    return RheometerTable(
        title=f"flow curve of {name}, {rate} shear rate",
        sources=(
            f"flow_curve {name} with {CONTENT_DIGEST} {flow_curve.attrs.get(CONTENT_DIGEST, '')}",
            f"units of the model: length {units.length!r} µm, time {units.time!r} s, "
            f"stress {units.stress!r} Pa, from {known} (Pa s, N/m, µm)",
        ),
        columns=tuple(_converted(column, units, LAYOUTS[layout]) for column in points),
        remarks=remarks,
    )


def _converted(column: LabColumn, units: LabUnits, names: Mapping[str, str]) -> LabColumn:
    factor, unit = units.factor(column.unit)
    values = column.values if factor == 1.0 else factor * np.asarray(column.values, dtype=float)
    return LabColumn(names.get(column.name, column.name), unit, column.meaning, values)


def _points(
    curve: xr.Dataset, rate: str, where: str
) -> tuple[tuple[LabColumn, ...], tuple[str, ...]]:
    """Return the columns of all points that are kept, in units of the model, and what is not."""
    name, dims = RATES[rate], [str(dim) for dim in curve["status"].dims]
    others = [dim for dim in dims if dim not in DRIVES]
    if len(others) == len(dims):
        raise DatasetError("the flow curve has a single point; sweep rheometer.stress")
    kept, left_out = _kept(_rows(curve, name, dims), name, where, dims)
    # Of the bulk, errors at all roughnesses are looked at together, as its law is one for them.
    apart = [dim for dim in others if rate == "wall" or dim != ROUGHNESS]
    kept = with_moderated_errors(kept, name, apart)
    curves = [group for _, group in kept.groupby(others, dropna=False)] if others else [kept]
    carried, remark = carried_errors(curve, curves, name)
    kept = pd.concat(curves, ignore_index=True)
    spread = np.hypot(kept["stress_error"].to_numpy(), carried)
    columns = (
        LabColumn("shear_rate", RATE, WORDS[rate], kept[name]),
        LabColumn("shear_stress", STRESS, "shear stress", kept["stress"]),
        LabColumn(
            "shear_stress_std",
            STRESS,
            "standard error of the stress, that of the shear rate included",
            spread,
        ),
        LabColumn(
            "shear_rate_std", RATE, "standard error of the shear rate", kept[f"{name}_error"]
        ),
        LabColumn("slip_velocity", SPEED, "slip velocity", kept["slip_velocity"]),
        LabColumn(
            "slip_velocity_std",
            SPEED,
            "standard error of the slip velocity",
            kept["slip_velocity_error"],
        ),
        *(LabColumn(dim, *_described(curve[dim]), kept[dim]) for dim in others),
    )
    return columns, (*left_out, remark)


def _described(axis: xr.DataArray) -> tuple[str, str]:
    """Return unit and meaning of a swept parameter."""
    return str(axis.attrs.get("units", "1")), str(axis.attrs.get("long_name", ""))


def _rows(curve: xr.Dataset, name: str, dims: Sequence[str]) -> pd.DataFrame:
    """Return a row for each point, sorted along the curves by the stress."""
    if "stress_error" not in curve:
        curve = curve.assign(stress_error=xr.zeros_like(curve[name]))
    if f"{name}_freedom" not in curve:
        curve = curve.assign({f"{name}_freedom": xr.full_like(curve[name], MOST_FREEDOM)})
    own = (name, f"{name}_error", f"{name}_freedom", FLAGS[name])
    needed = [*own, "status", "stress_error", *_SLIP]
    table = curve[needed].to_dataframe().reset_index()
    return table.sort_values([*(dim for dim in dims if dim not in DRIVES), "stress"])


def _kept(
    rows: pd.DataFrame, name: str, where: str, dims: Sequence[str]
) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Return the points that go into a table, and a sentence for each reason for others.

    Raises
    ------
    ConfigError
        When the condition cannot be read.
    DatasetError
        When no point is left.
    """
    if where:
        condition = parse(where, dims)
        rows = rows[[condition.holds(row) for row in rows[list(dims)].to_dict("records")]]
    rows = rows[rows["status"] == DONE]
    flows = (rows[name] > 0) & (rows[f"{name}_error"] >= 0)
    reasons = {
        "not steady": ~rows[FLAGS[name]].astype(bool),
        "no shear rate above 0 with an error": ~flows,
    }
    bad = np.zeros(len(rows), dtype=bool)
    told = []
    for reason, broken in reasons.items():
        new = broken.to_numpy() & ~bad
        if new.any():
            told.append(f"{counted(int(new.sum()), 'point')} left out: {reason}")
        bad |= new
    if bad.all():
        said = f" ({'; '.join(told)})" if told else ""
        raise DatasetError(f"no point of the flow curve is left{said}; choose others with --where")
    return rows[~bad], tuple(told)
