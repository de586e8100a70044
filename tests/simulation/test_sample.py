import pytest

from softslip.config.parameters import Parameters
from softslip.simulation.sample import wall_contour


@pytest.mark.parametrize(("separation", "count"), [(5.0, 20), (5.2, 19), (10.0, 10)])
def test_bumps_are_as_many_as_fit_the_wanted_separation_best(separation: float, count: int) -> None:
    """In a period of 0.5, bumps of radius 0.005."""
    wall = {"roughness": 0.5, "bump_separation": separation}
    rough = Parameters.from_mapping({"wall": wall, "suspension": {"mean_radius": 0.01}})
    contour = wall_contour(rough)
    assert contour.bump_radius == 0.005
    assert contour.bumps == count


def test_a_smooth_wall_has_no_bumps() -> None:
    contour = wall_contour(Parameters())
    assert (contour.bump_radius, contour.bumps) == (0.0, 0)
