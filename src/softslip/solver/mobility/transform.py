"""Real fields on a periodic mesh and their Fourier modes, with plans that always give the same."""

from typing import Any

import numpy as np
import pyfftw
from numpy.typing import NDArray

from softslip.solver.geometry import FloatArray

ModeArray = NDArray[np.complex128]


class _Planned:
    """Transforms both ways between a field and its modes, over the last two axes of both.

    Plans are estimated: measured ones (FFTW_MEASURE) differ between processes, and so would the
    rounding of what they compute.
    """

    def __init__(self, field: NDArray[Any], modes: ModeArray) -> None:
        self._forward = pyfftw.FFTW(field, modes, (-2, -1), flags=("FFTW_ESTIMATE",))
        self._backward = pyfftw.FFTW(
            modes,
            field,
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


class PeriodicTransform(_Planned):
    """A mesh field, or several, and its modes, in aligned workspaces that transforms reuse.

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
        self.modes: ModeArray = pyfftw.zeros_aligned(half, dtype=np.complex128)
        super().__init__(self.field, self.modes)


class PaddedTransform(_Planned):
    """Two real fields as one complex field on a periodic mesh with margins, and its modes.

    One complex transform costs no more than two real ones and keeps both components of a vector
    together in memory, where spreading and gathering want them.

    Parameters
    ----------
    nx, ny, margin
        Lines of the mesh, and how many more its margins have.
    dtype
        Complex numbers of double or of single precision.

    Attributes
    ----------
    mesh
        Both components, shape (N_x + margin, N_y + margin, 2); transforms see the first N_x rows
        and N_y columns only.
    modes
        Modes of the first component plus i times the second, shape (N_x, N_y), not contiguous.
    """

    def __init__(self, nx: int, ny: int, margin: int, dtype: type = np.complex128) -> None:
        padded: ModeArray = pyfftw.zeros_aligned((nx + margin, ny + margin), dtype=dtype)
        self.mesh: FloatArray = padded.view(padded.real.dtype).reshape(*padded.shape, 2)
        # Without room after each row, columns of a power of two fall onto each other in the cache.
        roomy: ModeArray = pyfftw.zeros_aligned((nx, ny + margin), dtype=dtype)
        self.modes: ModeArray = roomy[:, :ny]
        super().__init__(padded[:nx, :ny], self.modes)
