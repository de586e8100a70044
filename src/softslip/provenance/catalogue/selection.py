"""Results of a scenario to ask for: which runs there are, with what parameters, and their data.

    results = softslip.open_results("results/demo")
    smooth = results.query("roughness == 0 and stress > 0.1")
    smooth.table(), smooth.dataset(), smooth.records("3f9a")

The folder is enough: each file says itself what it is of. Only these labels are read until data is
asked for.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr

from softslip.config.fields import all_fields
from softslip.config.parameters import Parameters
from softslip.config.stages import STAGES
from softslip.errors import ConfigError, DatasetError
from softslip.files.storage import read_dataset
from softslip.messages import brief, file_text
from softslip.provenance.attribution import PROVENANCE
from softslip.provenance.catalogue.conditions import MISSING, Condition, parse
from softslip.provenance.catalogue.gathering import check_table, gather_table
from softslip.provenance.catalogue.runs import (
    BY_BEGINNING,
    DONE,
    IDENTITY,
    LAST,
    StoredRun,
    label_paths,
    shared_leaves,
)
from softslip.provenance.trees import nested_tree

KEY_PARAMETERS = ("stress", "imposed_shear_rate", "roughness", "wall_separation", "seed")
"""Labels of parameters that a table shows though they were not swept."""

KEY_PROVENANCE = ("core_seconds", "restarts", "ended", "host", "commit")
"""What a table shows of how runs were made."""


class Results:
    """Runs, all or those that a query has chosen.

    Of the four stages of a run, that of shearing is meant, until a query names ``stage``.

    Parameters
    ----------
    folder
        Of the results.
    every
        Runs of all stages among which is chosen.
    swept
        Labels of the swept parameters and their paths; a path that no run has is that of a
        parameter which only fills in others.
    unreadable
        A sentence for each file that is left out, and why.
    """

    def __init__(
        self,
        folder: Path,
        every: Iterable[StoredRun],
        swept: Mapping[str, str],
        unreadable: Sequence[str] = (),
        *,
        asked: Sequence[str] = (),
        by_stage: bool = False,
    ) -> None:
        self.folder = folder
        self.swept = dict(swept)
        self.unreadable = tuple(unreadable)
        self.asked = tuple(asked)
        self._every = tuple(every)
        self._by_stage = by_stage

    def __iter__(self) -> Iterator[StoredRun]:
        """Yield the chosen runs, in the order of their swept values."""
        return iter(self._chosen)

    def __len__(self) -> int:
        """Return how many runs are chosen."""
        return len(self._chosen)

    def __repr__(self) -> str:
        """Return where they are, how many, and what was asked for."""
        asked = f", {' and '.join(f'({each})' for each in self.asked)}" if self.asked else ""
        return f"<Results of {file_text(self.folder)}: {len(self)} runs{asked}>"

    @cached_property
    def _chosen(self) -> tuple[StoredRun, ...]:
        meant = [each for each in self._every if self._by_stage or each.stage == LAST]

        def order(run: StoredRun) -> tuple[Any, ...]:
            swept = (self.coordinates(run).get(label) for label in self.swept)
            return STAGES.index(run.stage), *(_rank(value) for value in swept), run.run

        return tuple(sorted(meant, key=order))

    def coordinates(self, run: StoredRun) -> dict[str, Any]:
        """Return the values of the swept parameters that a run depends on, by their labels."""
        found = {label: run.parameters.get(path, MISSING) for label, path in self.swept.items()}
        known = {label: value for label, value in found.items() if value is not MISSING}
        return known | {label: run.labels[label] for label in self.swept if label in run.labels}

    @property
    def runs(self) -> pd.DataFrame:
        """The chosen runs as a table, see `table`."""
        return self.table()

    @cached_property
    def names(self) -> tuple[str, ...]:
        """What can be asked for: each is in `query` and a column of `table`."""
        further = {name for run in self._every for name in (*run.provenance, *run.labels)}
        parameters = {*all_fields(Parameters), *label_paths(), *self.swept}
        return tuple(sorted({*IDENTITY, *PROVENANCE, *parameters, *further}))

    def query(self, expression: str) -> "Results":
        """Choose among the runs.

        Parameters
        ----------
        expression
            Such as ``roughness == 0 and stress > 0.1``; `provenance.catalogue.conditions` has the
            grammar and `names` the names: labels of axes, dotted paths of parameters
            (``wall.roughness``), their last part where it is the only one, ``run``, ``stage``,
            ``state`` and what the provenance says. Numbers are compared exactly: what a scenario
            has as 0.59 is equal to 0.59. Digests, runs and dates are equal to what they begin with.
            A run that does not depend on a parameter, as a packing on the stress, is never chosen
            by it.

        Raises
        ------
        ConfigError
            In one sentence, when the expression cannot be read or asks for what is unknown.
        """
        condition = self._parsed(expression)
        return Results(
            self.folder,
            [run for run in self._every if condition.holds(run.values)],
            self.swept,
            self.unreadable,
            asked=(*self.asked, condition.text),
            by_stage=self._by_stage or "stage" in condition.names,
        )

    def _parsed(self, expression: str) -> Condition:
        shared = shared_leaves()
        condition = parse(expression, {*self.names, *shared}, BY_BEGINNING)
        for name in sorted(condition.names - set(self.names)):
            raise ConfigError(
                "query",
                brief(name),
                "is the last part of several parameters",
                f"write one of {', '.join(shared[name])}",
            )
        return condition

    def table(self, columns: Sequence[str] = ()) -> pd.DataFrame:
        """Return the chosen runs as a table with a row each.

        Parameters
        ----------
        columns
            Any of `names`; without any, run, state, the swept values, key parameters that were
            not swept, and some of the provenance. What a run has no value for is empty.

        Raises
        ------
        ConfigError
            When there is no such column.
        """
        rows = self.rows(columns)
        chosen = list(columns) or self._default_columns()
        return pd.DataFrame({name: [row[name] for row in rows] for name in chosen})

    def rows(self, columns: Sequence[str] = ()) -> list[dict[str, Any]]:
        """Return what `table` does, as the values of each run by their names, None for none."""
        for name in columns:
            if name not in self.names:
                near = shared_leaves().get(name) or get_close_matches(name, self.names)
                choice = f"use {', '.join(self.names)}"
                remedy = f"did you mean {', '.join(near)}?" if near else choice
                raise ConfigError("columns", brief(name), "is not the name of one value", remedy)
        chosen = list(columns) or self._default_columns()
        every = ({**run.values, **self.coordinates(run)} for run in self._chosen)
        return [{name: each.get(name) for name in chosen} for each in every]

    def _default_columns(self) -> list[str]:
        known = {
            name for run in self._chosen for name, value in run.values.items() if value is not None
        }
        stage = ["stage"] if self._by_stage else []
        own = ["run", *stage, "state", *self.swept]
        return [*own, *(n for n in (*KEY_PARAMETERS, *KEY_PROVENANCE) if n in known - set(own))]

    def find(self, run: str) -> StoredRun:
        """Return the chosen run whose name begins with some digits.

        Raises
        ------
        ConfigError
            When none or several do.
        """
        found = [each for each in self._chosen if run and each.run.startswith(run)]
        if len(found) != 1:
            limit = f"is the beginning of {len(found)} of the {len(self)} runs"
            raise ConfigError("run", brief(run), limit, "give more digits, or one that .runs lists")
        return found[0]

    def records(self, run: "str | StoredRun") -> xr.Dataset:
        """Return the data of a run, checked as whenever it is read.

        Parameters
        ----------
        run
            Its name or the first digits of it, or the run itself.

        Raises
        ------
        ConfigError
            When there is not one such run.
        DatasetError
            When its file is missing, damaged or of something else.
        """
        one = run if isinstance(run, StoredRun) else self.find(run)
        return read_dataset(one.path, stage=one.stage, run=one.run)

    def dataset(self, table: str = "flow_curve") -> xr.Dataset:
        """Gather the chosen runs along the swept parameters.

        Parameters
        ----------
        table
            ``flow_curve``, ``creep`` or ``profiles``: the function of `analysis.observables` that
            makes it. Combinations of swept values of which no run was chosen are missing in it.

        Raises
        ------
        ConfigError
            When there is no such table, or the runs are of other stages.
        DatasetError
            When no run is done, or a file is damaged.
        """
        return self.gathered(table)[0]

    def gathered(self, table: str = "flow_curve") -> tuple[xr.Dataset, list[xr.Dataset]]:
        """Return what `dataset` does, and the labels of each run that it was made from.

        The labels are datasets without data, as `provenance.attribution.Job.labels` wants them.
        """
        check_table(table)
        for run in self._chosen:
            if run.stage != LAST:
                remedy = f"choose runs of stage {LAST}"
                raise ConfigError("stage", run.stage, f"has no {table}", remedy)
        if not self._chosen:
            raise DatasetError("none of the runs was chosen; ask for less at once")
        return gather_table(
            table,
            (
                (self.coordinates(run), self.records(run) if run.state == DONE else None)
                for run in self._chosen
            ),
        )

    def as_json(self) -> str:
        """Return what the chosen runs have in common and what is swept, as a JSON object."""
        trees = [run.parameters for run in self._chosen]
        first = trees[0] if trees else {}
        shared = {
            path: value
            for path, value in first.items()
            if all(tree.get(path, MISSING) == value for tree in trees)
        }
        axes: dict[str, list[Any]] = {path: [] for path in self.swept.values()}
        for run in self._chosen:
            for label, value in self.coordinates(run).items():
                listed = axes[self.swept[label]]
                if value not in listed:
                    listed.append(value)
        tree = {"base": nested_tree(shared), "axes": axes, "query": list(self.asked)}
        return json.dumps(tree, allow_nan=False)


def _rank(value: Any) -> tuple[int, Any]:
    """Return what values of different kinds can be sorted by."""
    if value is None:
        return 0, 0
    if isinstance(value, int | float):
        return 1, value
    return 2, str(value)
