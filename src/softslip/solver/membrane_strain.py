"""The strain of displaced membranes: the tension's staggered difference along closed chains.

Chains are unrolled (`solver.chains.unroll`), with a wrap at both ends; what stands half-way after a
node has the node's index.
"""

from softslip.solver.chains import PADDING
from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray


@compiled
def difference(
    x: FloatArray, weights: tuple[float, float, float], count: int, out: FloatArray
) -> None:
    """Fill D x half-way after each node of an unrolled chain."""
    near, middle, far = weights
    for s in range(count):
        out[s] = near * (x[s + 4] - x[s + 3]) + (
            middle * (x[s + 5] - x[s + 2]) + far * (x[s + 6] - x[s + 1])
        )


@compiled
def wrap(x: FloatArray, count: int) -> None:
    """Fill the wrap of an unrolled chain from its nodes."""
    for k in range(PADDING):
        x[k] = x[k + count]
        x[k + count + PADDING] = x[k + PADDING]


@compiled
def take_transpose(
    x: FloatArray, weights: tuple[float, float, float], scale: float, count: int, out: FloatArray
) -> None:
    """Subtract scale Dᵀ x from a quantity of the nodes; x is unrolled, half-way after the nodes."""
    near, middle, far = weights
    for s in range(count):
        out[s] -= scale * (
            near * (x[s + 2] - x[s + 3])
            + (middle * (x[s + 1] - x[s + 4]) + far * (x[s] - x[s + 5]))
        )


@compiled
def strain_along(
    x: FloatArray,
    y: FloatArray,
    along_x: FloatArray,
    along_y: FloatArray,
    sign: float,
    weights: tuple[float, float, float],
    count: int,
    dx: FloatArray,
    dy: FloatArray,
    strain: FloatArray,
) -> None:
    """Fill the component of D δ along a direction (a_x, sign a_y), twice in a row."""
    difference(x, weights, count, dx)
    difference(y, weights, count, dy)
    for s in range(count):
        strain[s] = along_x[s] * dx[s] + sign * along_y[s] * dy[s]
    for s in range(count):
        strain[s + count] = strain[s]


@compiled
def take_strained(
    answer: FloatArray,
    along_x: FloatArray,
    along_y: FloatArray,
    sign: float,
    weights: tuple[float, float, float],
    shift: float,
    count: int,
    dx: FloatArray,
    dy: FloatArray,
    x: FloatArray,
    y: FloatArray,
) -> None:
    """Subtract g Dᵀ of a quantity along a direction from unrolled displacements."""
    for s in range(count):
        dx[s + PADDING] = along_x[s] * answer[s]
        dy[s + PADDING] = sign * along_y[s] * answer[s]
    wrap(dx, count)
    wrap(dy, count)
    take_transpose(dx, weights, shift, count, x[PADDING:])
    take_transpose(dy, weights, shift, count, y[PADDING:])


@compiled
def convolve(x: FloatArray, kernel: FloatArray, count: int, out: FloatArray) -> None:
    """Fill Σ_d kernel(|d|) x_{s+d} over all nodes; x goes on for a whole period after the first."""
    half = (count - 1) // 2
    for s in range(count):
        out[s] = kernel[0] * x[s]
    # Four distances at a time, so that sums are loaded and stored once for all four.
    fours = half // 4 * 4
    for d in range(1, fours + 1, 4):
        a, b, c, e = kernel[d], kernel[d + 1], kernel[d + 2], kernel[d + 3]
        ahead, behind = x[d : d + count + 3], x[count - d - 3 : 2 * count - d]
        for s in range(count):
            out[s] += (a * (ahead[s] + behind[s + 3]) + b * (ahead[s + 1] + behind[s + 2])) + (
                c * (ahead[s + 2] + behind[s + 1]) + e * (ahead[s + 3] + behind[s])
            )
    for d in range(fours + 1, half + 1):
        weight = kernel[d]
        ahead, behind = x[d : d + count], x[count - d : 2 * count - d]
        for s in range(count):
            out[s] += weight * (ahead[s] + behind[s])
    if count % 2 == 0:
        weight = kernel[count // 2]
        for s in range(count):
            out[s] += weight * x[s + count // 2]
