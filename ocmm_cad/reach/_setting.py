"""Probe, cameras and placement of the part.

Bodies of a probe that can touch a part are stylus and body, by its design or its LEDs.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ocmm_cad.reach import _tree_kernel as kernel
from ocmm_core.calibration.probe_design import Bar, Panel, ProbeDesign
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, RigidTransform, perpendicular_pair, unit
from ocmm_core.part_model import Placement
from ocmm_core.tracking import ProbeBody, satisfies_rules

STYLUS, BODY, CORE = 0, 1, 2
"""Parts of a probe. The core lies within the body, and is round about the handle."""
_POST_MM = 4.0
"""Radius of an LED's post."""
_THIN = 0.6
"""Minimum radius of a stylus at the ball, relative to the ball's."""
# Default for an unknown design: a slim stylus, and a carrier with its LEDs well inside.
_PLAIN_STYLUS_MM, _PLAIN_ROUND_MM, _PLAIN_HALF_THICK_MM = 7.5, 20.0, 11.0


def solid_of(body: ProbeBody, design: ProbeDesign | None) -> Float:
    """Return the bodies of a probe, (b, `N_COLUMNS`), from the ball's centre, probe frame.

    Without `design` the body is a box about its LEDs, and a cone leads to the ball.
    """
    leds = body.leds_probe - body.tip_probe
    offset = 0.0
    if design is None:
        axis, across, rows = _by_leds(leds, body)
    else:
        axis = design.axis_probe
        across = unit(np.cross(design.soft_probe, axis))
        rows = _by_design(design, axis, across, body.tip_radius)
        offset = next((one.offset_mm for one in design.sections if isinstance(one, Panel)), 0.0)
    face = np.cross(axis, across)
    for led in leds:
        # A post stands on the panel, or leads to the axis without one.
        rows.append(_bar(led + (offset - led @ face) * face, led, _POST_MM, _POST_MM, BODY))
    return np.array(rows)


def frame_of(body: ProbeBody, design: ProbeDesign | None) -> Float:
    """Return the axes of a probe (3, 3), rows: across, viewing direction of its LEDs, handle."""
    leds = body.leds_probe - body.tip_probe
    axis = unit(leds.mean(axis=0)) if design is None else design.axis_probe
    looks = body.led_directions_probe.mean(axis=0)
    looks = unit(looks - (looks @ axis) * axis)
    return np.array([np.cross(looks, axis), looks, axis])


def _by_design(design: ProbeDesign, axis: Float, across: Float, radius: float) -> list[Float]:
    rows = []
    for section in design.sections:
        start, end = section.start_mm * axis, section.end_mm * axis
        if isinstance(section, Bar):
            first, last = (0.5 * size for size in section.diameter_mm)
            if section.start_mm < radius:
                first = min(first, _THIN * radius)
            rows.append(_bar(start, end, first, last, STYLUS))
        else:
            first, last = (0.5 * size for size in section.width_mm)
            half = 0.5 * section.core_mm + section.face_mm
            beside = section.offset_mm * design.soft_probe
            if section.offset_mm and not any(row[kernel.KIND] == kernel.PANEL for row in rows):
                # Bracket from the stylus to an offset panel.
                rows.append(
                    _bar(start + half * axis, start + half * axis + beside, half, half, BODY)
                )
            start, end = start + beside, end + beside
            rows.append(_panel(start, end, across, first, last, half))
            rows.append(_bar(start + half * axis, end - half * axis, half, half, CORE))
    return rows


def _by_leds(leds: Float, body: ProbeBody) -> tuple[Float, Float, list[Float]]:
    across, looks, axis = frame_of(body, None)
    heights, beside = leds @ axis, leds @ across
    low = max(float(heights.min()) - _PLAIN_ROUND_MM, 0.25 * float(heights.min()))
    high = float(heights.max()) + _PLAIN_ROUND_MM
    half = 0.5 * float(np.ptp(beside)) + _PLAIN_ROUND_MM
    middle = (
        0.5 * float(beside.max() + beside.min()) * across + float((leds @ looks).mean()) * looks
    )
    return axis, across, [
        _bar(0.0 * axis, low * axis + middle, _THIN * body.tip_radius, _PLAIN_STYLUS_MM, STYLUS),
        _panel(low * axis + middle, high * axis + middle, across, half, half, _PLAIN_HALF_THICK_MM),
    ]  # fmt: skip


def _bar(start: Float, end: Float, first: float, last: float, part: int) -> Float:
    row = np.zeros(kernel.N_COLUMNS)
    row[kernel.KIND], row[kernel.PART] = kernel.BAR, part
    row[kernel.START : kernel.START + 3], row[kernel.END : kernel.END + 3] = start, end
    row[kernel.AT_START], row[kernel.AT_END] = first, last
    return row


def _panel(
    start: Float, end: Float, across: Float, first: float, last: float, half: float
) -> Float:
    row = _bar(start, end, first, last, BODY)
    row[kernel.KIND] = kernel.PANEL
    row[kernel.ACROSS : kernel.ACROSS + 3] = across
    row[kernel.HALF_THICK] = half
    return row


TILT_DEG = 100.0
"""Maximum usual angle of the handle from upright."""
_TILT_STEP_DEG = 15.0
_ROUND = 12
"""Directions of the handle at each tilt."""
_YAWS_DEG = (0.0, 20.0, -20.0, 40.0, -40.0)
_RULE_MARGIN_DEG = 12.0
"""Identification refuses attitudes within 10 degrees of one excluded by a rule."""
_FROM_THE_FRONT = (0.0, -1.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    body: ProbeBody
    design: ProbeDesign | None = None
    """None if unknown."""
    rig: Rig | None = None
    """The cameras; None to ignore sight."""
    placement: Placement = field(default_factory=Placement)
    ball_mm: float | None = None
    """Diameter of the ball; None for that of the probe."""
    tilt_deg: float = TILT_DEG
    """Largest angle of the handle from upright."""

    @property
    def ball_radius(self) -> float:
        return self.body.tip_radius if self.ball_mm is None else 0.5 * self.ball_mm

    def solid(self) -> Float:
        """Return the bodies of the probe, see `solid_of`."""
        return solid_of(replace(self.body, tip_radius=self.ball_radius), self.design)

    def pose(self, middle_part: Float) -> RigidTransform:
        """Return world from part, for the middle (3,), mm, of the part."""
        middle = np.zeros(3) if self.rig is None else self.rig.volume_world.mean(axis=0)
        return self.placement.pose(middle_part, middle)


def handle_directions(tilt_deg: float, more_world: Float) -> Float:
    """Return directions of the handle (d, 3), world, within the tilt: upright, ``more_world``."""
    tilts = np.radians(np.arange(_TILT_STEP_DEG, tilt_deg + 1e-9, _TILT_STEP_DEG))
    around = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
    grid = np.stack(
        [
            np.sin(tilts)[:, None] * np.cos(around),
            np.sin(tilts)[:, None] * np.sin(around),
            np.broadcast_to(np.cos(tilts)[:, None], (len(tilts), _ROUND)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    more = more_world.reshape(-1, 3)
    more = more[more[:, 2] >= np.cos(np.radians(tilt_deg)) - 1e-9]
    every: Float = np.concatenate([[[0.0, 0.0, 1.0]], grid, more])
    return every


def attitudes(setting: Setting, directions_world: Float, middle_world: Float) -> Float:
    """Return rotations world from probe (d, y, 3, 3): LEDs towards the cameras, and nearby.

    NaN if excluded by a rule of the probe, and all of a direction if its first is.
    `directions_world`: (d, 3), unit, of the handle. `middle_world`: (3,), mm, of the part.
    """
    towards = np.array(_FROM_THE_FRONT)
    if setting.rig is not None:
        centres = np.array([camera.centre_world for camera in setting.rig.cameras])
        towards = unit(centres.mean(axis=0) - middle_world)
    frame = frame_of(setting.body, setting.design)
    turns = np.empty((len(directions_world), len(_YAWS_DEG), 3, 3))
    for row, handle in enumerate(directions_world):
        looks = towards - (towards @ handle) * handle
        size = float(np.linalg.norm(looks))
        looks = looks / size if size > 0.1 else perpendicular_pair(handle)[0]
        for column, yaw in enumerate(np.radians(_YAWS_DEG)):
            turned = np.cos(yaw) * looks + np.sin(yaw) * np.cross(handle, looks)
            world = np.array([np.cross(turned, handle), turned, handle])
            turns[row, column] = world.T @ frame
    margin = np.sin(np.radians(_RULE_MARGIN_DEG))
    allowed = satisfies_rules(setting.body, turns)
    for axis, world in setting.body.rules:
        allowed &= (turns @ axis) @ world > margin
    turns[~allowed] = np.nan
    turns[~allowed[:, 0]] = np.nan
    return turns
