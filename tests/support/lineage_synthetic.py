"""Results of a scenario that was never run: made-up shear runs, and all that is made from them."""

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import synthetic
import xarray as xr

from softslip.analysis.figures import draw, save_figure
from softslip.analysis.fits import fit_laws
from softslip.analysis.observables.tables import flow_curve
from softslip.config.parameters import Parameters
from softslip.config.stages import STAGES, stage_ids, stage_parameters
from softslip.files.storage import read_dataset, write_dataset
from softslip.provenance.attribution import Job, parents_of

CODE = "0123456789abcdef"
"""Fingerprint of the code that is said to have made all of it."""


@dataclass
class Results:
    """The results of a scenario in a folder.

    Attributes
    ----------
    folder
        Where they are.
    stresses, roughnesses, seeds
        Values of the axes.
    missing
        Combinations that have no shear run.
    unsteady
        Combinations whose runs are too short to be steady.
    ids
        Identities of each combination's stages.
    curve
        The flow curve.
    """

    folder: Path
    stresses: Sequence[float]
    roughnesses: Sequence[float] = (0.0, 0.59)
    seeds: Sequence[int] = (1,)
    missing: Sequence[tuple[float, float, int]] = ()
    unsteady: Sequence[tuple[float, float, int]] = ()
    ids: dict[tuple[float, float, int], Mapping[str, str]] = field(default_factory=dict)
    curve: xr.Dataset = field(default_factory=xr.Dataset)

    def path(self, stage: str, run: str = "") -> Path:
        """Return where a run's or the scenario's dataset of a stage is."""
        return self.folder / stage / f"{run}.nc" if run else self.folder / f"{stage}.nc"

    def place(self, stage: str, stress: float, roughness: float, seed: int = 1) -> Path:
        """Return where the dataset of a stage of a combination is."""
        return self.path(stage, self.ids[stress, roughness, seed][stage])

    def write(self, dataset: xr.Dataset, path: Path, *parents: Path, **words: Any) -> Path:
        """Write a dataset with the labels of its parents' files and its own."""
        labels = {key: words.pop(key) for key in ("stage", "run")}
        read = [xr.open_dataset(parent) for parent in parents]
        told = Job().labels(read, fingerprint=CODE, **{"core_seconds": 0.0, **words})
        for each in read:
            each.close()
        write_dataset(dataset.assign_attrs(told), path, **labels, title="made up")
        return path

    def run(self, parameters: Parameters, shear: xr.Dataset) -> Mapping[str, str]:
        """Write the stages of a run that are not there yet, and return their identities."""
        ids, before = stage_ids(parameters), []
        for stage in STAGES:
            path = self.path(stage, ids[stage])
            dataset = shear if stage == "shear" else xr.Dataset({"radius": ("particle", [1.0])})
            dataset = dataset.assign_attrs(parameters=stage_parameters(parameters, stage))
            if not path.exists():
                words = {"stage": stage, "run": ids[stage], "seed": parameters.seed}
                self.write(dataset, path, *before, **words, core_seconds=1000.0, restarts=1)
            before = [path]
        return ids

    def make(self) -> "Results":
        """Write everything and return itself."""
        labelled: list[tuple[dict[str, Any], xr.Dataset | None]] = []
        parents = []
        for stress in self.stresses:
            for roughness in self.roughnesses:
                for seed in self.seeds:
                    at = (stress, roughness, seed)
                    labels = {"stress": stress, "roughness": roughness, "seed": seed}
                    given = synthetic.parameters(*at)
                    self.ids[at] = stage_ids(given)
                    if at in self.missing:
                        labelled.append((labels, None))
                        continue
                    duration = 4.0 if at in self.unsteady else 600.0
                    records = synthetic.shear_run(*at, duration=duration, noise=0.02, profiles=5)
                    records = records.assign_attrs(run=self.ids[at]["shear"])
                    self.run(given, records)
                    parents.append(self.place("shear", *at))
                    labelled.append((labels, records))
        axes = {
            "rheometer.stress": self.stresses,
            "wall.roughness": self.roughnesses,
            "seed": self.seeds,
        }
        told = {"parameters": json.dumps({"base": {}, "axes": axes})}
        self.curve = curve = flow_curve(labelled)
        words = {"stage": "flow_curve", "run": "demo"}
        self.write(curve.assign_attrs(told), self.path("flow_curve"), *parents, **words)
        self.fit(curve)
        return self

    def fit(self, curve: xr.Dataset, **changed: Any) -> None:
        """Write the fits of a flow curve, with other values of some of their variables."""
        laws = fit_laws(curve)
        laws = laws.assign({name: laws[name].copy(data=value) for name, value in changed.items()})
        path = self.path("flow_curve")
        self.write(laws, self.path("fits"), path, stage="fits", run="demo")

    def draw(self) -> Path:
        """Draw the flow curves, with the labels that `softslip draw` gives them, and say where."""
        read = [read_dataset(self.path(stage), stage=stage) for stage in ("flow_curve", "fits")]
        labels = {"title": "fig5", "stage": "figure", "run": "demo"}
        path = self.folder / "figures" / "fig5.png"
        save_figure(
            draw("fig5", *read),
            path,
            {**labels, "parameters": {}, "parents": parents_of(read)},
            Job().provenance(read, fingerprint=CODE),
        )
        return path

    def copy(self, folder: Path) -> "Results":
        """Return the same in another folder, to be damaged."""
        shutil.copytree(self.folder, folder)
        return replace(self, folder=folder)


def some(folder: Path) -> Results:
    """Make the results of sixteen runs: one of them is missing, and one is not steady."""
    missing, unsteady = [(0.5, 0.59, 2)], [(0.3, 0.59, 1)]
    stresses = (0.2, 0.3, 0.5, 1.0)
    results = Results(folder, stresses, seeds=(1, 2), missing=missing, unsteady=unsteady).make()
    results.draw()
    return results
