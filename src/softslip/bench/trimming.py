"""What is saved by work that the product leaves out, and that the flow stays the same."""

from dataclasses import dataclass

import numpy as np

from softslip import steric
from softslip.chains import carry_back, lagrange_weights, refine
from softslip.geometry import FloatArray, IntArray, Layout
from softslip.neighbours import VerletList, find_pairs, refined_pairs
from softslip.parameters import Parameters

RATES = ("shear_rate_wall", "shear_rate_bulk", "slip_velocity")
"""Observables that no trimming may change."""

MARGIN = 3.0
"""Distance from the walls where the bulk begins: small boxes have none of 5 [mean radius]."""

DURATION = 2.0
"""Time over which costs and rates are taken [time unit]."""

DILUTE = 0.3
"""Area fraction at which particles are apart."""

FINER = 0.25
"""Factor on the tolerance of a step, for the error of the steps."""

SHORTER_SPLIT = 0.8
"""Factor on the split length, for the error of the sums: there may be no room for a longer one."""

FIELDS = 1.0
"""Velocity fields that a run without this trimming would work out [1 / time unit]."""

REPEATS = 3
"""How often a stretch is run: the least time counts, and all else comes out the same."""

BASES = {
    "outer gap": "time step",
    "1D profile": "sampling",
    "2D fields": "sums",
    "contact points": "sums",
    "contact search": "sums",
    "rigid pairs": "sums",
    "shared list": "sums",
}
"""Trimmings, and which error of the estimate stands beside what each changes."""

Rates = dict[str, float]


@dataclass(frozen=True)
class Run:
    """What a stretch of a run took and measured.

    Attributes
    ----------
    core_seconds, steps, evaluations, samples, searches
        Per time unit: time of the processor, steps, evaluations, samples of the observables, and
        searches for contacts.
    rates
        Means of `RATES`.
    """

    core_seconds: float
    steps: float
    evaluations: float
    samples: float
    searches: float
    rates: Rates


@dataclass(frozen=True)
class Row:
    """One trimming: core-seconds per time unit with and without it, and what it changes.

    Attributes
    ----------
    trimmed, untrimmed
        Core-seconds per time unit of the work in question.
    whole
        Core-seconds per time unit of the run that has the trimming.
    change
        Relative change of `RATES` by the trimming.
    error
        Relative error of the estimate of `RATES`, from which a change must not stand out.
    """

    trimmed: float
    untrimmed: float
    whole: float
    change: Rates
    error: Rates

    def figures(self) -> dict[str, float]:
        """Return all figures by name; ``saved`` is the share of the untrimmed run's cost."""
        saved = self.untrimmed - self.trimmed
        return {
            "trimmed_seconds": self.trimmed,
            "untrimmed_seconds": self.untrimmed,
            "saved": saved / (self.whole + saved),
            **{f"{key}_change": value for key, value in self.change.items()},
            **{f"{key}_error": value for key, value in self.error.items()},
        }


class Searching:
    """Contact forces without the trimmings of `Contacts`: points of all bodies, a new search.

    Parameters
    ----------
    parameters, layout
        Of the run.
    keep
        Whether node pairs are listed with a skin and kept, so that only the points remain.
    """

    def __init__(self, parameters: Parameters, layout: Layout, *, keep: bool) -> None:
        given = parameters.steric
        self._layout, self._factor, self._range = layout, given.refinement, given.length
        self._length = parameters.channel.length
        self._strength = steric.contact_strength(given.energy, given.reading)
        self._interpolation = lagrange_weights(given.refinement)
        self._jump = np.zeros(layout.particles + 2)
        self._jump[-2:] = self._length
        self._weights = np.repeat(layout.weights, self._factor) / self._factor
        # A point lies within a node spacing of its node.
        self._reach = given.length + 2 * float(layout.weights.max())
        skin = 0.5 * given.length
        self._list = VerletList(self._length, self._reach, skin) if keep else None

    def node_pairs(self, positions: FloatArray) -> tuple[IntArray, IntArray]:
        """Return the pairs of nodes whose points may touch."""
        layout = self._layout
        if self._list is not None:
            return self._list.pairs(positions, layout.body, layout.particles)
        return find_pairs(positions, layout.body, layout.particles, self._length, self._reach)

    def add_forces(self, positions: FloatArray, forces: FloatArray) -> float:
        """Add the contact forces and return the smallest film; see `Contacts`."""
        layout, every = self._layout, np.ones(self._layout.particles + 2, np.bool_)
        points = np.empty((self._factor * len(positions), 2))
        refine(positions, layout.chains, self._jump, every, self._interpolation, points)
        starts, partners = refined_pairs(
            points,
            positions,
            *self.node_pairs(positions),
            layout.body,
            self._factor,
            self._length,
            self._reach,
            self._range,
        )
        on_points = np.zeros_like(points)
        film = steric.add_contacts(
            points,
            self._weights,
            starts,
            partners,
            self._length,
            self._range,
            self._strength,
            on_points,
        )
        carry_back(on_points, layout.chains, every, self._interpolation, forces)
        return film


class _Counted:
    """A source of node pairs that counts how often it is asked."""

    def __init__(self, solver: EwaldMobility) -> None:
        self._solver = solver
        self.count = 0

    def __call__(self, positions: FloatArray) -> tuple[IntArray, IntArray]:
        self.count += 1
        return self._solver.near_pairs(positions)


class Trimmed:
    """A scene as the product treats it, and pieces to treat it otherwise.

    Parameters
    ----------
    scene
        Of a level; its parameters say where the bulk begins.
    duration
        Time over which it is run [time unit].

    Attributes
    ----------
    scene, evaluation, run
        The scene, its evaluation at its beginning, and what its run took.
    """

    def __init__(self, scene: scenes.Scene, duration: float) -> None:
        self.scene = scene
        self._observer = Observer(scene.parameters, scene.layout, shear.mean_flow(scene.parameters))
        self.evaluation = scene.suspension.evaluate(scene.state)
        self.run = run_of(scene, duration)

    def solver(self, split: float = 1.0, *, rigid: bool = True) -> EwaldMobility:
        """Return the Ewald sum of the scene, if wanted at another split or without rigid walls."""
        parameters = self.scene.parameters
        if rigid and split == 1.0:
            return scenes.plain_sum(parameters, self.scene.layout)
        walls = self.scene.layout.wall_reference.reshape(-1, 2)
        return EwaldMobility(
            self.scene.suspension.box,
            shear.regularisation_of(parameters),
            parameters.solvent.viscosity,
            split * split_length(parameters),
            rigid=walls if rigid else None,
        )

    def measured(self, suspension: Suspension | None = None) -> Rates:
        """Return the rates at the beginning, by other equations of motion if they are given."""
        evaluation = (suspension or self.scene.suspension).evaluate(self.scene.state)
        sample = self._observer.measure(self.scene.state, evaluation)
        return {key: float(sample[key]) for key in RATES}

    def of_profile(self, profile: FloatArray) -> Rates:
        """Return the rates that a mean velocity profile on the observer's heights gives."""
        walls = self.evaluation.wall_velocity
        bulk = self._observer._bulk_flow(profile, walls)
        apart = float(walls[1] - walls[0]) / self.scene.parameters.channel.height
        return {"shear_rate_wall": apart} | {key: float(bulk[key]) for key in RATES[1:]}

    @property
    def heights(self) -> FloatArray:
        """Heights of the profile, shape (heights,) [length unit]."""
        return self._observer.heights

    def sum_error(self) -> Rates:
        """Return how far the rates at the beginning change with the split of the sums."""
        return relative_change(
            self.measured(), self.measured(_assembled(self.scene, self.solver(SHORTER_SPLIT)))
        )


def run_of(scene: scenes.Scene, duration: float) -> Run:
    """Run a scene as its stage would, with its observables, and return what it took."""
    solver = scenes.plain_sum(scene.parameters, scene.layout)
    cores = []
    for _ in range(REPEATS):
        pairs = _Counted(solver)
        series = Series(scene.parameters, scene.layout)
        suspension = _assembled(scene, solver, pairs)
        edges = scene.state.time + np.array([0.0, duration])
        core = time.process_time()
        done = shear.advance(
            suspension, scene.state, edges[1:], scene.parameters, series.visit, _ignore
        )
        cores.append(time.process_time() - core)
    if not pairs.count:
        raise SoftslipError(
            "bench trimming: the near sum does not reach as far as the search for contacts, which "
            "therefore have a list of their own; use another fidelity"
        )
    means = series.means(edges)
    return Run(
        core_seconds=min(cores) / duration,
        steps=(done.state.step - scene.state.step) / duration,
        evaluations=done.evaluations / duration,
        samples=series.samples / duration,
        searches=pairs.count / duration,
        rates={key: float(means[key][0]) for key in RATES},
    )


def _ignore(*_: State | Evaluation | float) -> None:
    """Show nothing."""


def _assembled(
    scene: scenes.Scene, solver: EwaldMobility, pairs: _Counted | None = None
) -> Suspension:
    """Return a scene's equations of motion around a solver whose list the contacts share."""
    return Suspension(
        scene.parameters,
        scene.layout,
        shear.mobility_of(scene.parameters, scene.layout, solver),
        stress=scene.parameters.rheometer.stress,
        near_pairs=(pairs or solver.near_pairs, solver.reach),
    )


def _with_contacts(scene: scenes.Scene, contacts: Contacts | Searching) -> Suspension:
    """Return a scene's equations of motion with other contacts."""
    suspension: Any = _assembled(scene, scenes.plain_sum(scene.parameters, scene.layout))
    suspension._contacts = contacts
    given: Suspension = suspension
    return given


def relative_change(trimmed: Rates, untrimmed: Rates) -> Rates:
    """Return the relative size of what a trimming changes, 0 where nothing does."""
    return {
        key: abs(trimmed[key] - untrimmed[key]) / abs(untrimmed[key])
        if trimmed[key] != untrimmed[key]
        else 0.0
        for key in RATES
    }


def bench_trimming(
    particles: int = 100,
    fidelity: str = "paper",
    *,
    ageing: float = scenes.AGEING,
    shearing: float = scenes.SHEARING,
    duration: float = DURATION,
    budget: float = 2.0,
    tell: Tell = silent,
) -> dict[str, Any]:
    """Measure what each trimming saves of a run, and that it does not change the flow.

    The smaller outer gap changes the motion: both gaps are run over the same stretch from the
    same state, and the error beside the change is that of the time steps, from a run at
    `FINER` times the tolerance. All others are compared at one instant. What the profile changes
    stands beside the error of sampling the two-dimensional field (columns shifted by half their
    distance), the rest beside that of the Ewald sums (another split of them). Trimmings of
    contacts are measured where particles are apart, at the area fraction `DILUTE`. Costs are
    least wall times of the work, or core-seconds of a run, times how often the run does it.

    Parameters
    ----------
    particles
        N at the area fraction of the paper; the dilute scene has the same channel.
    fidelity
        Level.
    ageing, shearing
        Times at rest and under stress before anything is measured [time unit].
    duration
        Of the runs [time unit].
    budget
        Time for the repeats of each comparison [s].
    tell
        Shown the phases.

    Returns
    -------
    dict
        ``core_seconds``, ``steps``, ``evaluations``, ``samples`` and ``searches`` per time unit
        of the run; for each of `BASES` ``trimmed_seconds`` and ``untrimmed_seconds`` per time
        unit, ``saved``, their difference over the cost of the untrimmed run, and the relative
        ``..._change`` of each of `RATES` with its ``..._error``; ``dilute`` with
        ``core_seconds`` and the ``pairs`` of contact points listed there.

    Raises
    ------
    SoftslipError
        When there is no such scene, or a run fails.
    """
    tell(f"making {particles} aged and sheared particles at fidelity {fidelity}")
    dense_scene = _dense_scene(particles, fidelity, ageing, shearing)
    dilute_scene = _dilute_scene(particles, fidelity)
    tell(f"running both scenes for {duration:g} time units")
    dense, dilute = Trimmed(dense_scene, duration), Trimmed(dilute_scene, duration)
    tell("running with the outer gap of the paper")
    rows = {"outer gap": _outer_gap(dense, duration)}
    works: dict[str, Callable[[], Row]] = {
        "1D profile": lambda: _profile(dense, budget),
        "2D fields": lambda: _fields(dense, budget),
        "contact points": lambda: _contacts(dilute, budget, keep=True),
        "contact search": lambda: _contacts(dilute, budget, keep=False),
        "rigid pairs": lambda: _rigid(dense, budget),
        "shared list": lambda: _shared(dense, budget),
    }
    for name, work in works.items():
        tell(f"comparing with and without: {name}")
        rows[name] = work()
    tables = {name: row.figures() for name, row in rows.items()}
    run = dense.run
    listed = _own_contacts(dilute).listed(dilute.evaluation.positions)
    return {
        "bench": "trimming",
        "particles": particles,
        "fidelity": fidelity,
        "errors": "; ".join(f"{name}: {basis}" for name, basis in BASES.items()),
        "core_seconds": run.core_seconds,
        "steps": run.steps,
        "evaluations": run.evaluations,
        "samples": run.samples,
        "searches": run.searches,
        "dilute": {"core_seconds": dilute.run.core_seconds, "pairs": listed},
        **{key: {name: tables[name][key] for name in BASES} for key in tables["outer gap"]},
    }


def _dense_scene(particles: int, fidelity: str, ageing: float, shearing: float) -> scenes.Scene:
    """Return the sheared scene of all benchmarks with a bulk to fit a line to."""
    scene, _ = scenes.flowing(particles, fidelity, ageing, shearing)
    recording = {"bulk_margin": MARGIN}
    return replace(scene, parameters=scenes.parameters_of(particles, fidelity, recording=recording))


def _dilute_scene(particles: int, fidelity: str) -> scenes.Scene:
    """Return fewer particles in the same channel, round and apart, under the same stress."""
    parameters = scenes.parameters_of(
        particles,
        fidelity,
        suspension={"area_fraction": DILUTE},
        recording={"bulk_margin": MARGIN},
    )
    membranes = expand(pack(parameters), parameters)
    return scenes.scene_of(membranes.rename(area="reference_area"), parameters)


def _outer_gap(dense: Trimmed, duration: float) -> Row:
    scene, particles = dense.scene, dense.scene.layout.particles
    given = scene.parameters
    recording = {"bulk_margin": MARGIN}
    wide = scenes.parameters_of(
        particles,
        given.fidelity,
        gap=scenes.nearest_gap(given.channel.height),
        recording=recording,
    )
    fine = scenes.parameters_of(
        particles,
        given.fidelity,
        recording=recording,
        time_stepping={"tolerance": FINER * given.time_stepping.tolerance},
    )
    untrimmed, finer = (run_of(_same_state(scene, each), duration) for each in (wide, fine))
    return Row(
        trimmed=dense.run.core_seconds,
        untrimmed=untrimmed.core_seconds,
        whole=dense.run.core_seconds,
        change=relative_change(dense.run.rates, untrimmed.rates),
        error=relative_change(dense.run.rates, finer.rates),
    )


def _same_state(scene: scenes.Scene, parameters: Parameters) -> scenes.Scene:
    """Return the same nodes at the same instant under other parameters."""
    suspension = shear.assemble(parameters, scene.layout, stress=parameters.rheometer.stress)
    return replace(scene, parameters=parameters, suspension=suspension)


def _profile(dense: Trimmed, budget: float) -> Row:
    scene, evaluation = dense.scene, dense.evaluation
    flow, heights = shear.mean_flow(scene.parameters), dense.heights
    columns = dense.solver().shape[0]

    def along_lines() -> FloatArray:
        density = flow.force_density(evaluation.positions[:, 1], evaluation.forces[:, 0])
        return flow.velocity(density)[: heights.size]

    def over_columns(offset: float = 0.0) -> FloatArray:
        x = (np.arange(columns) + offset) * (scene.parameters.channel.length / columns)
        points = np.stack(np.meshgrid(x, heights), axis=-1).reshape(-1, 2)
        field = scene.suspension.velocities_at(points, evaluation)
        profile: FloatArray = field[:, 0].reshape(heights.size, columns).mean(axis=1)
        return profile

    seconds = alternately({"lines": along_lines, "columns": over_columns}, budget)
    averaged = dense.of_profile(over_columns())
    return Row(
        trimmed=dense.run.samples * seconds["lines"],
        untrimmed=dense.run.samples * seconds["columns"],
        whole=dense.run.core_seconds,
        change=relative_change(dense.of_profile(along_lines()), averaged),
        error=relative_change(dense.of_profile(over_columns(0.5)), averaged),
    )


def _fields(dense: Trimmed, budget: float) -> Row:
    scene = dense.scene
    points = field_points(scene.parameters)
    before = dense.measured()
    seconds = alternately(
        {"field": lambda: scene.suspension.velocities_at(points, dense.evaluation)}, budget
    )
    return Row(
        trimmed=0.0,
        untrimmed=FIELDS * seconds["field"],
        whole=dense.run.core_seconds,
        change=relative_change(before, dense.measured()),
        error=dense.sum_error(),
    )


def field_points(parameters: Parameters) -> FloatArray:
    """Return the points of a kept velocity field, shape (points, 2) [length unit]."""
    channel = parameters.channel
    spacing = parameters.recording.field_spacing * parameters.suspension.mean_radius
    sides = [
        (np.arange(count) + 0.5) * (size / count)
        for size in (channel.length, channel.height)
        for count in [max(round(size / spacing), 1)]
    ]
    return np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)


def _own_contacts(trimmed: Trimmed, solver: EwaldMobility | None = None) -> Contacts:
    """Return the contacts of a scene, on the list of a solver if one is given."""
    shared = (solver.near_pairs, solver.reach) if solver else None
    return Contacts(trimmed.scene.parameters, trimmed.scene.layout, shared)


def _search_seconds(trimmed: Trimmed, budget: float) -> dict[str, float]:
    """Return what a search for contacts takes on the list of the near sum, and without it [s]."""
    positions, solver = trimmed.evaluation.positions, trimmed.solver()
    solver.near_pairs(positions)
    seconds = alternately(
        {
            "none": lambda: _own_contacts(trimmed),
            "shared": lambda: _own_contacts(trimmed, solver).listed(positions),
            "own": lambda: _own_contacts(trimmed).listed(positions),
        },
        budget,
    )
    return {name: seconds[name] - seconds["none"] for name in ("shared", "own")}


def _contacts(dilute: Trimmed, budget: float, *, keep: bool) -> Row:
    scene, run, positions = dilute.scene, dilute.run, dilute.evaluation.positions
    product = _own_contacts(dilute, dilute.solver())
    searching = Searching(scene.parameters, scene.layout, keep=keep)
    forces = np.zeros_like(positions)
    seconds = alternately(
        {
            "trimmed": lambda: product.add_forces(positions, forces),
            "untrimmed": lambda: searching.add_forces(positions, forces),
        },
        budget,
    )
    search = _search_seconds(dilute, budget)
    # Without a kept list every evaluation has already searched.
    listing = run.searches * search["own"] if keep else 0.0
    return Row(
        trimmed=run.evaluations * seconds["trimmed"] + run.searches * search["shared"],
        untrimmed=run.evaluations * seconds["untrimmed"] + listing,
        whole=run.core_seconds,
        change=relative_change(
            dilute.measured(_with_contacts(scene, product)),
            dilute.measured(_with_contacts(scene, searching)),
        ),
        error=dilute.sum_error(),
    )


def _rigid(dense: Trimmed, budget: float) -> Row:
    positions, forces = dense.evaluation.positions, dense.evaluation.forces
    once, every = dense.solver(), dense.solver(rigid=False)
    seconds = alternately(
        {
            "once": lambda: once.velocities(positions, forces),
            "every": lambda: every.velocities(positions, forces),
        },
        budget,
    )
    return Row(
        trimmed=dense.run.evaluations * seconds["once"],
        untrimmed=dense.run.evaluations * seconds["every"],
        whole=dense.run.core_seconds,
        change=relative_change(
            dense.measured(_assembled(dense.scene, once)),
            dense.measured(_assembled(dense.scene, every)),
        ),
        error=dense.sum_error(),
    )


def _shared(dense: Trimmed, budget: float) -> Row:
    seconds = _search_seconds(dense, budget)
    return Row(
        trimmed=dense.run.searches * seconds["shared"],
        untrimmed=dense.run.searches * seconds["own"],
        whole=dense.run.core_seconds,
        change=relative_change(
            dense.measured(_with_contacts(dense.scene, _own_contacts(dense, dense.solver()))),
            dense.measured(_with_contacts(dense.scene, _own_contacts(dense))),
        ),
        error=dense.sum_error(),
    )
