"""What all groups of parameters share."""

from pydantic import BaseModel, ConfigDict

REFERENCE_MESH_SIZE = 1.0 / 8192.0
"""Mesh size dx_ref of the paper [length unit]."""

REFERENCE_NODE_SPACING = 1.42 * REFERENCE_MESH_SIZE
"""Spacing Δs_ref of the paper's boundary nodes [length unit], on which K_LJ is defined."""


class Section(BaseModel):
    """A group of parameters: frozen, and strict about what it is given."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)
