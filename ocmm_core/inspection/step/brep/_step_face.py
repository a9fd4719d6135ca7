"""A surface of the model in numbers: one face, or the faces of one round surface."""

from __future__ import annotations

import msgspec

Triple = tuple[float, float, float]


LESS = "Export the model without parts and details that nobody measures."
"""What to do where it is too much."""


class StepFace(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A surface of the model: one face, or the faces of one round surface."""

    shape: str
    """Word of `features.shapes.Shape`."""
    point: Triple
    direction: Triple
    across: Triple = (1.0, 0.0, 0.0)
    """`point`, `direction`, `across`: mm and unit: middle of the face, normal out of the material
    or axis, and direction of its length."""
    radius: float = 0.0
    second: float = 0.0
    half_angle: float = 0.0
    """`radius`, `second`, `half_angle`: As in `features.shapes.element`, mm and rad."""
    low: float = 0.0
    high: float = 0.0
    """`low`, `high`: mm: extent along ``direction`` from ``point`` for round faces, along
    ``across`` for planes."""
    width: float = 0.0
    """mm: extent of a plane square to ``across``."""
    inner: bool = False
    """The material is outside."""
