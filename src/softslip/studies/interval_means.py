"""Observables along a run, as means over intervals of time."""

import numpy as np

from softslip.config.parameters import Parameters
from softslip.simulation import assembly
from softslip.simulation.observer import Observer
from softslip.solver.geometry import FloatArray, Layout
from softslip.solver.state import State
from softslip.solver.suspension import Evaluation

QUANTITIES = ("shear_rate_wall", "shear_rate_bulk", "slip_velocity", "film_thickness")
"""Observables whose series are compared."""


class IntervalMeans:
    """The observables of `QUANTITIES` along a run, of every few steps.

    Parameters
    ----------
    parameters, layout
        Of the run; its ``recording.stride`` says how many steps apart samples are.
    """

    def __init__(self, parameters: Parameters, layout: Layout) -> None:
        self._observer = Observer(parameters, layout, assembly.mean_flow(parameters))
        self._stride = parameters.recording.stride
        self._times: list[float] = []
        self._samples: list[list[float]] = []

    @property
    def samples(self) -> int:
        """How many samples were taken."""
        return len(self._times)

    def visit(self, state: State, evaluation: Evaluation) -> None:
        """Take note of a state; call with every state of the run in order."""
        if state.step % self._stride == 0:
            self.sample(state, evaluation)

    def sample(self, state: State, evaluation: Evaluation) -> None:
        """Take note of a state unless it is the last that was noted."""
        if self._times[-1:] == [state.time]:
            return
        measured = self._observer.measure(state, evaluation)
        self._times.append(state.time)
        self._samples.append([float(measured[key]) for key in QUANTITIES])

    def means(self, edges: FloatArray) -> dict[str, FloatArray]:
        """Return the means over the intervals between times of the run, by the trapezoidal rule."""
        times, values = np.array(self._times), np.array(self._samples).T
        areas = 0.5 * np.diff(times) * (values[:, 1:] + values[:, :-1])
        integral = np.pad(np.cumsum(areas, axis=1), ((0, 0), (1, 0)))
        return {
            key: np.diff(np.interp(edges, times, row)) / np.diff(edges)
            for key, row in zip(QUANTITIES, integral, strict=True)
        }
