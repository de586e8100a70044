"""The discretisation: the Stokes solver with its nodes, and the steps in time."""

from typing import Literal

from softslip.config.fields import quantity
from softslip.config.sections.base import Section


class Hydrodynamics(Section):
    """The Stokes solver and its nodes (Table III)."""

    mobility: Literal["grid", "ewald"] = quantity(
        "grid",
        symbol="K",
        unit="1",
        paper="grid",
        description="'grid' is the paper's immersed-boundary mesh (Eqs. 7-16); 'ewald' is the same "
        "operator as an Ewald sum, which costs less where the mesh is fine.",
    )
    split: float | None = quantity(
        None,
        symbol="a/dx",
        unit="1",
        ge=1,
        le=64,
        description="Split length of the Ewald sum over the mesh size. Numerical: it moves work "
        "between its two parts; null takes the one that costs least.",
    )
    resolution: int = quantity(
        8192,
        symbol="1/dx",
        unit="1 / length unit",
        paper=8192,
        ge=64,
        le=65536,
        description="Mesh points per unit length. 'ewald' has no such mesh, but measures lengths "
        "in its size.",
    )
    regularisation: float | None = quantity(
        None,
        symbol="ε/dx",
        unit="1",
        gt=0,
        le=8,
        description="Regularisation length of 'ewald' over the mesh size: forces act on the fluid "
        "over a few of it; null takes that of the mesh of 'grid', to compare with.",
    )
    quadrature: Literal["plain", "corrected"] = quantity(
        "plain",
        symbol="Σ Δs",
        unit="1",
        paper="plain",
        description="Sum over the nodes of a membrane: 'corrected' adds what the trapezoidal rule "
        "misses of a node's own neighbourhood, so that fewer nodes do ('ewald' only).",
    )
    symbol: Literal["compact", "wide"] = quantity(
        "compact",
        symbol="D²",
        unit="1",
        paper="compact",
        description="Laplacian of the streamfunction equation: 'compact' as Eq. 14 prints it, "
        "'wide' as Eq. 9 squared.",
    )
    node_spacing: float = quantity(
        1.42,
        symbol="α",
        unit="1",
        paper=1.42,
        gt=0,
        le=16,
        description="Distance between boundary nodes over the mesh size.",
    )


class TimeStepping(Section):
    """Integration in time."""

    integrator: Literal["euler", "rkc2", "imex_rkc2"] = quantity(
        "euler",
        symbol="scheme",
        unit="1",
        paper="euler",
        description="'euler' takes explicit steps of one length (Eq. 17); 'rkc2' is Runge-Kutta-"
        "Chebyshev of second order, which chooses its steps from the tolerance; 'imex_rkc2' "
        "treats each membrane's and wall's response to itself implicitly, for less work.",
    )
    step: float = quantity(
        0.002,
        symbol="Δt",
        unit="time unit",
        paper=0.002,
        gt=0,
        description="Time step of 'euler', first step of the others. Records end at multiples "
        "of it.",
    )
    tolerance: float = quantity(
        2e-3,
        symbol="δ/σ_LJ",
        unit="1",
        gt=0,
        le=0.1,
        description="Largest error of any node's position that 'rkc2' and 'imex_rkc2' accept in a "
        "step, over steric.length.",
    )
    longest_step: float = quantity(
        0.2,
        symbol="Δt_max",
        unit="time unit",
        gt=0,
        description="Longest step of 'rkc2' and 'imex_rkc2'.",
    )
    ageing_time: float = quantity(
        50.0,
        symbol="t_w",
        unit="time unit",
        paper=50.0,
        ge=0,
        description="Time at zero stress before the shear starts.",
    )
    shear_time: float = quantity(
        1000.0, symbol="t_max", unit="time unit", gt=0, description="Length of the shear stage."
    )
