"""What acts on the walls: their momentum balance, and what keeps them rigid (Sec. II B 4).

Let f be the mean traction on the upper wall and -f that on the lower wall, each per unit length
along x. The x-averaged momentum balance and the periodicity of the velocity give the uniform
shear stress of the solvent outside the walls from the forces alone,

    τ_out = (1/(L_x L_y)) Σ_s F_x,s y_s = (f H_eff + M)/L_y,

with M the moment of everything but f and H_eff the arm of f. The packing carries f - τ_out.
"""

from dataclasses import dataclass

import numpy as np

from softslip.errors import NumericalError
from softslip.solver.geometry import LOWER, UPPER, Box, FloatArray


def moment(heights: FloatArray, forces_x: FloatArray, length: float) -> float:
    """Return M = (1/L_x) Σ F_x y [stress unit times length unit].

    Parameters
    ----------
    heights, forces_x
        Height and x-force (density times Δs) of each node, shape (nodes,).
    length
        L_x [length unit].
    """
    # Not np.dot: BLAS splits long sums over threads, whose number would change the bits.
    return float(np.einsum("i,i", forces_x, heights)) / length


@dataclass(frozen=True)
class Balance:
    """The momentum balance between the mean wall traction f and the stress σ of the packing.

    Exact for any wall shape and any regularisation. In the paper's periodic box
    σ = f (1 - H_eff/L_y) - M/L_y; where the solvent outside is still it carries nothing, and
    σ = f.

    Attributes
    ----------
    box
        The periodic box.
    arm
        H_eff, the mean height of the upper wall's nodes over that of the lower wall's.
    still
        Whether the solvent outside is still.
    """

    box: Box
    arm: float
    still: bool

    def moment(self, positions: FloatArray, forces: FloatArray) -> float:
        """Return the moment M of forces on all nodes; 0 where it is not needed.

        Still solvent outside carries no stress that M would have to balance.
        """
        return 0.0 if self.still else moment(positions[:, 1], forces[:, 0], self.box.length)

    def traction(self, stress: float, rest: float) -> float:
        """Return f at which the packing carries σ, in closed form; ``rest`` is M."""
        if self.still:
            return stress
        return (stress + rest / self.box.period) / (1 - self.arm / self.box.period)

    def stress(self, traction: float, rest: float) -> float:
        """Return the stress σ that the packing carries under f; ``rest`` is M."""
        if self.still:
            return traction
        return traction * (1 - self.arm / self.box.period) - rest / self.box.period


def unit_drive(wall_nodes: int, length: float) -> FloatArray:
    """Return the x-force on each wall node under f = 1, shape (2, wall_nodes)."""
    drive = np.full((2, wall_nodes), length / wall_nodes)
    drive[LOWER] *= -1
    return drive


def relative_speed(wall_velocity_x: FloatArray) -> float:
    """Return the speed of the upper wall over the lower one, from node velocities (2, nodes)."""
    return float(np.mean(wall_velocity_x[UPPER]) - np.mean(wall_velocity_x[LOWER]))


def tether_rate(wall_velocity: FloatArray, target_x: FloatArray, stiffness: float) -> FloatArray:
    """Return d/dt of the tether tractions, -K_w (V_s - target) (Eq. 25), shape (2, nodes, 2).

    Parameters
    ----------
    wall_velocity
        Velocities of the wall nodes, shape (2, nodes, 2).
    target_x
        Velocity that each wall's nodes are held to along x, shape (2,); across, it is zero. With
        each wall's own mean the tethers keep zero mean and only hold it rigid.
    stiffness
        K_w.
    """
    rate = -stiffness * wall_velocity
    rate[:, :, 0] += stiffness * target_x[:, None]
    return rate


def printed_acceleration(
    wall_speed: FloatArray, mean_velocity: FloatArray, box: Box, viscosity: float, stiffness: float
) -> FloatArray:
    """Return d/dt of the wall speeds as the paper prints it (Eq. 26), shape (2,).

    Eq. 26 and its counterpart hold both walls' speeds only through their sum; each wall takes
    half of it, as the symmetry of the channel wants. A speed that exceeds the fluid's is driven
    further away from it, so that this diverges; it is kept to show so.

    Parameters
    ----------
    wall_speed
        Present speeds along x, lower and upper wall.
    mean_velocity
        Fluid velocity along x averaged over each wall's nodes, shape (2,).
    """
    rate = stiffness * (box.period - box.height) / (2 * viscosity)
    return -rate * (mean_velocity - wall_speed)


def check_traction(traction: float, step: int) -> None:
    """Raise when the control's result is not a number.

    Raises
    ------
    NumericalError
        Naming the step.
    """
    if not np.isfinite(traction):
        raise NumericalError("traction", 0, step, "is not finite; use a smaller time_stepping.step")
