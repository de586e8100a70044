"""The accessor ``softslip`` of xarray: what can be asked of the dataset of a run.

It is registered with whatever returns datasets of runs, which must not wait for what draws.
"""

import html
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.config.stages import STAGES
from softslip.errors import DatasetError
from softslip.messages import brief
from softslip.provenance.attribution import read_provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CARD = "<table><caption>{caption}</caption>{rows}</table>"


@xr.register_dataset_accessor("softslip")  # type: ignore[no-untyped-call]
class RunAccessor:
    """Figures and averages of a shear run, as ``run.softslip``.

    Parameters
    ----------
    run
        The dataset that `softslip.shear` returns, or that of any shear run, read from its file.
    """

    def __init__(self, run: xr.Dataset) -> None:
        self._run = run

    @property
    def _sheared(self) -> xr.Dataset:
        """The run.

        Raises
        ------
        DatasetError
            When it is something else.
        """
        stage = self._run.attrs.get("stage")
        if stage != STAGES[-1]:
            raise DatasetError(
                f"stage: {brief(stage)} is not {STAGES[-1]}, whose records these figures show; "
                "give what softslip.shear returns"
            )
        return self._run

    @property
    def parameters(self) -> Parameters:
        """All parameters that the run depends on, by groups: ``parameters.rheometer.stress``."""
        from softslip.analysis.observables import parameters_of

        return parameters_of(self._sheared)

    def averages(self) -> xr.Dataset:
        """Return what the flow curve has of the run: averages with errors, verdicts and times.

        See `analysis.observables.tables.flow_curve`.
        """
        from softslip.analysis.observables.tables import flow_curve

        return flow_curve([({}, self._sheared)])

    def creep(self) -> "Figure":
        """Draw shear rates and slip velocity in time; see `creep_curve`."""
        from softslip.analysis.figures.single_run import creep_curve

        return shown(creep_curve(self._sheared))

    def profile(self) -> "Figure":
        """Draw the mean velocity profile; see `velocity_profile`."""
        from softslip.analysis.figures.single_run import velocity_profile

        return shown(velocity_profile(self._sheared))

    def snapshot(self, time: float | None = None) -> "Figure":
        """Draw particles, walls and non-affine flow at the snapshot nearest to a time.

        Parameters
        ----------
        time
            Since the shear began [time unit]; the last snapshot by default.

        Raises
        ------
        DatasetError
            When the run kept no snapshots: ask for times in ``recording.snapshots``.
        """
        from softslip.analysis.figures.membranes import snapshot

        return shown(snapshot(self._sheared, time=time))

    def __repr__(self) -> str:
        """Return the averages, a line each."""
        return "\n".join([self._title, *(f"{name}: {value}" for name, value in self._lines())])

    def _repr_html_(self) -> str:
        """Return the averages as a table for a notebook."""
        rows = "".join(
            f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>"
            for name, value in self._lines()
        )
        return CARD.format(caption=html.escape(self._title), rows=rows)

    @property
    def _title(self) -> str:
        return f"shear {self._sheared.attrs.get('run', '?')}"

    def _lines(self) -> Iterator[tuple[str, str]]:
        """Yield what the run is, what came of it, and where it is from, in words."""
        from softslip.analysis.observables.steady import FLAGS, VERDICT_NAMES

        run, given = self._sheared, self.parameters
        drive = given.rheometer
        yield "imposed", _drive(drive.stress, drive.shear_rate)
        particles = int(run.attrs.get("particles", 0))
        channel = f"{given.channel.length:g} x {given.channel.height:g} length units"
        yield "channel", f"{channel}, {particles} particles, roughness {given.wall.roughness:g}"
        yield (
            "time",
            f"{float(run['time'][-1]):g} time units, ended by {run.attrs.get('ended_by', '?')}",
        )
        averages = self.averages()
        for name in FLAGS:
            verdict = str(averages[VERDICT_NAMES[name]].item())
            if verdict:
                unit = averages[name].attrs["units"]
                value, error = float(averages[name]), float(averages[f"{name}_error"])
                yield name, f"{value:.4g} ± {error:.2g} {unit} ({verdict})"
        if np.isfinite(float(averages["yielding_time"])):
            yielding = averages["yielding_time"]
            error = float(averages["yielding_time_error"])
            yield "yielding_time", f"{float(yielding):.4g} ± {error:.2g} {yielding.attrs['units']}"
        made = read_provenance(run.attrs)
        yield "made", f"by commit {made.get('commit', '?')}, {made.get('ended', '?')}"


def shown(figure: "Figure") -> "Figure":
    """Return a figure that a notebook shows, where there is one."""
    from softslip.workbench.notebook_figures import show_figures

    show_figures()
    return figure


def _drive(stress: float | None, rate: float | None) -> str:
    return f"stress {stress:g} stress units" if rate is None else f"rate {rate:g} / time unit"
