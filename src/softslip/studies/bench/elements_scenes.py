"""Scenes with and without their elements, as the benchmark of elements runs them."""

from dataclasses import replace
from typing import Any

import xarray as xr

from softslip.config.parameters import Parameters
from softslip.simulation import assembly
from softslip.simulation.expansion import expand
from softslip.simulation.packing import pack
from softslip.studies import boxes, scenes
from softslip.studies.timing import Tell

ROUGHNESS = 0.59
"""Bump radius of the rough walls over the mean particle radius, as in the paper."""


MARGIN = 3.0
"""Distance from the walls where the bulk begins: small boxes have none of 5 [mean radius]."""

DILUTE = 0.3
"""Area fraction at which particles are apart."""


class Scenes:
    """The scenes that are compared, each as it moves under its own conditions.

    Parameters
    ----------
    particles, fidelity
        N and the level.
    ageing, shearing
        Times at rest and under stress before anything is measured [time unit].

    Attributes
    ----------
    dense
        The scene that all others differ from: N particles between smooth walls under stress.
    """

    def __init__(self, particles: int, fidelity: str, ageing: float, shearing: float) -> None:
        self._particles, self._fidelity = particles, fidelity
        self._ageing, self._shearing = ageing, shearing
        scene, _ = scenes.flowing(particles, fidelity, ageing, shearing)
        self.dense = replace(scene, parameters=self._parameters(recording={"bulk_margin": MARGIN}))

    def motions(self, tell: Tell) -> dict[str, tuple[scenes.Scene, scenes.Scene]]:
        """Return the scenes that move otherwise with an element and without it."""
        tell(f"making scenes of {self._particles} particles at fidelity {self._fidelity}")
        dense = self.dense
        empty, idle, bumps = (
            self._without_particles(rheometer={"stress": stress}, wall={"roughness": roughness})
            for stress, roughness in ((boxes.STRESS, 0.0), (0.0, 0.0), (boxes.STRESS, ROUGHNESS))
        )
        return {
            "particles": (dense, empty),
            "close packing": (dense, self._dilute()),
            "bumps": (self._rough(), dense),
            "bumps, no particles": (bumps, empty),
            "wall drive": (dense, self._at_rest()),
            "wall drive, no particles": (empty, idle),
            "outer gap": (self._wide(), dense),
        }

    def _parameters(self, **groups: Any) -> Parameters:
        return boxes.parameters_of(self._particles, self._fidelity, **groups)

    def _sheared(self, scene: scenes.Scene) -> scenes.Scene:
        """Return a scene when it has moved for a while."""
        return replace(scene, state=scenes.advance(scene, self._shearing).state)

    def _taken_up(self, aged: xr.Dataset, given: Parameters) -> scenes.Scene:
        """Return what aged membranes become when they have moved for a while."""
        displacement = aged["wall_displacement"].values
        return self._sheared(scenes.scene_of(aged, given, displacement))

    def _without_particles(self, **groups: Any) -> scenes.Scene:
        given = self._parameters(suspension={"area_fraction": 0.0}, **groups)
        nothing = expand(pack(given), given).rename(area="reference_area")
        return self._sheared(scenes.scene_of(nothing, given))

    def _dilute(self) -> scenes.Scene:
        """Return fewer particles in the same channel, apart, under the same stress."""
        given = self._parameters(
            suspension={"area_fraction": DILUTE}, recording={"bulk_margin": MARGIN}
        )
        membranes = expand(pack(given), given).rename(area="reference_area")
        return self._sheared(scenes.scene_of(membranes, given))

    def _rough(self) -> scenes.Scene:
        given = self._parameters(
            wall={"roughness": ROUGHNESS}, time_stepping={"ageing_time": self._ageing}
        )
        return self._taken_up(scenes.aged_packing(given), given)

    def _at_rest(self) -> scenes.Scene:
        aged = scenes.aged(self._particles, self._fidelity, self._ageing)
        return self._taken_up(aged, self._parameters(rheometer={"stress": 0.0}))

    def _wide(self) -> scenes.Scene:
        """Return the same nodes at the same instant in the paper's box."""
        wide = self._parameters(gap=boxes.nearest_gap(self.dense.parameters.channel.height))
        stress = wide.rheometer.stress
        suspension = assembly.assemble(wide, self.dense.layout, stress=stress)
        return replace(self.dense, parameters=wide, suspension=suspension)
