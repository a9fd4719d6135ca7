"""What is truly there on the virtual rig; the measuring side never sees it."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.camera import CameraModel
from ocmm_core.geometry import Float, Int, RigidTransform
from ocmm_core.simulation.scene._artefacts import TrueFeature


@dataclass(frozen=True, slots=True)
class TrueTouch:
    """One touch as it truly happens.

    Attributes
    ----------
    feature
        Name of the feature.
    contact_s
        Bus time at which the ball first meets the surface, s.
    first_frame, last_frame
        Frames in which the ball rests in contact.
    surface_world
        (3,), mm: the point that is touched.
    normal_world
        (3,), unit: from the material towards the ball.
    tip_world
        (3,), mm: ball centre at rest.
    """

    feature: str
    contact_s: float
    first_frame: int
    last_frame: int
    surface_world: Float
    normal_world: Float
    tip_world: Float


@dataclass(frozen=True, slots=True)
class Truth:
    """Everything that is truly there; the measuring side never sees it.

    Attributes
    ----------
    cameras
        As they are.
    leds_probe, tip_probe
        (L, 3) and (3,), mm, probe frame.
    tip_radius
        mm.
    slots
        (C, L): the slot in which each camera follows each LED.
    T_world_from_part
        Where the part stands.
    features_part, features_world
        The surfaces by name, in both frames.
    touches
        In the order of the script; world as it is before any nudge.
    leds_reference, reference_slots
        (R, 3), mm, reference frame, and (C, R): of the reference body; empty without one.
    T_world_from_reference
        Where it stands, before any nudge; None without one.
    """

    cameras: tuple[CameraModel, ...]
    leds_probe: Float
    tip_probe: Float
    tip_radius: float
    slots: Int
    T_world_from_part: RigidTransform
    features_part: dict[str, TrueFeature]
    features_world: dict[str, TrueFeature]
    touches: tuple[TrueTouch, ...]
    leds_reference: Float
    reference_slots: Int
    T_world_from_reference: RigidTransform | None
