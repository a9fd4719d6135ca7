"""Compiled: lines, discs, outlines and translucent polygons, as places in `_raster_kernel`."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float
from ocmm_gui.rendering._canvas import Depths, FaceNumbers, Pixmap


@compiled()
def _over(image: Pixmap, y: int, x: int, colour: int, share: float) -> None:
    """Blend 0xRRGGBB over a pixel, coverage 0 to 1: Porter and Duff's "over", premultiplied."""
    below, kept = image[y, x], 1.0 - share
    r = share * ((colour >> 16) & 255) + kept * ((below >> np.uint32(16)) & np.uint32(255))
    g = share * ((colour >> 8) & 255) + kept * ((below >> np.uint32(8)) & np.uint32(255))
    b = share * (colour & 255) + kept * (below & np.uint32(255))
    alpha = share * 255.0 + kept * (below >> np.uint32(24))
    image[y, x] = (
        (np.uint32(alpha + 0.5) << np.uint32(24)) | (np.uint32(r + 0.5) << np.uint32(16))
        | (np.uint32(g + 0.5) << np.uint32(8)) | np.uint32(b + 0.5)
    )  # fmt: skip


@compiled()
def draw_lines(
    places: Float, starts: FaceNumbers, start: int, stop: int, half_px: float, colour: int,
    shown: float, hidden: float, bias: float, depth: Depths, image: Pixmap,
) -> None:  # fmt: skip
    """Draw the polylines ``start`` to ``stop`` antialiased, fainter behind the part.

    `places`, `starts`: (k, 3), and (e + 1,) start index of each line. `half_px`: half the width.
    `shown`, `hidden`: opacity of a line before and behind the part, 0 to 1. `bias`: mm: a line that
    lies on the surface is not hidden by it. `depth`, `image`: (height, width); image in place.
    """
    height, width = depth.shape
    for line in range(start, stop):
        for row in range(starts[line], starts[line + 1] - 1):
            ax, ay, az = places[row, 0], places[row, 1], places[row, 2]
            bx, by, bz = places[row + 1, 0], places[row + 1, 1], places[row + 1, 2]
            # One pixel across per step along the longer side of the line.
            steep = abs(by - ay) > abs(bx - ax)
            if steep:
                ax, ay, bx, by = ay, ax, by, bx
            if ax > bx:
                ax, ay, az, bx, by, bz = bx, by, bz, ax, ay, az
            length = bx - ax
            limit = height if steep else width
            across = width if steep else height
            if not (bx > 0.0 and ax < limit and length >= 0.0):
                continue
            tilt = (by - ay) / length if length > 1e-9 else 0.0
            fall = (bz - az) / length if length > 1e-9 else 0.0
            # Perpendicularly a tilted line is narrower than its cut along the pixel.
            reach = half_px * np.sqrt(1.0 + tilt * tilt)
            # A pixel belongs to the segment with its middle: neighbours share none.
            first = int(max(np.ceil(ax - 0.5), 0.0))
            last = int(min(np.ceil(bx - 0.5) - 1.0, limit - 1.0))
            for along in range(first, last + 1):
                middle = ay + tilt * (along + 0.5 - ax)
                z = az + fall * (along + 0.5 - ax)
                low = int(max(np.floor(middle - reach), 0.0))
                high = int(min(np.floor(middle + reach), across - 1.0))
                if not (middle + reach >= 0.0 and middle - reach <= across):
                    continue
                strength = shown if _in_front(depth, steep, along, middle, z + bias) else hidden
                if strength <= 0.0:
                    continue
                for side in range(low, high + 1):
                    # Coverage of the pixel from side to side + 1.
                    cover = min(side + 1.0, middle + reach) - max(side + 0.0, middle - reach)
                    y, x = (along, side) if steep else (side, along)
                    _over(image, y, x, colour, min(max(cover, 0.0), 1.0) * strength)


@compiled()
def draw_segments(
    places: Float, firsts: FaceNumbers, half_px: Float, colours: FaceNumbers, hidden: float,
    bias: float, depth: Depths, image: Pixmap,
) -> None:  # fmt: skip
    """Draw bundles of segments with individual width and colour, in one call.

    `places`: (2 n, 3): two per segment. `firsts`, `half_px`, `colours`: (k + 1,) first segment of
    each bundle, and (k,) half width and colour.
    """
    pairs = np.empty(len(places) // 2 + 1, dtype=np.int32)
    for number in range(len(pairs)):
        pairs[number] = 2 * number
    for bundle in range(len(half_px)):
        draw_lines(
            places, pairs, firsts[bundle], firsts[bundle + 1], half_px[bundle], colours[bundle],
            1.0, hidden, bias, depth, image,
        )  # fmt: skip


@compiled()
def draw_discs(
    places: Float, radii: Float, colours: FaceNumbers, rims: FaceNumbers, half_px: float,
    hidden: float, bias: float, depth: Depths, image: Pixmap,
) -> None:  # fmt: skip
    """Draw round marks in their order, antialiased, with opacity ``hidden`` behind the part.

    `places`: (n, 3): centres. `radii`: (n,) px. `colours`, `rims`: (n,) of disc and outline, the
    latter -1 for none. `half_px`: half the width of outlines.
    """
    height, width = depth.shape
    for k in range(len(places)):
        cx, cy = places[k, 0], places[k, 1]
        reach = radii[k] + half_px + 0.5
        if not (cx + reach > 0.0 and cy + reach > 0.0 and cx - reach < width
                and cy - reach < height):  # fmt: skip
            continue
        share = 1.0
        column, row = int(np.floor(cx)), int(np.floor(cy))
        if 0 <= column < width and 0 <= row < height and places[k, 2] + bias < depth[row, column]:
            share = hidden
        if share <= 0.0:
            continue
        for y in range(int(max(cy - reach, 0.0)), int(min(cy + reach + 1.0, height))):
            for x in range(int(max(cx - reach, 0.0)), int(min(cx + reach + 1.0, width))):
                away = np.sqrt((x + 0.5 - cx) ** 2 + (y + 0.5 - cy) ** 2)
                disc = min(max(radii[k] + 0.5 - away, 0.0), 1.0)
                if disc > 0.0:
                    _over(image, y, x, colours[k], disc * share)
                if rims[k] >= 0:
                    outer = min(max(radii[k] + half_px + 0.5 - away, 0.0), 1.0)
                    inner = min(max(radii[k] - half_px + 0.5 - away, 0.0), 1.0)
                    if outer > inner:
                        _over(image, y, x, rims[k], (outer - inner) * share)


@compiled()
def _in_front(depth: Depths, steep: bool, along: int, middle: float, z: float) -> bool:
    """Return whether depth ``z`` is nearer than the part in a pixel next to a line.

    On an edge rounding decides the side, and the surface beyond may be much nearer or farther.
    """
    across = depth.shape[1] if steep else depth.shape[0]
    base = int(np.floor(middle - 0.5))
    for side in range(base, base + 2):
        at = min(max(side, 0), across - 1)
        there = depth[along, at] if steep else depth[at, along]
        if z >= there:
            return True
    return False


@compiled()
def draw_outline(
    depth: Depths, start: int, stop: int, step_mm: float, colour: int, share: float, ground: int,
    image: Pixmap,
) -> None:  # fmt: skip
    """Draw silhouettes and creases in the rows ``start`` to ``stop``.

    Pixels of the part next to background, or where the depth bends by more than ``step_mm``: second
    differences vanish on any plane. Background gets ``ground``, 0xRRGGBB; -1: unchanged.
    """
    height, width = depth.shape
    opaque = np.uint32(0xFF000000 | (ground & 0xFFFFFF))
    step = np.float32(step_mm)
    for y in range(start, stop):
        row = depth[y]
        over, under = depth[max(y - 1, 0)], depth[min(y + 1, height - 1)]
        left = row[0]
        z = row[0]
        for x in range(width):
            right = row[x + 1] if x + 1 < width else z
            if z == -np.inf:
                if ground >= 0:
                    image[y, x] = opaque
            else:
                # Only the nearer side of a step is drawn, otherwise outlines were two pixels wide.
                twice = z + z
                if twice - left - right > step or twice - over[x] - under[x] > step:
                    _over(image, y, x, colour, share)
            left, z = z, right


@compiled()
def lay_ground(ground: int, start: int, stop: int, image: Pixmap) -> None:
    """Put a background colour 0xRRGGBB behind the rows ``start`` to ``stop``."""
    opaque = np.uint32(0xFF000000 | ground)
    red, green, blue = (ground >> 16) & 255, (ground >> 8) & 255, ground & 255
    for y in range(start, stop):
        for x in range(image.shape[1]):
            above = image[y, x]
            alpha = above >> np.uint32(24)
            if alpha == 0:
                image[y, x] = opaque
            elif alpha < 255:
                kept = 1.0 - alpha / 255.0
                r = ((above >> np.uint32(16)) & np.uint32(255)) + kept * red
                g = ((above >> np.uint32(8)) & np.uint32(255)) + kept * green
                b = (above & np.uint32(255)) + kept * blue
                image[y, x] = (
                    np.uint32(0xFF000000) | (np.uint32(min(r + 0.5, 255.0)) << np.uint32(16))
                    | (np.uint32(min(g + 0.5, 255.0)) << np.uint32(8))
                    | np.uint32(min(b + 0.5, 255.0))
                )  # fmt: skip


@compiled()
def blend_polygon(
    corners: Float, colour: int, share: float, bias: float, depth: Depths, image: Pixmap
) -> None:
    """Blend a convex flat polygon, ``corners`` (n, 3), where hidden by less than ``bias`` mm."""
    height, width = depth.shape
    n = len(corners)
    # Newell's method: a robust polygon normal from all corners.
    nx = ny = nz = mx = my = mz = 0.0
    for k in range(n):
        ax, ay, az = corners[k, 0], corners[k, 1], corners[k, 2]
        m = k + 1 if k + 1 < n else 0
        bx, by, bz = corners[m, 0], corners[m, 1], corners[m, 2]
        nx += (ay - by) * (az + bz)
        ny += (az - bz) * (ax + bx)
        nz += (ax - bx) * (ay + by)
        mx, my, mz = mx + ax / n, my + ay / n, mz + az / n
    # Seen edge-on it covers nothing.
    if not abs(nz) > 1e-6 * (abs(nx) + abs(ny)) + 1e-9:
        return
    low_y, high_y = np.inf, -np.inf
    for k in range(n):
        low_y, high_y = min(low_y, corners[k, 1]), max(high_y, corners[k, 1])
    for y in range(int(max(low_y, 0.0)), int(min(high_y + 1.0, float(height)))):
        middle = y + 0.5
        left, right = np.inf, -np.inf
        for k in range(n):
            m = k + 1 if k + 1 < n else 0
            py, qy = corners[k, 1], corners[m, 1]
            # Half open: a corner between two edges counts once.
            if (py <= middle) != (qy <= middle):
                x_at = corners[k, 0] + (middle - py) / (qy - py) * (corners[m, 0] - corners[k, 0])
                left, right = min(left, x_at), max(right, x_at)
        if not left <= right:
            continue
        first = int(max(np.ceil(left - 0.5), 0.0))
        last = int(min(np.floor(right - 0.5), width - 1.0))
        for x in range(first, last + 1):
            z = mz - (nx * (x + 0.5 - mx) + ny * (middle - my)) / nz
            if z + bias >= depth[y, x]:
                _over(image, y, x, colour, share)


@compiled()
def merge_layers(
    front: Pixmap, back: Pixmap, start: int, stop: int, front_share: float, back_share: float
) -> None:
    """Blend front over back layer in rows ``start`` to ``stop``, into ``front``."""
    for y in range(start, stop):
        for x in range(front.shape[1]):
            above, below = front[y, x], back[y, x]
            if above == 0:
                continue
            front[y, x] = 0
            if below != 0:
                _over(front, y, x, int(below) & 0xFFFFFF, back_share)
            _over(front, y, x, int(above) & 0xFFFFFF, front_share)
