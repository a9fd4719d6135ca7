"""The compiled search for LEDs that no window follows.

The sensor cannot read all pixels within a frame. Each frame it reads a few more lines, every second
line and pixel, so that no LED slips through: the light at the worst place between four samples is a
third of the peak. A whole sensor takes 512 frames of two lines, 64 ms at 8 kHz.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import _centroid as centroid
from ocmm_core.camera import _windows as windows
from ocmm_core.camera._compiled import compiled
from ocmm_core.geometry import Float, Int

REGION, ROW = 0, 1
"""Cursor of the search: region and its next row; negative before the first."""

HIT_U, HIT_V, HIT_LIGHT = 0, 1, 2
"""Columns of a hit: position, px, and counts of its brightest sample."""

_REMEMBER_PX = 300.0
"""A new spot goes to the free slot whose LED was lost within this: 0.3 s at 0.2 m/s are 130 px."""


@compiled(centroid, windows)
def plan(
    slots: Float, regions: Int, anywhere: bool, options: Float, cursor: Int, lines: Int
) -> int:
    """Write the lines to read in this frame, advance the cursor, return their count.

    ``regions`` (r, 4): left, top, width, height, px; region i belongs to slot i, unless one region
    serves all slots (``anywhere``). ``lines`` (n, 3): left, row, samples; none without a free slot.
    """
    step = int(options[centroid.SEARCH_STEP])
    # `passed` counts regions with nothing to read, to end the loop with no free slot; one more than
    # the regions, as the first may be left in its middle.
    count = passed = 0
    while count < len(lines) and passed <= len(regions):
        region = cursor[REGION]
        top, height = regions[region, 1], regions[region, 3]
        # -1, before the first row, becomes the top of the region.
        row = max(cursor[ROW], top)
        if _wanted(slots, region, anywhere) and row < top + height:
            lines[count, 0], lines[count, 1] = regions[region, 0], row
            # Rounded up: with an odd width the last pixel is read as well.
            lines[count, 2] = (regions[region, 2] + step - 1) // step
            cursor[ROW] = row + step
            count += 1
        else:
            cursor[REGION], cursor[ROW] = (region + 1) % len(regions), -1
            passed += 1
    return count


@compiled(centroid, windows)
def sample(image: NDArray[np.uint16], lines: Int, step: int, samples: NDArray[np.uint16]) -> None:
    """Copy the pixels of the first lines of a plan, one line in each row."""
    for k in range(len(samples)):
        left, row, n = lines[k]
        for i in range(n):
            samples[k, i] = image[row, left + i * step]


@compiled(centroid, windows)
def scan(
    samples: NDArray[np.uint16],
    lines: Int,
    count: int,
    black: NDArray[np.uint16],
    slots: Float,
    regions: Int,
    anywhere: bool,
    options: Float,
) -> None:
    """Give free slots to new spots in ``count`` rows of ``samples`` (n, m), brightest first."""
    hits = np.empty((len(slots), 3))
    n_hits = 0
    for k in range(count):
        n_hits = _scan(samples[k], lines[k], black, slots, options, hits, n_hits)
    _place(slots, regions, anywhere, options, hits, n_hits)


@compiled(centroid, windows)
def _wanted(slots: Float, region: int, anywhere: bool) -> bool:
    if not anywhere:
        return bool(slots[region, windows.PHASE] == windows.NOBODY)
    return bool(np.any(slots[:, windows.PHASE] == windows.NOBODY))


@compiled(centroid, windows)
def _scan(
    samples: NDArray[np.uint16],
    line: Int,
    black: NDArray[np.uint16],
    slots: Float,
    options: Float,
    hits: Float,
    n_hits: int,
) -> int:
    """Enter the spots of one line into ``hits`` (h, 3), strongest first; return the count."""
    step = int(options[centroid.SEARCH_STEP])
    left, row, count = line[0], line[1], line[2]
    light = np.empty(count)
    for k in range(count):
        light[k] = float(samples[k])
    if black.size > 0:
        for k in range(count):
            light[k] -= float(black[row, left + k * step])
    # Subtract the level of the line, for even light that the black image lacks.
    threshold = options[centroid.THRESHOLD]
    limit = threshold + centroid.level_of(light, threshold)
    above = 0
    for k in range(count):
        above += 1 if light[k] > limit else 0
    if above == 0:
        # Nearly every line is dark, and counting is much faster than looking.
        return n_hits
    # Within half a window, the spot is already in that window.
    half = 0.5 * options[centroid.WINDOW]
    for k in range(count):
        u = left + k * step
        if light[k] > limit and not _is_watched(slots, half, u, row):
            n_hits = _enter(hits, n_hits, half, u, row, light[k])
    return n_hits


@compiled(centroid, windows)
def _is_watched(slots: Float, half: float, u: float, v: float) -> bool:
    for s in range(len(slots)):
        if (
            slots[s, windows.PHASE] != windows.NOBODY
            and abs(slots[s, windows.SLOT_U] - u) < half
            and abs(slots[s, windows.SLOT_V] - v) < half
        ):
            return True
    return False


@compiled(centroid, windows)
def _enter(hits: Float, n_hits: int, half: float, u: float, v: float, value: float) -> int:
    # A new hit is appended or replaces the weakest of a full list. Samples of one spot in several
    # columns or lines merge into the brightest.
    at = min(n_hits, len(hits) - 1)
    for k in range(n_hits):
        if abs(hits[k, HIT_U] - u) < half and abs(hits[k, HIT_V] - v) < half:
            at = k
            break
    if at < n_hits and value <= hits[at, HIT_LIGHT]:
        return n_hits
    n_hits = max(n_hits, at + 1)
    # Insertion from behind keeps the list sorted by light, brightest first.
    while at > 0 and hits[at - 1, HIT_LIGHT] < value:
        hits[at] = hits[at - 1]
        at -= 1
    hits[at, HIT_U], hits[at, HIT_V], hits[at, HIT_LIGHT] = u, v, value
    return n_hits


@compiled(centroid, windows)
def _place(
    slots: Float, regions: Int, anywhere: bool, options: Float, hits: Float, n_hits: int
) -> None:
    """Give each hit to the free slot with the nearest lost LED."""
    half = 0.5 * options[centroid.WINDOW]
    for k in range(n_hits):
        u, v = hits[k, HIT_U], hits[k, HIT_V]
        # Checked again: a slot just filled may now contain this place.
        if _is_watched(slots, half, u, v):
            continue
        chosen, nearest = -1, np.inf
        for s in range(len(slots)):
            if slots[s, windows.PHASE] != windows.NOBODY:
                continue
            if not anywhere and not (s < len(regions) and _inside(regions[s], u, v)):
                continue
            far = np.hypot(slots[s, windows.HOME_U] - u, slots[s, windows.HOME_V] - v)
            # A slot without an LED so far holds NaN and precedes one with a distant LED: 600 px
            # without memory, 601 px for a distant one, both behind any near one. A comparison with
            # NaN is false, so NaN takes the first.
            far = far if far <= _REMEMBER_PX else 2.0 * _REMEMBER_PX + (far > _REMEMBER_PX)
            if far < nearest:
                chosen, nearest = s, far
        if chosen >= 0:
            slot = slots[chosen]
            # Reset motion, light and counts of the old LED; keep the place where it was lost.
            slot[: windows.HOME_U] = 0.0
            slot[windows.SLOT_U], slot[windows.SLOT_V] = u, v
            slot[windows.PHASE] = windows.TRIAL


@compiled(centroid, windows)
def _inside(region: Int, u: float, v: float) -> bool:
    return bool(region[0] <= u < region[0] + region[2] and region[1] <= v < region[1] + region[3])
