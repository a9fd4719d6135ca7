"""True state of the virtual rig, never visible to measuring code."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.camera import CameraModel
from ocmm_core.geometry import Float, Int, RigidTransform
from ocmm_sim.scene._artefacts import TrueFeature


@dataclass(frozen=True, slots=True)
class TrueTouch:
    """True course of one touch."""

    feature: str
    contact_s: float
    """Bus time of the first contact, s."""
    first_frame: int
    last_frame: int
    surface_world: Float
    """(3,), mm: the point that is touched."""
    normal_world: Float
    """(3,), unit: from the material towards the ball."""
    tip_world: Float
    """(3,), mm: ball centre at rest."""


@dataclass(frozen=True, slots=True)
class Truth:
    """True geometry and touches."""

    cameras: tuple[CameraModel, ...]
    leds_probe: Float
    tip_probe: Float
    """`leds_probe`, `tip_probe`: (L, 3) and (3,), mm, probe frame."""
    tip_radius: float
    """mm."""
    slots: Int
    """(C, L): slot of each LED in each camera."""
    T_world_from_part: RigidTransform
    features_part: dict[str, TrueFeature]
    features_world: dict[str, TrueFeature]
    touches: tuple[TrueTouch, ...]
    """In script order; world before any nudge."""
    leds_reference: Float
    reference_slots: Int
    """`leds_reference`, `reference_slots`: (R, 3), mm, reference frame, (C, R); empty without."""
    T_world_from_reference: RigidTransform | None
    """Before any nudge; None without a reference body."""
