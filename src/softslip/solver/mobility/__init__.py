"""Mobilities: from the forces on the nodes to the velocities of the nodes."""

from typing import Protocol

from softslip.solver.geometry import FloatArray


class Mobility(Protocol):
    """Linear, symmetric map from node forces to node velocities in a periodic box.

    The mean flow over the box is zero, so a net force does not move the fluid as a whole.
    """

    def velocities(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        """Return V(X_i) = Σ_j K(X_i - X_j) F_j.

        Parameters
        ----------
        positions
            Node positions, shape (nodes, 2) [length unit].
        forces
            Force on the fluid at each node, density times Δs, shape (nodes, 2).

        Returns
        -------
        FloatArray
            Velocities, shape (nodes, 2).
        """
        ...

    def velocities_at(
        self, points: FloatArray, positions: FloatArray, forces: FloatArray
    ) -> FloatArray:
        """Return the regularised velocity at any points, shape (points, 2)."""
        ...
