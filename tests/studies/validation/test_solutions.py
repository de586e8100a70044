import numpy as np
import pytest
from exact_flows import ShearWave, Vortices

from softslip.studies.validation.solutions import CouetteFlow, EnclosedVortices

LENGTH, PERIOD, COUNT = 0.75, 0.5, 128
FLOWS = [
    ShearWave(LENGTH, PERIOD),
    Vortices(LENGTH, PERIOD),
    EnclosedVortices(LENGTH, 0.4 * PERIOD, 1.7),
    EnclosedVortices(LENGTH, PERIOD, 0.3),
]


def mesh():
    x, y = (np.arange(COUNT) / COUNT * side for side in (LENGTH, PERIOD))
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)


def wavenumbers():
    return (
        2 * np.pi * np.fft.fftfreq(COUNT, LENGTH / COUNT)[:, None],
        2 * np.pi * np.fft.fftfreq(COUNT, PERIOD / COUNT)[None, :],
    )


def on_mesh(field):
    return field(mesh().reshape(-1, 2)).reshape(COUNT, COUNT, 2)


@pytest.mark.parametrize("flow", FLOWS)
def test_force_causes_the_velocity(flow):
    """Stokes' equations mode by mode; a gradient drops out."""
    kx, ky = wavenumbers()
    squared = kx**2 + ky**2
    squared[0, 0] = 1.0
    fx, fy = (np.fft.fft2(part) for part in np.moveaxis(on_mesh(flow.force), -1, 0))
    along = (kx * fx + ky * fy) / squared
    modes = ((fx - kx * along) / squared, (fy - ky * along) / squared)
    found = np.stack([np.fft.ifft2(part).real for part in modes], axis=-1) / flow.viscosity
    wanted = on_mesh(flow.velocity)
    # Forces of enclosed vortices end with sin⁵: their modes fall as k⁻⁶, (2/51)⁶ = 4e-9 where 51
    # mesh lines see them, and rough modes move little.
    assert np.abs(found - wanted).max() <= 1e-7 * np.abs(wanted).max()


@pytest.mark.parametrize("flow", FLOWS[2:])
def test_laplacian_is_that_of_the_velocity(flow):
    kx, ky = wavenumbers()
    velocity = np.moveaxis(on_mesh(flow.velocity), -1, 0)
    modes = -(kx**2 + ky**2) * np.fft.fft2(velocity)
    found = np.moveaxis(np.fft.ifft2(modes).real, 0, -1)
    wanted = on_mesh(flow.laplacian)
    assert np.abs(found - wanted).max() <= 1e-5 * np.abs(wanted).max()


def test_enclosed_vortices_do_nothing_outside():
    flow = EnclosedVortices(LENGTH, 0.2)
    outside = np.array([[0.1, 0.2], [0.3, 0.21], [0.5, 0.0], [0.2, 0.5]])
    assert not flow.velocity(outside).any()
    assert not flow.force(outside).any()


def test_couette_flow_is_balanced_by_both_solvents():
    inside = CouetteFlow(0.3, 2.0, 0.4, 0.1, "periodic")
    backwards = inside.viscosity * inside.relative_speed / inside.outer_gap
    assert inside.traction == pytest.approx(inside.stress + backwards)
    assert CouetteFlow(0.3, 2.0, 0.4, 0.1, "still").traction == 0.3
    walls = inside.velocity(np.array([0.0, 0.4]))
    assert walls[1] - walls[0] == pytest.approx(inside.relative_speed)
