"""Real fields on a periodic mesh and their Fourier modes, with plans that always give the same."""

import numpy as np
import pyfftw
from numpy.typing import NDArray

from softslip.geometry import FloatArray


class PeriodicTransform:
    """A mesh field, or several, and its modes, in aligned workspaces that transforms reuse.

    Plans are estimated: measured ones (FFTW_MEASURE) differ between processes, and so would the
    rounding of what they compute.

    Attributes
    ----------
    field
        Real values, shape (..., N_x, N_y).
    modes
        Complex modes, shape (..., N_x, N_y // 2 + 1).
    """

    def __init__(self, *shape: int) -> None:
        self.field: FloatArray = pyfftw.zeros_aligned(shape)
        half = (*shape[:-1], shape[-1] // 2 + 1)
        self.modes: NDArray[np.complex128] = pyfftw.zeros_aligned(half, dtype=np.complex128)
        self._forward = pyfftw.FFTW(self.field, self.modes, (-2, -1), flags=("FFTW_ESTIMATE",))
        self._backward = pyfftw.FFTW(
            self.modes,
            self.field,
            (-2, -1),
            direction="FFTW_BACKWARD",
            flags=("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT"),
        )

    def forward(self) -> None:
        """Set the modes to those of the field."""
        self._forward.execute()

    def backward(self) -> None:
        """Set the field to the sum of the modes, without dividing by their number."""
        self._backward.execute()


class PaddedTransform:
    """Two real fields as one complex field on a periodic mesh with margins, and its modes.

    One complex transform costs no more than two real ones and keeps both components of a vector
    together in memory, where spreading and gathering want them.

    Attributes
    ----------
    mesh
        Both components, shape (N_x + margin, N_y + margin, 2); transforms see the first N_x rows
        and N_y columns only.
    modes
        Modes of the first component plus i times the second, shape (N_x, N_y), not contiguous.
    """

    def __init__(self, nx: int, ny: int, margin: int) -> None:
        padded: NDArray[np.complex128] = pyfftw.zeros_aligned(
            (nx + margin, ny + margin), dtype=np.complex128
        )
        self.mesh: FloatArray = padded.view(np.float64).reshape(*padded.shape, 2)
        # Without room after each row, columns of a power of two fall onto each other in the cache.
        self.modes: NDArray[np.complex128] = pyfftw.zeros_aligned(
            (nx, ny + margin), dtype=np.complex128
        )[:, :ny]
        period = padded[:nx, :ny]
        self._forward = pyfftw.FFTW(period, self.modes, (0, 1), flags=("FFTW_ESTIMATE",))
        self._backward = pyfftw.FFTW(
            self.modes,
            period,
            (0, 1),
            direction="FFTW_BACKWARD",
            flags=("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT"),
        )

    def forward(self) -> None:
        """Set the modes to those of the field."""
        self._forward.execute()

    def backward(self) -> None:
        """Set the field to the sum of the modes, without dividing by their number."""
        self._backward.execute()
