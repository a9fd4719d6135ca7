"""Bodies of a probe that can touch a part: stylus and body, by its design or its LEDs."""

from __future__ import annotations

import numpy as np

from ocmm_cad.reach import _tree_kernel as kernel
from ocmm_core.calibration.probe_design import Bar, Panel, ProbeDesign
from ocmm_core.geometry import Float, unit
from ocmm_core.tracking import ProbeBody

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
        foot = led + (offset - led @ face) * face
        rows.append(_bar(foot, led, _POST_MM, _POST_MM, BODY))
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
