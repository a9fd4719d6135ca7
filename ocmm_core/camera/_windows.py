"""Compiled bookkeeping of the windows: prediction, validation, tracking, release.

A window is placed at the expected position of its LED: the last one plus the motion of one frame.
The window of a hidden LED moves with the others, so that it often meets its LED again; nothing is
reported meanwhile. After a while the slot is released, and the search in `search` refills it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import _centroid as centroid
from ocmm_core.camera._compiled import compiled
from ocmm_core.geometry import Float, Int

SLOT_U, SLOT_V, MOVE_U, MOVE_V, LIGHT, PHASE, SEEN, MISSED, HOME_U, HOME_V = range(10)
"""Columns of a slot: last or presumed position and motion of one frame (px), usual light (counts),
phase, consecutive frames seen (up to `CONFIRM`) and not seen, place at which its last LED was
released (px, NaN if never).
"""
N_SLOT = 10

NOBODY, TRIAL, FOLLOWED = 0, 1, 2
"""Phases: free; candidate under confirmation; an LED."""

_GAIN = 0.5
"""Fraction of an innovation attributed to motion: after three frames the window is within an eighth
of the first one, and a single bad position has limited effect.
"""
_MEMORY = 0.99
"""Factor per frame of a hidden LED's own motion relative to that of the others: at 8 kHz it lasts
for 12 ms, as long as a crossing of two LEDs or the edge of a part.
"""
# The usual light is a mean over some 16 frames (2 ms at 8 kHz), to follow slow changes only.
_LIGHT_GAIN = 1.0 / 16.0


@compiled(centroid)
def corner(position: float, size: int, limit: int) -> int:
    """Return the first pixel of a window of ``size`` about a position, kept on the sensor."""
    # The middle of pixels 0 to size - 1 is (size - 1) / 2; the half rounds to the nearest pixel.
    return min(max(int(np.floor(position - 0.5 * (size - 1) + 0.5)), 0), limit - size)


@compiled(centroid)
def predict_windows(slots: Float, options: Float, width: int, height: int, corners: Int) -> None:
    """Write the next windows, ``corners`` (S, 2): left and top; -1 for a free slot."""
    size = int(options[centroid.WINDOW])
    for s in range(len(slots)):
        if slots[s, PHASE] == NOBODY:
            corners[s, 0] = corners[s, 1] = -1
        else:
            # Last position plus the motion of one frame, px per frame: constant velocity.
            corners[s, 0] = corner(slots[s, SLOT_U] + slots[s, MOVE_U], size, width)
            corners[s, 1] = corner(slots[s, SLOT_V] + slots[s, MOVE_V], size, height)


@compiled(centroid)
def measure_windows(
    pixels: NDArray[np.uint16],
    corners: Int,
    black: NDArray[np.uint16],
    slots: Float,
    options: Float,
    readings: Float,
) -> None:
    """Measure the windows ``pixels`` (S, w, w) at ``corners`` (S, 2) and update the slots."""
    size = pixels.shape[1]
    light = np.empty((size, size))
    mark = np.empty((size, size), np.uint8)
    stack = np.empty(size * size, np.int64)
    for s in range(len(slots)):
        if corners[s, 0] < 0:
            readings[s, :] = np.nan
            readings[s, centroid.STATUS] = centroid.FREE
        else:
            centroid.measure(
                pixels[s], corners[s, 0], corners[s, 1], black, options, light, mark, stack,
                readings[s],
            )  # fmt: skip
    update_tracks(slots, options, readings)


@compiled(centroid)
def update_tracks(slots: Float, options: Float, readings: Float) -> None:
    """Validate the readings (S, N_READING) of one frame together and update the slots.

    The status of a good reading may become SHARED (another window holds the same spot), JUMPED (its
    light is not that of this LED) or UNCONFIRMED (too new).
    """
    _judge_light(slots, options, readings)
    _judge_pairs(slots, options, readings)
    # Before any slot moves on: the motion is the difference to the previous frame.
    group_u, group_v = _group_motion(slots, readings)
    confirm = int(options[centroid.CONFIRM])
    for s in range(len(slots)):
        slot, reading = slots[s], readings[s]
        if slot[PHASE] == NOBODY:
            continue
        status = reading[centroid.STATUS]
        # An overexposed spot still locates the LED well enough for the next window.
        if status == centroid.GOOD or status == centroid.SATURATED:
            _follow(slot, reading, confirm)
            if slot[SEEN] >= confirm:
                slot[PHASE] = FOLLOWED
            elif status == centroid.GOOD:
                reading[centroid.STATUS] = centroid.UNCONFIRMED
        # A candidate that fails once was noise or a passing light.
        elif slot[PHASE] == TRIAL:
            slot[PHASE] = NOBODY
        # By default 800 frames, 0.1 s at 8 kHz.
        elif slot[MISSED] >= options[centroid.HOLD]:
            slot[PHASE] = NOBODY
            slot[HOME_U], slot[HOME_V] = slot[SLOT_U], slot[SLOT_V]
        else:
            slot[MISSED] += 1.0
            if slot[MISSED] > confirm:
                # Later spots may be others, and need confirmation like a new one.
                slot[SEEN] = 0.0
            # LEDs of one body move alike, so the motion of visible ones is the better prediction
            # the longer this one is hidden. 0.99 a frame is a time constant of 100 frames.
            slot[MOVE_U] = group_u + _MEMORY * (slot[MOVE_U] - group_u)
            slot[MOVE_V] = group_v + _MEMORY * (slot[MOVE_V] - group_v)
            slot[SLOT_U] += slot[MOVE_U]
            slot[SLOT_V] += slot[MOVE_V]


@compiled(centroid)
def _follow(slot: Float, reading: Float, confirm: int) -> None:
    # Observed minus predicted, px.
    surprise_u = reading[centroid.U] - slot[SLOT_U] - slot[MOVE_U]
    surprise_v = reading[centroid.V] - slot[SLOT_V] - slot[MOVE_V]
    slot[SLOT_U], slot[SLOT_V] = reading[centroid.U], reading[centroid.V]
    slot[MOVE_U] += _GAIN * surprise_u
    slot[MOVE_V] += _GAIN * surprise_v
    # The first frames set the usual light; a mean from zero would take 16.
    if slot[PHASE] == TRIAL:
        slot[LIGHT] = reading[centroid.FLUX]
    else:
        slot[LIGHT] += _LIGHT_GAIN * (reading[centroid.FLUX] - slot[LIGHT])
    # Only used for comparison with CONFIRM.
    slot[SEEN] = min(slot[SEEN] + 1.0, float(confirm))
    slot[MISSED] = 0.0


@compiled(centroid)
def _judge_light(slots: Float, options: Float, readings: Float) -> None:
    for s in range(len(slots)):
        if slots[s, PHASE] == FOLLOWED and readings[s, centroid.STATUS] == centroid.GOOD:
            ratio = readings[s, centroid.FLUX] / slots[s, LIGHT]
            # The light of one LED changes slowly; a jump is another LED or two in one.
            if not options[centroid.FLUX_LOW] <= ratio <= options[centroid.FLUX_HIGH]:
                readings[s, centroid.STATUS] = centroid.JUMPED


@compiled(centroid)
def _judge_pairs(slots: Float, options: Float, readings: Float) -> None:
    """Prevent two windows from reporting one spot: the former owner keeps it, or neither."""
    n = len(slots)
    near = options[centroid.SEPARATION]
    shared = np.zeros(n, np.bool_)
    for s in range(n):
        if not _located(slots[s], readings[s]):
            continue
        for t in range(s + 1, n):
            if not _located(slots[t], readings[t]):
                continue
            if (
                # A square about the spot serves as well as a circle; NaN is excluded (`_located`).
                abs(readings[s, centroid.U] - readings[t, centroid.U]) > near
                or abs(readings[s, centroid.V] - readings[t, centroid.V]) > near
            ):
                continue
            # From MISSED of the previous frame: this one has not been counted yet.
            owns_s = slots[s, PHASE] == FOLLOWED and slots[s, MISSED] == 0.0
            owns_t = slots[t, PHASE] == FOLLOWED and slots[t, MISSED] == 0.0
            # One owner: the other is shared. Both or none: both are.
            shared[s] |= owns_t or not owns_s
            shared[t] |= owns_s or not owns_t
    for s in range(n):
        if shared[s]:
            readings[s, centroid.STATUS] = centroid.SHARED


@compiled(centroid)
def _located(slot: Float, reading: Float) -> bool:
    status = reading[centroid.STATUS]
    found = status == centroid.GOOD or status == centroid.SATURATED or status == centroid.JUMPED
    return bool(slot[PHASE] != NOBODY and found)


@compiled(centroid)
def _group_motion(slots: Float, readings: Float) -> tuple[float, float]:
    u = v = 0.0
    n = 0
    for s in range(len(slots)):
        if (
            slots[s, PHASE] == FOLLOWED
            and slots[s, MISSED] == 0.0
            and readings[s, centroid.STATUS] == centroid.GOOD
        ):
            u += readings[s, centroid.U] - slots[s, SLOT_U]
            v += readings[s, centroid.V] - slots[s, SLOT_V]
            n += 1
    # Otherwise zero: a window without information eventually stops.
    if n:
        u /= n
        v /= n
    return u, v


@compiled(centroid)
def report(
    readings: Float, uv: Float, variance: Float, status: NDArray[np.uint8]
) -> tuple[int, bool]:
    """Write ``uv``, ``variance`` (S, 2), ``status``; return valid bits, and if overexposed."""
    valid, saturated = 0, False
    for s in range(len(readings)):
        found = int(readings[s, centroid.STATUS])
        status[s] = found
        saturated |= found == centroid.SATURATED
        good = found == centroid.GOOD
        if good:
            valid |= 1 << s
        for a in range(2):
            uv[s, a] = readings[s, centroid.U + a] if good else np.nan
            variance[s, a] = readings[s, centroid.VAR_U + a] if good else np.nan
    return valid, saturated
