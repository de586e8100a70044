"""Shear runs made up from known rates, slip and times, in the schema of the shear stage."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.random import Generator
from numpy.typing import NDArray
from scipy import optimize

from softslip.analysis.observables.series import interval_means
from softslip.config.parameters import Parameters
from softslip.studies.coverage.made_up_series import red_noise

FloatArray = NDArray[np.float64]

DURATION = 1000.0
"""Length of a run [time unit], as in the paper."""

STEP = 0.05
"""Shortest record [time unit]."""

STRESS = 0.5
"""Imposed stress, or its mean [stress unit]."""

GIVEN = Parameters.from_mapping(
    {
        "channel": {"length": 0.0625, "height": 0.125, "outer_gap": 0.03125},
        "wall": {"roughness": 0.0},
        "suspension": {"mean_radius": 0.0085},
        "solvent": {"viscosity": 1.0},
        "rheometer": {"stress": STRESS},
        "time_stepping": {"shear_time": DURATION},
        "recording": {
            "samples_per_decade": 30,
            "longest_interval": 5.0,
            "profile_interval": 15.0,
        },
    }
)
"""Parameters of all of them: smooth walls at σ = 0.5. Nothing that is used is left to defaults."""

ROWS = 129
"""Heights at which a profile is known."""

CREEP = 0.2
"""Rate of creep at the time of yielding, over the steady rate."""

CREEP_EXPONENT = 0.7
"""Creep falls as t to minus this."""

TYPICAL_RATE, TYPICAL_SLIP = 0.02, 1e-3
"""Bulk shear rate [1 / time unit] and slip velocity [length unit / time unit] that noise is
relative to where there is none."""

JUMP_TIME = 0.3
"""When the elastic response to a stress is fastest [time unit]."""

SWIRL = 0.02
"""Standard deviation of a profile about its mean, over the speed of a wall."""


def recorded_noise(edges: FloatArray, memory: float, random: Generator) -> FloatArray:
    """Return means over records of noise of variance 1 that is correlated as e^(−Δt/memory)."""
    noise = red_noise(round(DURATION / STEP), memory / STEP, random)
    starts = np.round(edges[:-1] / STEP).astype(np.int64)
    return np.asarray(np.add.reduceat(noise, starts) / np.diff(edges) * STEP)


@dataclass(frozen=True)
class RunKind:
    """A kind of run.

    Attributes
    ----------
    words
        What it is, as the document says it.
    rate, slip
        Steady bulk shear rate [1 / time unit] and slip velocity [length unit / time unit].
    onset
        Time at which creep gives way to flow [time unit]: infinite where it never does, 0 where
        it flows from the start.
    slip_onset
        Time of half the steady slip velocity [time unit]; 0 where it is there from the start.
    jump
        Highest slip velocity of the elastic response to a stress that is there at once, over the
        steady one; it is reached at `JUMP_TIME`.
    noise, memory
        Of bulk rate and slip, of which records are means: standard deviation over their values,
        and the time within which the correlation decays by e [time unit].
    imposed_rate
        Whether the rate of the walls is imposed, and the stress fluctuates.
    """

    words: str
    rate: float = TYPICAL_RATE
    slip: float = TYPICAL_SLIP
    onset: float = 40.0
    slip_onset: float = 10.0
    jump: float = 0.0
    noise: float = 0.1
    memory: float = 5.0
    imposed_rate: bool = False

    @property
    def flows(self) -> bool:
        """Whether the bulk has a steady rate other than 0 long before the end."""
        return self.rate != 0 and self.onset < 0.1 * DURATION

    def bulk(self, time: FloatArray) -> FloatArray:
        """Return the bulk shear rate without noise: creep that gives way to flow."""
        if self.onset == 0:
            return np.full_like(time, self.rate)
        at = time / (self.onset if np.isfinite(self.onset) else 1.0)
        creep = CREEP * at**-CREEP_EXPONENT
        if not np.isfinite(self.onset):
            return np.asarray(self.rate * creep)
        flowing = 1 / (1 + at**-4)
        return np.asarray(self.rate * (creep * (1 - flowing) + flowing))

    def risen(self, time: FloatArray) -> FloatArray:
        """Return the slip velocity without noise, over the steady one."""
        onset = 1 / (1 + (self.slip_onset / time) ** 2)
        since = time / JUMP_TIME
        return np.asarray(onset + self.jump * since * np.exp(1 - since))

    @cached_property
    def yielding_time(self) -> float:
        """Time of the least bulk rate [time unit]; NaN where there is none."""
        never = self.onset == 0 or not np.isfinite(self.onset) or self.rate == 0
        if never or self.imposed_rate:
            return float("nan")
        ends = (np.log(0.1 * self.onset), np.log(self.onset))
        least = optimize.minimize_scalar(
            lambda at: float(self.bulk(np.exp([at]))[0]), bounds=ends, method="bounded"
        )
        return float(np.exp(least.x))

    @property
    def truths(self) -> dict[str, float]:
        """The true values of what is measured, not imposed; NaN where there is none."""
        nothing = float("nan")
        stress = STRESS
        rate = self.rate if self.flows or self.rate == 0 else nothing
        film = stress / GIVEN.solvent.viscosity - (rate if np.isfinite(self.onset) else 0.0)
        wall = rate + 2 * self.slip / GIVEN.channel.height
        return {
            **({"shear_stress": stress} if self.imposed_rate else {"shear_rate_wall": wall}),
            "shear_rate_bulk": rate,
            "slip_velocity": self.slip,
            "total_slip_length": self.slip / rate if rate else nothing,
            "newtonian_slip_length": self.slip / film,
            "yielding_time": self.yielding_time,
            "slip_time": self.slip_onset if self.slip > 0 and self.slip_onset else nothing,
        }

    def drawn(self, random: Generator) -> xr.Dataset:
        """Return one such run, as the shear stage would write it."""
        edges = _ends_of_records()
        time = np.asarray(0.5 * (edges[1:] + edges[:-1]))
        rate, slip = self.bulk(time), self.slip * self.risen(time)
        size = rate if self.rate else np.full_like(time, TYPICAL_RATE)
        slip_size = slip if self.slip else TYPICAL_SLIP * self.risen(time)
        rate = rate + self.noise * size * recorded_noise(edges, self.memory, random)
        slip = slip + self.noise * slip_size * recorded_noise(edges, self.memory, random)
        stress = np.full_like(time, STRESS)
        height = GIVEN.channel.height
        wall = rate + 2 * slip / height
        if self.imposed_rate:
            wall = np.full_like(time, self.rate + 2 * self.slip / height)
            rate = wall - 2 * slip / height
            stress = stress * (1 + self.noise * recorded_noise(edges, self.memory, random))
        half = 0.5 * height * wall
        run = xr.Dataset(
            {
                "interval": ("time", np.diff(edges)),
                "shear_rate_wall": ("time", wall),
                "shear_rate_bulk": ("time", rate),
                "slip_velocity": ("time", slip),
                "stress": ("time", stress),
                "wall_velocity": (("time", "wall"), np.stack((-half, half), axis=1)),
            },
            coords={"time": edges[1:]},
            attrs={"run": "made up", "parameters": GIVEN.model_dump_json()},
        )
        return _with_profiles(run, random)


def _ends_of_records() -> FloatArray:
    """Return the ends of records that grow with time until they are as long as the longest."""
    per_decade = GIVEN.recording.samples_per_decade
    last, longest = round(DURATION / STEP), round(GIVEN.recording.longest_interval / STEP)
    grown = np.unique(np.round(10 ** (np.arange(per_decade * np.log10(last)) / per_decade)))
    grown = grown[:-1][np.diff(grown) < longest]
    even = np.arange((grown[-1] // longest + 1) * longest, last + 1, longest)
    return np.asarray(np.concatenate(([0.0], grown, even)) * STEP)


def _with_profiles(run: xr.Dataset, random: Generator) -> xr.Dataset:
    """Return a run with profiles of the two straight pieces that its rates and slip are.

    In the film at a wall, the solvent is sheared at σ/η until it has slipped by V_s against the
    bulk. The flow swirls about that, alike within a particle's diameter.
    """
    height, diameter = GIVEN.channel.height, 2 * GIVEN.suspension.mean_radius
    interval = GIVEN.recording.profile_interval
    edges = np.asarray(interval * np.arange(int(DURATION / interval) + 1), dtype=np.float64)
    names = ("shear_rate_wall", "shear_rate_bulk", "slip_velocity", "stress")
    wall, rate, slip, stress = (interval_means(run, n, edges)[:, None] for n in names)
    distance = np.linspace(0.0, height, ROWS)
    depth = np.minimum(distance, height - distance)
    film, bulk = stress / GIVEN.solvent.viscosity * depth, slip + rate * depth
    gained = np.where((depth == 0) | ((slip > 0) & (film < bulk)), film, bulk)
    half = 0.5 * height * wall
    velocity = np.where(distance < 0.5 * height, gained - half, half - gained)
    knots = np.arange(0.0, height + diameter, diameter)
    swirls = random.standard_normal((len(velocity), len(knots)))
    swirl = np.array([np.interp(distance, knots, each) for each in swirls])
    velocity = velocity + SWIRL * np.abs(half) * swirl
    return run.assign(velocity_profile=(("profile", "wall_distance"), velocity)).assign_coords(
        profile_time=("profile", edges[1:]), wall_distance=("wall_distance", distance)
    )


RUNS: Mapping[str, RunKind] = {
    "flow": RunKind("yields, flows and slips; noise 10 %, memory 5"),
    "noisy flow": RunKind("yields, flows and slips; noise 30 %, memory 20", noise=0.3, memory=20.0),
    "imposed rate": RunKind(
        "yields, flows and slips at imposed rate; noise 10 %, memory 5", imposed_rate=True
    ),
    "no slip": RunKind("yields and flows without slip", slip=0.0),
    "negative slip": RunKind("yields and flows with negative slip", slip=-TYPICAL_SLIP),
    "from the start": RunKind(
        "flows and slips from the start, without yielding", onset=0.0, slip_onset=0.0
    ),
    "late yielding": RunKind("yields at the end of the run", onset=900.0),
    "creep": RunKind("slips, and creeps as t^−0.7 for ever", onset=np.inf),
    "rest": RunKind("slips about a bulk at rest", rate=0.0),
    "scatter": RunKind("flows, with noise of 100 %, memory 50", noise=1.0, memory=50.0),
    "quiet flow": RunKind("yields, flows and slips; noise 3 %, memory 5", noise=0.03),
    "elastic jump": RunKind(
        "yields, flows and slips, after a jump to 0.8 of its slip at once", jump=0.8
    ),
}
"""Kinds of runs by name."""
