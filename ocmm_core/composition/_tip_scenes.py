"""What the virtual rig shows while a tip is qualified or checked: whatever still lacks."""

from __future__ import annotations

import numpy as np

from ocmm_core.calibration.records import Sphere
from ocmm_core.calibration.tip import POLE, TouchView, frame_about
from ocmm_core.camera import Rig, Vector3
from ocmm_core.geometry import Float
from ocmm_core.simulation.calibration_scenes import TipFault, TouchWithTip

_SPHERE, _CONE = np.array([-40.0, 0.0, -110.0]), np.array([60.0, 20.0, -120.0])
"""From the middle of the volume: the handle is above, and should be in it."""

_ALSO_DEG = (0.0, 180.0, 24.0, 204.0, -24.0, 156.0, 6.0, 186.0, -18.0, 162.0)
"""Round the equator from the right: where one more point helps most."""


def scene_of_tip(
    view: TouchView, sphere: Sphere, rig: Rig, seed: int, fault: TipFault
) -> TouchWithTip:
    """Return the touches that a session still wants, and some more on the equator."""
    frame = frame_about(POLE, rig)
    angles = np.radians(np.array(_ALSO_DEG))[:, None]
    also = np.cos(angles) * frame.right + np.sin(angles) * frame.back
    begun = len(view.sphere.tips_world) + len(view.cone.tips_world)
    places = [place.direction_world for place in view.sphere.places if place.point is None]
    handles = [one.handle_world for one in view.cone.attitudes if one.point is None]
    middle = rig.volume_world.mean(axis=0)
    return TouchWithTip(
        centre=_vector(middle + _SPHERE),
        diameter=sphere.diameter,
        normals=tuple(_vector(one) for one in (*places, *also)),
        cone=_vector(middle + _CONE),
        handles=tuple(_vector(one) for one in handles),
        # A hand never does the same thing twice.
        seed=seed + 100 * begun + len(view.sphere.places),
        fault=fault,
    )


def _vector(values: Float) -> Vector3:
    x, y, z = (float(value) for value in values)
    return x, y, z
