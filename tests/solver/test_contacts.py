import numpy as np
import pytest
import scenes
import twins
from hypothesis import given, settings
from hypothesis import strategies as st

from softslip.simulation.assembly import contact_law, contacts_of
from softslip.solver import contacts as module
from softslip.solver import steric
from softslip.solver.contacts import Contacts, NoContacts
from softslip.solver.films import contact_strength
from softslip.solver.geometry import Layout
from softslip.solver.neighbours import find_pairs
from softslip.solver.steric import ContactForces

RANGE = 9 / 8192
seeds = st.integers(0, 2**31)
refinements = pytest.mark.parametrize("refinement", [1, 2, 3])


def parameters(refinement=1, reading="energy", roughness=0.0):
    return scenes.parameters(
        steric={"refinement": refinement, "reading": reading}, wall={"roughness": roughness}
    )


def crowd(given, seed=0):
    """Two membranes that press on each other, on both walls and across the period."""
    shift = scenes.generator(seed).uniform(-0.1, 0.1, 4) * RANGE
    gap = 0.75 * RANGE
    height, length = given.channel.height, given.channel.length
    half = 0.25 * height - 0.75 * gap
    rings = [
        scenes.ellipse((0.3 * RANGE + shift[0], half + gap + shift[1]), (0.028, half), 150),
        scenes.ellipse((0.2 * RANGE + shift[2], height - half - gap + shift[3]), (0.03, half), 155),
        scenes.ellipse((0.5 * length, 0.5 * height), (0.0045, 0.006), 50),
    ]
    layout = scenes.layout_of_rings(rings, given)
    return np.concatenate((*rings, layout.wall_reference.reshape(-1, 2))), layout


class Brute:
    """Contact points by the quintics of the twin, and all their pairs."""

    def __init__(self, given, positions, layout):
        self.length, self.steric = given.channel.length, given.steric
        self.factor, self.chains = given.steric.refinement, layout.chains
        self.body = np.repeat(layout.body, self.factor)
        self.weights = np.repeat(layout.weights, self.factor) / self.factor
        self.walls_from = layout.particles
        self.points = self.refined(positions, self.length)
        self.pairs = twins.close_pairs(
            self.points, self.body, self.walls_from, self.length, self.steric.length
        )

    def refined(self, values, period):
        jumps = [*[0.0] * self.walls_from, period, period]
        ends = zip(self.chains[:-1], self.chains[1:], jumps, strict=True)
        return np.concatenate(
            [twins.refined_chain(values[a:b], jump, self.factor) for a, b, jump in ends]
        )

    def arms(self):
        arm = self.points[self.pairs[1]] - self.points[self.pairs[0]]
        arm[:, 0] = twins.minimum_image(arm[:, 0], self.length)
        return arm

    def energy(self):
        given = self.steric
        law = (given.length, given.energy, given.reading)
        return twins.contact_energy(self.points, self.weights, self.pairs, self.length, *law)

    def closing_rate(self, velocities):
        rates = self.refined(velocities, 0.0)
        approach = -np.sum(self.arms() * (rates[self.pairs[1]] - rates[self.pairs[0]]), axis=1)
        return max((approach / np.sum(self.arms() ** 2, axis=1)).max(), 0.0)


def pushed(given, positions, layout):
    forces = np.zeros_like(positions)
    film = Contacts(contact_law(given), given.channel.length, layout).add_forces(positions, forces)
    return forces, film


@pytest.mark.parametrize("reading", ["energy", "density"])
def test_one_point_a_node_is_the_pair_force_between_nodes(reading):
    given = parameters(1, reading)
    positions, layout = crowd(given)
    forces, film = pushed(given, positions, layout)
    wanted = np.zeros_like(positions)
    pairs = find_pairs(positions, layout.body, layout.particles, given.channel.length, RANGE)
    strength = contact_strength(given.steric.energy, reading)
    law = (given.channel.length, RANGE, strength)
    thinnest = ContactForces(layout.chains, layout.weights, *law).add(positions, pairs, wanted)
    assert np.count_nonzero(wanted) > 50
    # Units of the forces are taken in on the way to the nodes or after it.
    assert forces == pytest.approx(wanted, rel=1e-12, abs=1e-12 * np.abs(wanted).max())
    assert film == pytest.approx(thinnest, rel=1e-14)


@refinements
@pytest.mark.parametrize("reading", ["energy", "density"])
@pytest.mark.parametrize("roughness", [0.0, 0.59])
def test_forces_are_minus_the_gradient_of_the_energy_of_the_points(refinement, reading, roughness):
    """Walls included: they too have points between their nodes, and feel their forces."""
    given = parameters(refinement, reading, roughness)
    positions, layout = crowd(given, refinement)
    forces, _ = pushed(given, positions, layout)
    direction = scenes.generator(1).standard_normal(positions.shape)
    step = 1e-6 * RANGE
    rise = [Brute(given, positions + sign * step * direction, layout).energy() for sign in (1, -1)]
    slope = (rise[0] - rise[1]) / (2 * step)
    size = np.abs(forces * direction).sum()
    assert size > 0
    # Pairs within a step of the range come and go with forces of 1e-6 of the others'; rounding
    # takes 1e-16 of the energy over 1e-6 of the range, in which the energy falls by its all.
    assert abs(slope + np.vdot(forces, direction)) <= 1e-8 * size


@refinements
@given(seed=seeds)
def test_contacts_exert_no_net_force(refinement, seed):
    given = parameters(refinement)
    positions, layout = crowd(given, seed)
    forces, _ = pushed(given, positions, layout)
    total = np.abs(forces.sum(axis=0)).max() / np.abs(forces).sum()
    assert total <= 1e-14 * np.sqrt(forces.size), f"net force {total:.1e}"


@refinements
@given(seed=seeds)
def test_contacts_exert_no_torque(refinement, seed):
    """Two membranes that press on each other far from walls and from the ends of the period."""
    given = parameters(refinement)
    tilt, apart = scenes.generator(seed).uniform((-0.5, 0.7), (0.5, 0.9))
    middle = 0.5 * np.array([given.channel.length, given.channel.height])
    arm = (0.008 + 0.5 * apart * RANGE) * np.array([np.cos(tilt), np.sin(tilt)])
    rings = [scenes.ellipse(middle + side * arm, (0.008, 0.011), 150, tilt) for side in (-1, 1)]
    layout = scenes.layout_of_rings(rings, given)
    positions = np.concatenate((*rings, layout.wall_reference.reshape(-1, 2)))
    forces, film = pushed(given, positions, layout)
    assert film < RANGE
    arms = positions - middle
    torque = arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]
    # Small beside the moments of the forces on one of the two, which cancel those on the other.
    error = abs(torque.sum()) / np.sum(np.abs(arms[:, :1] * forces) + np.abs(arms[:, 1:] * forces))
    assert error <= 1e-14, f"torque {error:.1e}"


@refinements
def test_the_film_is_the_smallest_distance_between_points(refinement):
    given = parameters(refinement)
    positions, layout = crowd(given)
    brute = Brute(given, positions, layout)
    _, film = pushed(given, positions, layout)
    assert film == pytest.approx(np.hypot(*brute.arms().T).min(), rel=1e-12)
    alone = positions.copy()
    alone[: layout.offsets[1], 1] += 5.0
    alone[layout.offsets[1] : layout.offsets[2], 1] += 8.0
    assert pushed(given, alone, layout)[1] == np.inf


@pytest.mark.parametrize("refinement", [2, 3])
def test_points_between_nodes_feel_a_film_that_nodes_do_not(refinement):
    """Nodes staggered by half a spacing are a half spacing farther apart than their membranes."""
    given = parameters(refinement)
    positions, layout = crowd(given)
    assert pushed(given, positions, layout)[1] < pushed(parameters(1), positions, layout)[1]


@refinements
def test_forces_are_added_to_what_is_there(refinement):
    given = parameters(refinement)
    positions, layout = crowd(given)
    alone, _ = pushed(given, positions, layout)
    there = scenes.generator(2).standard_normal(positions.shape) * np.abs(alone).max()
    both = there.copy()
    Contacts(contact_law(given), given.channel.length, layout).add_forces(positions, both)
    assert both - there == pytest.approx(alone, abs=1e-15 * np.abs(both).max() * 100)


@refinements
def test_forces_depend_on_the_positions_alone(refinement):
    """Not on where the list of pairs was made: the same bytes whatever came before."""
    given = parameters(refinement)
    positions, layout = crowd(given)
    contacts, wanted = (
        Contacts(contact_law(given), given.channel.length, layout),
        pushed(given, positions, layout),
    )
    for seed in range(4):
        kick = (0.05, 0.3, 1.0, 5.0)[seed] * RANGE
        moved = positions + scenes.generator(seed).uniform(-kick, kick, 2)
        moved[: layout.offsets[1]] += 0.5 * kick
        contacts.add_forces(moved, np.zeros_like(moved))
        contacts.closing_rate(moved, moved)
        forces = np.zeros_like(positions)
        film = contacts.add_forces(positions, forces)
        assert (forces.tobytes(), film) == (wanted[0].tobytes(), wanted[1])


def triangles(length, tip):
    """Two particles of which only the first nodes, a given arm apart, are within the range."""
    far = 6 * RANGE
    one = np.array([[0.0, 0.0], [-far, far], [-far, -far]])
    two = tip + np.array([[0.0, 0.0], [far, -far], [far, far]])
    walls = np.stack([np.column_stack((np.arange(4) * length / 4, np.full(4, y))) for y in (0, 1)])
    layout = Layout(np.array([0, 3, 6]), np.full(2, 1e-3), walls, 0.25 * length)
    middle = np.array([0.0, 0.5])
    return np.concatenate((one + middle, two + middle, *walls)), layout


@pytest.mark.parametrize("place", [0.02, -1e-9, 0.0625 - 0.5 * RANGE])
def test_closing_rate_of_one_pair(place):
    """-d(ln r)/dt = -r·v/r²: here r = (0.6, 0.64) σ, of squared length 0.7696 σ²."""
    given = parameters()
    length = given.channel.length
    arm = np.array([0.6, 0.64]) * RANGE
    positions, layout = triangles(length, arm)
    positions[:6, 0] += place
    contacts, velocities = (
        Contacts(contact_law(given), given.channel.length, layout),
        np.zeros_like(positions),
    )
    velocities[0], velocities[3] = (3 * RANGE, -1 * RANGE), (1 * RANGE, -6 * RANGE)
    velocities[[1, 2, 4, 5]] = 1e3  # of nodes that touch nothing
    wanted = (0.6 * (3 - 1) + 0.64 * (-1 + 6)) / 0.7696
    found = contacts.closing_rate(positions, velocities)
    # The arm is a difference of positions of up to 0.5, which leaves 1e-13 of it.
    assert found == pytest.approx(wanted, rel=1e-12)
    assert contacts.closing_rate(positions, -velocities) == 0.0
    shifted = positions.copy()
    shifted[:3, 0] += length
    assert contacts.closing_rate(shifted, velocities) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize(("apart", "counts"), [(0.999, True), (1.001, False)])
def test_films_beyond_the_range_do_not_count(apart, counts):
    given = parameters()
    positions, layout = triangles(given.channel.length, np.array([apart * RANGE, 0.0]))
    velocities = np.zeros_like(positions)
    velocities[3, 0] = -1.0
    found = Contacts(contact_law(given), given.channel.length, layout).closing_rate(
        positions, velocities
    )
    assert found == (pytest.approx(1 / (apart * RANGE), rel=1e-12) if counts else 0.0)


@refinements
@settings(max_examples=4)  # The twin solves for a quintic at every node.
@given(seed=seeds)
def test_closing_rate_is_its_numpy_twin(refinement, seed):
    given = parameters(refinement)
    positions, layout = crowd(given, seed)
    velocities = scenes.generator(seed, 1).standard_normal(positions.shape)
    wanted = Brute(given, positions, layout).closing_rate(velocities)
    assert wanted > 0
    found = Contacts(contact_law(given), given.channel.length, layout).closing_rate(
        positions, velocities
    )
    assert found == pytest.approx(wanted, rel=1e-11)


@refinements
@given(seed=seeds, speed=st.floats(-10, 10))
def test_closing_rate_does_not_see_a_common_velocity(refinement, seed, speed):
    given = parameters(refinement)
    positions, layout = crowd(given, seed)
    contacts = Contacts(contact_law(given), given.channel.length, layout)
    velocities = scenes.generator(seed, 1).standard_normal(positions.shape)
    still = contacts.closing_rate(positions, velocities)
    common = np.array([speed, -0.5 * speed])
    carried = contacts.closing_rate(positions, velocities + common)
    # Velocities of 10 round by 2e-15, the combinations of six by a few times that, over films
    # of 0.6 of the range at the least.
    assert abs(carried - still) <= 1e-13 / RANGE
    together = contacts.closing_rate(positions, np.full_like(positions, speed))
    assert together <= 1e-13 / RANGE


def apart(given):
    """Two particles far from each other and from the walls."""
    middle = 0.5 * given.channel.height
    rings = [scenes.ellipse((x, middle), (0.008, 0.006), 60) for x in (0.02, 0.05)]
    layout = scenes.layout_of_rings(rings, given)
    return np.concatenate((*rings, layout.wall_reference.reshape(-1, 2))), layout


@refinements
def test_where_nothing_touches_no_point_is_placed_and_no_force_summed(refinement, monkeypatch):
    given = parameters(refinement)
    positions, layout = apart(given)
    contacts = Contacts(contact_law(given), given.channel.length, layout)
    # Searching places the points once; then the empty list holds while they stay apart.
    assert contacts.listed(positions) == 0

    def fail(*_):
        raise AssertionError("superfluous work")

    for place, name in (
        (module, "refine"),
        (module, "carry_back"),
        (steric, "_add_contacts"),
        (steric, "closing_rate"),
    ):
        monkeypatch.setattr(place, name, fail)
    forces = np.zeros_like(positions)
    for shift in (0.0, 0.1 * RANGE, -0.1 * RANGE):
        moved = positions + np.array([0.0, shift])
        assert contacts.add_forces(moved, forces) == np.inf
        assert contacts.closing_rate(moved, -positions) == 0.0
    assert not forces.any()


@refinements
@pytest.mark.parametrize("roughness", [0.0, 0.59])
def test_walls_alone_have_no_contacts_as_a_search_would_find(refinement, roughness):
    given = parameters(refinement, roughness=roughness)
    layout = scenes.layout_of_rings([], given)
    positions = layout.wall_reference.reshape(-1, 2)
    absent, searched = (
        contacts_of(given, layout),
        Contacts(contact_law(given), given.channel.length, layout),
    )
    assert isinstance(absent, NoContacts)
    for contacts in (absent, searched):
        forces = np.zeros_like(positions)
        assert contacts.add_forces(positions, forces) == np.inf
        assert not forces.any()
        assert contacts.closing_rate(positions, positions) == 0.0
        assert contacts.listed(positions) == 0


def test_particles_have_contacts():
    given = parameters()
    positions, layout = crowd(given)
    contacts = contacts_of(given, layout)
    assert type(contacts) is Contacts
    assert contacts.listed(positions) > 50
