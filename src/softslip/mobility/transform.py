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
