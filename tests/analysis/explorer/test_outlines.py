import numpy as np
import shapely
from synthetic import HEIGHT, LENGTH, shear_run

from softslip.analysis.explorer.embedding import restored
from softslip.analysis.explorer.outlines import GRID, TOLERANCE, outlines
from softslip.analysis.observables.contours import contours


def polygons(found):
    corners = restored(found["corners"]).reshape(-1, 2) / found["grid"] - found["origin"]
    return np.split(corners, np.cumsum(restored(found["sizes"]))[:-1])


def test_polygons_follow_the_membranes_and_walls_of_the_last_snapshot():
    run = shear_run(roughness=0.59, snapshots=(1.0, 50.0, 100.0))
    found = outlines(run)
    assert (found["time"], found["length"], found["height"]) == (100.0, LENGTH, HEIGHT)
    particles, walls = contours(run, 2)
    shapes = polygons(found)
    assert len(shapes) == len(particles) + 2
    allowed = HEIGHT * (TOLERANCE + 1 / GRID)
    for nodes, shape in zip([*particles, *walls], shapes, strict=True):
        shift = np.floor(nodes[:, 0].min() / LENGTH) * LENGTH
        closed = nodes is not walls[0] and nodes is not walls[1]
        line = shapely.linearrings(shape) if closed else shapely.linestrings(shape)
        apart = shapely.distance(line, shapely.points(nodes - [shift, 0.0])).max()
        assert apart <= allowed, f"a polygon is {apart} away from its nodes"
        assert 0 <= shape[:, 0].min() < LENGTH


def test_a_run_without_snapshots_has_no_polygons():
    assert outlines(shear_run()) is None
