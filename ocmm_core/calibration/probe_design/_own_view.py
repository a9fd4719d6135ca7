"""LEDs of a probe obstructed by its own body, by its design.

Hidden if any ray of its emission cone meets a section of the body, as the cameras' position is
unknown. Rays are sampled; a section is a trapezium of uniform thickness, or a cone.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.calibration.probe_design._beam import Bar, Section
from ocmm_core.calibration.probe_design._design import ProbeDesign
from ocmm_core.geometry import Float, perpendicular_pair, unit
from ocmm_core.tracking import ProbeBody

_RINGS, _ROUND = 9, 24
"""Rays: rings from the axis of the cone to its rim, and number on each."""
_STEP_MM, _FAR_MM = 1.0, 300.0
"""No body is thinner than a step, or larger than the path."""
_LENS_MM = 1.0
"""An LED is embedded in its carrier: start of the rays above it."""


def leds_behind_body(body: ProbeBody, design: ProbeDesign) -> tuple[int, ...]:
    """Return the LEDs, from 0, with light partly or fully blocked by the body."""
    leds = body.leds_probe - body.tip_probe
    ways = np.arange(_LENS_MM, _FAR_MM, _STEP_MM)
    hidden = []
    for number, (led, looks) in enumerate(zip(leds, body.led_directions_probe, strict=True)):
        rays = _cone(unit(looks), body.emission_half_angle)
        places = led + ways[:, None] * rays[:, None, :]
        if any(_inside(section, design, places.reshape(-1, 3)) for section in design.sections):
            hidden.append(number)
    return tuple(hidden)


def _cone(axis: Float, half: float) -> Float:
    """Return unit vectors (n, 3) of a cone, its axis first."""
    first, second = perpendicular_pair(axis)
    turn = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
    across = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
    rings = [axis[None]]
    for angle in half * np.arange(1, _RINGS + 1) / _RINGS:
        rings.append(np.cos(angle) * axis + np.sin(angle) * across)
    return np.concatenate(rings)


def _inside(section: Section, design: ProbeDesign, places: Float) -> bool:
    """Return whether any of the places (n, 3), from the ball's centre, is in a section."""
    along = places @ design.axis_probe
    soft = places @ design.soft_probe
    across = places @ np.cross(design.soft_probe, design.axis_probe)
    share = (along - section.start_mm) / (section.end_mm - section.start_mm)
    within = (share >= 0.0) & (share <= 1.0)
    if isinstance(section, Bar):
        first, last = section.diameter_mm
        radius = 0.5 * (first + share * (last - first))
        return bool(np.any(within & (np.hypot(soft, across) < radius)))
    first, last = section.width_mm
    half = 0.5 * (first + share * (last - first))
    thick = 0.5 * section.core_mm + section.face_mm
    in_it = (np.abs(across) < half) & (np.abs(soft - section.offset_mm) < thick)
    return bool(np.any(within & in_it))
