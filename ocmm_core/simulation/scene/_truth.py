"""What is truly there on the virtual rig; the measuring side never sees it."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.camera import CameraModel
from ocmm_core.geometry import Float, Int, RigidTransform
from ocmm_core.simulation.scene._artefacts import TrueFeature


@dataclass(frozen=True, slots=True)
class TrueTouch:
    """One touch as it truly happens."""

    feature: str
    """Name of the feature."""
    contact_s: float
    """Bus time at which the ball first meets the surface, s."""
    first_frame: int
    last_frame: int
    """`first_frame`, `last_frame`: Frames in which the ball rests in contact."""
    surface_world: Float
    """(3,), mm: the point that is touched."""
    normal_world: Float
    """(3,), unit: from the material towards the ball."""
    tip_world: Float
    """(3,), mm: ball centre at rest."""


@dataclass(frozen=True, slots=True)
class Truth:
    """Everything that is truly there; the measuring side never sees it."""

    cameras: tuple[CameraModel, ...]
    leds_probe: Float
    tip_probe: Float
    """`leds_probe`, `tip_probe`: (L, 3) and (3,), mm, probe frame."""
    tip_radius: float
    """mm."""
    slots: Int
    """(C, L): the slot in which each camera follows each LED."""
    T_world_from_part: RigidTransform
    """Where the part stands."""
    features_part: dict[str, TrueFeature]
    features_world: dict[str, TrueFeature]
    """`features_part`, `features_world`: The surfaces by name, in both frames."""
    touches: tuple[TrueTouch, ...]
    """In the order of the script; world as it is before any nudge."""
    leds_reference: Float
    reference_slots: Int
    """`leds_reference`, `reference_slots`: (R, 3), mm, reference frame, and (C, R): of the
    reference body; empty without one."""
    T_world_from_reference: RigidTransform | None
    """Where it stands, before any nudge; None without one."""
