"""Members beside one another: differences, what they are relative to, and the limit."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from softslip.errors import DatasetError
from softslip.solver.films import REFERENCE_MESH_SIZE
from softslip.solver.geometry import FloatArray
from softslip.solver.mobility.grid import regularisation_length
from softslip.studies.tradeoff.extrapolation import Limit, extrapolated
from softslip.studies.tradeoff.long_runs import RATES

SCENE = ("stress", "roughness")
"""Dimensions that tell scenes apart."""

LEAST_SLIP = 0.1
"""Slip velocity over the walls' speed below which its error counts relative to this share of the
speed: the rest is a small difference of large velocities."""


def effective_regularisation(parameters: Mapping[str, Any]) -> float:
    """Return ε over the paper's mesh size, for either mobility; NaN for settings that contradict.

    Parameters
    ----------
    parameters
        The whole tree, as `Parameters.model_dump` gives it.
    """
    hydrodynamics = parameters.get("hydrodynamics")
    if hydrodynamics is None:
        return float("nan")
    cell = 1.0 / hydrodynamics["resolution"] / REFERENCE_MESH_SIZE
    given = hydrodynamics["regularisation"]
    if given is not None:
        return float(given * cell)
    return regularisation_length(cell, hydrodynamics["symbol"])


def root_mean_square(values: FloatArray, axes: int) -> FloatArray:
    """Return the rms over the last axes."""
    return np.asarray(np.sqrt(np.mean(values**2, axis=tuple(range(-axes, 0)))))


class Comparison:
    """All members' records side by side, and how far they are from one another and the limit.

    Parameters
    ----------
    members
        Of `studies.tradeoff.member_dataset.measure_member`.

    Attributes
    ----------
    names, kinds, trees, regularisations
        Of the members: names, kinds, parameters, and regularisation lengths over the paper's mesh
        size.
    records
        Of the records that count, shape (member, quantity, stress, roughness, record).
    finest
        Row of the finest member of the smallest regularisation length.
    magnitude
        Its rms values in each scene, shape (quantity, stress, roughness).
    scale
        What differences are relative to, shape (quantity, stress).
    limit, limit_of_mean
        At no regularisation: of each record, and of the mean of those that all members have.

    Raises
    ------
    DatasetError
        When no finest member ran on all scenes.
    """

    def __init__(self, members: Sequence[xr.Dataset]) -> None:
        self.members = list(members)
        self.names = [member.attrs["member"] for member in members]
        self.kinds = np.array([member.attrs["kind"] for member in members])
        self.trees = [json.loads(member.attrs["parameters"]) for member in members]
        self.regularisations = np.array([effective_regularisation(tree) for tree in self.trees])
        first = members[0]
        self.skipped, self.short = first.attrs["skipped"], first.attrs["short_window"]
        order = (*SCENE, "time")
        # Shape (member, quantity, stress, roughness, record).
        self.records = np.stack(
            [
                [each[name].transpose(*order).values[..., self.skipped :] for name in RATES]
                for each in members
            ]
        )
        self.finest = self._finest()
        self.magnitude = root_mean_square(self.records[self.finest], 1)
        self.scale = self._scale()
        rows = np.flatnonzero(self.kinds == "finest")
        rows = rows[np.isfinite(self.records[rows]).all(axis=(1, 2, 3, 4))]
        self.limit: Limit = extrapolated(self.regularisations[rows], self.records[rows])
        means = self.records[rows][..., : self.common].mean(axis=-1)
        self.limit_of_mean: Limit = extrapolated(self.regularisations[rows], means)

    @property
    def common(self) -> int:
        """Records that every member has."""
        return int(self.short - self.skipped)

    def _finest(self) -> int:
        """Return the row of the finest member of the smallest regularisation length."""
        rows = np.flatnonzero(self.kinds == "finest")
        good = [row for row in rows if np.isfinite(self.records[row]).all()]
        if not good:
            raise DatasetError(
                "no member of kind 'finest' ran on all scenes; nothing to compare with"
            )
        return int(min(good, key=lambda row: float(self.regularisations[row])))

    def _scale(self) -> FloatArray:
        """Return what errors are relative to, shape (quantity, stress)."""
        largest = dict(zip(RATES, self.magnitude.max(axis=-1), strict=True))
        wall = largest["shear_rate_wall"]
        speed = 0.5 * self.trees[self.finest]["channel"]["height"] * wall
        slip = np.maximum(largest["slip_velocity"], LEAST_SLIP * speed)
        return np.stack([slip if name == "slip_velocity" else wall for name in RATES])

    def differences(self, row: int, truth: FloatArray) -> FloatArray:
        """Return relative differences of a member's records, (quantity, stress, roughness, record).

        Those records only that the member and the truth have; NaN in scenes where it stopped.
        """
        count = self.common if self._is_short(row) else self.records.shape[-1]
        apart = self.records[row][..., :count] - truth[..., :count]
        return np.asarray(apart / self.scale[..., None, None])

    def _is_short(self, row: int) -> bool:
        return bool(np.isnan(self.records[row][..., self.common :]).all())

    def against(self, truths: Sequence[FloatArray | None]) -> FloatArray:
        """Return rms differences of all members from a truth each, shape (member, quantity)."""
        return np.stack(
            [
                np.full(len(RATES), np.nan)
                if truth is None
                else root_mean_square(self.differences(row, truth), 3)
                for row, truth in enumerate(truths)
            ]
        )

    def same_truths(self) -> list[FloatArray | None]:
        """Return for each member the finest one of its regularisation length, if there is one."""
        rows = np.flatnonzero(self.kinds == "finest")
        close = [
            [row for row in rows if np.isclose(self.regularisations[row], length, rtol=1e-6)]
            for length in self.regularisations
        ]
        return [self.records[found[0]] if found else None for found in close]

    def regularisation_errors(self) -> FloatArray:
        """Return the errors of the finest member of each one's length, (member, quantity)."""
        truths = self.same_truths()
        return np.stack(
            [
                np.full(len(RATES), np.nan)
                if truth is None
                else root_mean_square((truth - self.limit.value) / self.scale[..., None, None], 3)
                for truth in truths
            ]
        )

    def total_errors(self) -> FloatArray:
        """Return each member's largest error, that of regularisation added to all others."""
        parts = self.regularisation_errors() + self.against(self.same_truths())
        whole = self.against([self.limit.value] * len(self.members))
        alone = np.isnan(self.regularisation_errors())
        return np.asarray(np.where(alone, whole, parts).max(axis=1))

    def level_truths(self) -> list[FloatArray | None]:
        """Return for each variant the level that it varies, if that is a member."""
        return [
            self.records[self.names.index(f"level-{each.attrs['level']}")]
            if kind == "variant" and f"level-{each.attrs['level']}" in self.names
            else None
            for each, kind in zip(self.members, self.kinds, strict=True)
        ]

    def beside(self, kind: str) -> FloatArray:
        """Return the rms difference of the one member of a kind from the finest one."""
        rows = np.flatnonzero(self.kinds == kind)
        if not len(rows):
            return np.full(len(RATES), np.nan)
        return root_mean_square(self.differences(int(rows[0]), self.records[self.finest]), 3)

    def marker_error(self, member: xr.Dataset, name: str) -> float:
        """Return the rms over scenes of the relative error of the markers' values.

        Velocities are relative to their rms value in the scene, positions to the contact range,
        both up to a uniform motion: that of the box's frame depends on the outer gap.
        """
        truth = self.members[self.finest]
        length = self.trees[self.finest]["channel"]["length"]
        contact = self.trees[self.finest]["steric"]["length"]
        squares = []
        for number in np.unique(truth["marker_scene"].values):
            here = truth["marker_scene"].values == number
            known = truth[name].values[here]
            apart = member[name].values[here] - known
            if name == "marker":
                apart[:, 0] -= length * np.round(apart[:, 0] / length)
            apart -= apart.mean(axis=0)
            size = contact**2 if name == "marker" else np.mean(known**2)
            squares.append(float(np.mean(apart**2)) / size)
        return float(np.sqrt(np.mean(squares)))
