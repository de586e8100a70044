import math

import numpy as np
import pytest
import scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from softslip.solver.geometry import Box, Layout
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.mobility.quadrature import WIDEST, CorrectedQuadrature, missed
from softslip.studies.validation.quadrature_case import Quadrature
from softslip.studies.validation.unbounded import Unbounded

DX = 1 / 8192
VISCOSITY = 1.3
SPREAD = 0.856 * DX
"""Regularisation length of the paper's mesh."""

FILM = 7 * DX
"""Distance between the two membranes."""

FAR_WALLS = np.stack([np.column_stack((np.arange(4) / 4, np.full(4, y))) for y in (-3.0, 3.0)])
"""Walls of a period of 1, for layouts that need some."""


def line_symbol(direction, wavenumber, regularisation):
    """Fourier transform along a straight line of the kernel between points on it, times η.

    (1/2π) ∫ dp e^{-ε²k²} c²/k⁴ with k² = q² + p², c = p for forces along the line and q for
    forces normal to it: by numerical integration.
    """

    def integrand(p):
        squared = wavenumber**2 + p**2
        across = p if direction == "along" else wavenumber
        return math.exp(-(regularisation**2) * squared) * across**2 / squared**2 / math.pi

    end = max(8 / regularisation, wavenumber)
    breaks = sorted({wavenumber, 1 / regularisation} & {*np.clip([0, end], 0, end)} | {wavenumber})
    inner = quad(integrand, 0, end, points=breaks, epsabs=0, epsrel=1e-11, limit=400)[0]
    return inner + quad(integrand, end, np.inf, epsabs=1e-14 * inner)[0]


@pytest.mark.parametrize("ratio", [0.5, 1.7, 3.3, 4.7, 9.4, 40.0])
@pytest.mark.parametrize("direction", ["along", "normal"])
def test_what_is_missed_is_the_rule_less_the_integral(direction, ratio):
    """By Poisson's formula h Σ T(jh) - ∫ T dx = 2 Σ_{m≥1} T̂(2πm/h), each term integrated."""
    regularisation = 0.3
    spacing = ratio * regularisation
    excess = 0.0
    for m in range(1, 400):
        term = 2 * line_symbol(direction, 2 * np.pi * m / spacing, regularisation)
        excess += term
        if term <= 1e-13 * excess:
            break
    found = missed(np.array(spacing), regularisation)[direction == "normal"]
    # The velocity of a node is its force F = f h times (1/4πη) of the sum, that is f/η times the
    # excess. Terms beyond e^{-36} are left out of the sum.
    assert found / (4 * np.pi) * spacing == pytest.approx(excess, rel=1e-9, abs=1e-15)


def test_what_is_missed_is_a_logarithm_where_the_force_is_a_point():
    """Σ 1/m up to m = h/(2πε): the sum's self-term -ln ε then cancels, and ε → 0 is harmless."""
    spacing = 0.7
    fine, finer = (missed(np.array(spacing), spacing / n) for n in (1e4, 1e5))
    # The first mode is at x = 2π/n, where g = 1 - O(x).
    assert np.subtract(finer, fine) == pytest.approx([math.log(10)] * 2, abs=4 * np.pi / 1e4)


class Nothing:
    """A mobility of zero, which leaves the correction alone."""

    def velocities(self, positions, forces):
        return np.zeros_like(positions)

    def velocities_at(self, points, positions, forces):
        return np.full_like(points, 5.0)


def membranes(counts, stretch):
    """Nodes of two ellipses a film apart, and balanced forces, smooth along them."""
    return Quadrature(stretch=stretch).membranes(counts)


def corrected(mobility, nodes, regularisation):
    """The corrected sum of some membranes between two far walls without force."""
    offsets = np.append(0, np.cumsum([len(ring) for ring in nodes])).astype(np.int64)
    spacing = np.array(
        [np.hypot(*(np.roll(ring, -1, axis=0) - ring).T).sum() / len(ring) for ring in nodes]
    )
    layout = Layout(offsets, spacing, FAR_WALLS, float(spacing.mean()))
    return CorrectedQuadrature(mobility, layout, 1.0, regularisation, VISCOSITY)


def with_walls(nodes, forces):
    """Positions and forces of membranes and of the far walls, which exert none."""
    walls = FAR_WALLS.reshape(-1, 2)
    return np.concatenate((*nodes, walls)), np.concatenate((forces, np.zeros_like(walls)))


def errors(spacing, regularisation, stretch):
    """Relative errors at the nodes, plain and corrected, against a plain sum that has converged.

    The reference has nodes so close, h ≤ 1.1 ε, that the plain rule misses e^{-(2π/1.1)²} = 1e-14.
    """
    perimeters = [0.0536, 0.0535]
    counts = [round(length / (spacing * DX)) for length in perimeters]
    stretched = 1.4 * (1 + stretch)  # the widest spacing over the mean, about
    finer = math.ceil(stretched * spacing * DX / (1.1 * regularisation))
    nodes, forces = membranes(counts, stretch)
    fine_nodes, fine_forces = membranes([finer * count for count in counts], stretch)
    here, forces = with_walls(nodes, forces)
    count = sum(counts)
    direct = Unbounded(regularisation, VISCOSITY)
    wanted = direct.velocities_at(here[:count], np.concatenate(fine_nodes), fine_forces)
    found = (
        direct.velocities(here, forces),
        corrected(direct, nodes, regularisation).velocities(here, forces),
    )
    return [np.abs(each[:count] - wanted).max() / np.abs(wanted).max() for each in found]


SPACINGS = (2.84, 4.0, 5.7, 8.0)

SMALL_RADIUS = 0.0075
"""Smallest half-axis of the ellipses, about that of the paper's particles."""


@pytest.mark.parametrize("stretch", [0.0, 0.3])
@pytest.mark.parametrize("spread", [SPREAD, 0.25 * SPREAD])
def test_corrected_velocities_converge_where_plain_ones_do_not(spread, stretch):
    """To (Δs/R)³: forces that change along the membrane, and its curvature, come in at order 3.

    The other membrane, a film d away, adds e^{-2πd/Δs}, 0.4 % of the waves of the shortest
    length at the widest spacing; smooth forces have next to none of those. The design's table
    has 3e-6, 4e-5, 5e-4 and 3e-3 at these spacings; these limits are 5e-5, 2e-4, 6e-4 and 2e-3.
    """
    plain, better = np.transpose([errors(spacing, spread, stretch) for spacing in SPACINGS])
    limits = (np.array(SPACINGS) * DX / SMALL_RADIUS) ** 3
    assert np.all(better <= limits), f"{better} for limits of {limits}"
    assert np.all(better <= 0.04 * plain), f"{better}, {plain} without correction"
    steepness = np.log(better[-1] / better[0]) / np.log(SPACINGS[-1] / SPACINGS[0])
    assert steepness >= 2.7, f"of order {steepness:.1f}"


@pytest.mark.parametrize("ratio", [2.5, 4.7, 40.0])
def test_each_node_gets_what_is_missed_at_its_own_spacing(ratio):
    """Along and normal to the line between its neighbours, half as far apart as they are."""
    nodes, forces = membranes([40, 60], 0.5)
    positions, all_forces = with_walls(nodes, forces)
    mean = np.hypot(*(np.roll(nodes[0], -1, axis=0) - nodes[0]).T).mean()
    regularisation = mean / ratio
    solver = corrected(Nothing(), nodes, regularisation)
    found = solver.velocities(positions, all_forces)[: len(forces)]
    arm = np.concatenate([np.roll(ring, -1, axis=0) - np.roll(ring, 1, axis=0) for ring in nodes])
    spacing = 0.5 * np.hypot(*arm.T)
    assert spacing.max() / spacing.min() > 2, "hardly stretched"
    tangent = arm / (2 * spacing)[:, None]
    along = np.sum(forces * tangent, axis=1)[:, None] * tangent
    sums = missed(spacing, regularisation)
    wanted = -(sums[0][:, None] * along + sums[1][:, None] * (forces - along))
    wanted /= 4 * np.pi * VISCOSITY
    # Cubics over steps of 2 ln 8/512 in the logarithm of the spacing.
    assert found == pytest.approx(wanted, abs=1e-8 * np.abs(wanted).max())


@settings(max_examples=5)
@given(st.integers(0, 2**31))
def test_the_correction_is_symmetric_and_takes_energy_away(seed):
    random = scenes.generator(seed)
    nodes, _ = membranes([30, 41], random.uniform(0, 0.6))
    positions, one = with_walls(nodes, random.standard_normal((71, 2)))
    other = with_walls(nodes, random.standard_normal((71, 2)))[1]
    solver = corrected(Nothing(), nodes, random.uniform(0.1, 3) * DX)
    one_flow, other_flow = (solver.velocities(positions, each)[:71] for each in (one, other))
    there, back = np.vdot(other[:71], one_flow), np.vdot(one[:71], other_flow)
    power = np.vdot(one[:71], one_flow)
    assert power < 0
    assert abs(there - back) <= 1e-14 * abs(power) * math.sqrt(one.size)


@pytest.mark.parametrize("spread", [SPREAD, 0.05 * SPREAD])
@pytest.mark.parametrize("stretch", [0.0, 0.3])
def test_no_balanced_force_gains_energy(spread, stretch):
    """The rule overestimates a zigzag most, and is corrected as for a constant force."""
    nodes, forces = membranes([44, 44], stretch)
    positions, _ = with_walls(nodes, forces)
    solver = corrected(Unbounded(spread, VISCOSITY), nodes, spread)
    size = forces.size
    matrix = np.empty((size, size))
    for column in range(size):
        unit = np.zeros(size)
        unit[column] = 1.0
        everywhere = with_walls(nodes, unit.reshape(-1, 2))[1]
        matrix[:, column] = solver.velocities(positions, everywhere)[: size // 2].ravel()
    balanced = np.eye(size) - np.kron(np.full((size // 2, size // 2), 2 / size), np.eye(2))
    powers = np.linalg.eigvalsh(balanced @ (0.5 * (matrix + matrix.T)) @ balanced)
    # A uniform push inside-out costs nothing: one membrane's pressure moves no incompressible
    # fluid, which leaves zero up to the error of the rule, besides the two unbalanced forces.
    assert powers[0] >= -1e-3 * powers[-1], powers[:6] / powers[-1]
    assert np.abs(matrix - matrix.T).max() <= 1e-12 * np.abs(matrix).max()


@pytest.mark.parametrize("factor", [0.99, 1.01])
@pytest.mark.parametrize("way", ["stretched", "compressed"])
def test_spacings_beyond_the_table_are_not_numbers(way, factor):
    """The node whose neighbours are too far apart, or too close, and no other."""
    nodes, forces = membranes([40, 40], 0.0)
    ring = nodes[0]
    mean = np.mean([np.hypot(*(np.roll(each, -1, axis=0) - each).T).mean() for each in nodes])
    solver = corrected(Nothing(), nodes, SPREAD)
    apart = mean * (WIDEST * factor if way == "stretched" else 1 / (WIDEST * factor))
    arm = ring[11] - ring[9]
    ring[11] = ring[9] + 2 * apart * arm / np.hypot(*arm)
    positions, forces = with_walls(nodes, forces)
    found = solver.velocities(positions, forces)[:80]
    lost = np.flatnonzero(np.isnan(found).any(axis=1)).tolist()
    assert 10 in lost or factor < 1, "no number is missing"
    assert 10 not in lost or factor > 1, "inside the table, and yet no number"
    assert set(lost) <= {10}, f"nodes {lost}"
    positions[30, 1] = np.nan
    broken = np.isnan(solver.velocities(positions, forces)[:80]).all(axis=1)
    assert broken[[29, 31]].all(), "a neighbour that is lost went unseen"


def wall_layout(count, length, height):
    x = (np.arange(count) + 0.3) * length / count
    walls = np.stack([np.column_stack((x, np.full(count, y))) for y in (0.0, height)])
    return Layout(np.array([0]), np.empty(0), walls, length / count)


@pytest.mark.parametrize("shift", [0.0, 0.37])
def test_walls_are_corrected_across_the_period_too(shift):
    """Every node of a flat wall alike, wherever the wall has moved."""
    layout = wall_layout(32, 0.5, 0.4)
    solver = CorrectedQuadrature(Nothing(), layout, 0.5, 0.3 * layout.wall_spacing, VISCOSITY)
    positions = layout.wall_reference.reshape(-1, 2) + np.array([shift, 0.0])
    found = solver.velocities(positions, np.tile([1.0, -2.0], (64, 1)))
    sums = np.array(missed(np.array(layout.wall_spacing), 0.3 * layout.wall_spacing))
    wanted = -sums * (1.0, -2.0) / (4 * np.pi * VISCOSITY)
    assert found == pytest.approx(np.tile(wanted, (64, 1)), rel=1e-9)


@pytest.mark.parametrize("ratio", [9.4, 20.0])
@pytest.mark.parametrize("direction", [0, 1])
def test_a_wave_on_a_wall_is_the_sum_over_modes_of_the_box(direction, ratio):
    """Forces cos(qx) on the nodes: the discrete modes of the box, less the line's at q = 0.

    The rule gives Σ_m Q(q + 2πm/h) with Q the sum over the modes across the box, and the
    correction takes away 2 Σ_{m≥1} T̂(2πm/h) of the infinite line.
    """
    box, count, wave = Box(0.0625, 0.046875, 0.015625), 90, 3
    layout = wall_layout(count, box.length, box.height)
    spacing, q = layout.wall_spacing, 2 * np.pi * wave / box.length
    spread = spacing / ratio
    ewald = EwaldMobility(box, spread, VISCOSITY, 2 * max(spacing, spread))
    solver = CorrectedQuadrature(ewald, layout, box.length, spread, VISCOSITY)
    positions = layout.wall_reference.reshape(-1, 2)
    forces = np.zeros((2 * count, 2))
    forces[:count, direction] = spacing * np.cos(q * positions[:count, 0])
    found = solver.velocities(positions, forces)[:count, direction]
    orders = np.arange(-math.ceil(ratio), math.ceil(ratio) + 1)
    along = (q + 2 * np.pi * orders / spacing)[:, None]
    limit = math.ceil(6 / spread * box.period / (2 * np.pi))
    across = 2 * np.pi * np.arange(-limit, limit + 1) / box.period
    squared = along**2 + across**2
    own = across if direction == 0 else along
    modes = np.exp(-(spread**2) * squared) * own**2 / squared**2 / (VISCOSITY * box.period)
    local = missed(np.array(spacing), spread)[direction] * spacing / (4 * np.pi * VISCOSITY)
    wanted = (modes.sum() - local) * np.cos(q * positions[:count, 0])
    assert local > 0.01 * modes.sum(), "nothing to correct"
    # The stated error of the Ewald sum, of the sum before the correction.
    assert found == pytest.approx(wanted, abs=2e-3 * modes.sum())


def test_points_off_the_membranes_are_left_to_the_plain_sum():
    nodes, forces = membranes([40, 40], 0.0)
    solver = corrected(Nothing(), nodes, SPREAD)
    assert np.all(solver.velocities_at(np.zeros((3, 2)), *with_walls(nodes, forces)) == 5.0)
