import numpy as np
import scenes

from softslip.simulation.segments import find_candidates
from softslip.solver.geometry import chain_neighbours


def test_candidates_hold_every_segment_of_another_chain_within_reach():
    """Three rings in contact, one pair of them over the period."""
    length, reach, counts = 1.0, 0.08, [20, 24, 22]
    rings = [
        scenes.ellipse(centre, (radius, radius), count)
        for centre, radius, count in zip(
            [(0.15, 0.4), (0.45, 0.4), (0.86, 0.4)], [0.14, 0.14, 0.13], counts, strict=True
        )
    ]
    position = np.concatenate(rings)
    body = np.repeat(np.arange(3), counts)
    _, following = chain_neighbours(np.append(0, np.cumsum(counts)))
    found = find_candidates(position, body, following, length, reach)
    within = 0
    for i in range(len(position)):
        listed = found.segment[found.starts[i] : found.starts[i + 1]]
        shifts = found.shift[found.starts[i] : found.starts[i + 1]]
        assert listed.tolist() == sorted(set(listed)), f"of node {i}, not ascending"
        for j in np.flatnonzero(body != body[i]):
            u = position[following[j]] - position[j]
            r = position[i] - position[j]
            period = length * np.round(r[0] / length)
            r[0] -= period
            h = np.hypot(*(r - np.clip(r @ u / (u @ u), 0, 1) * u))
            assert h > reach or j in listed, f"segment {j} is {h:.3g} from node {i}, unlisted"
            if j in listed:
                assert shifts[listed == j] == period, f"segment {j} is put elsewhere than node {i}"
            within += h <= reach
    assert within > 10, "hardly any segment is within reach"
