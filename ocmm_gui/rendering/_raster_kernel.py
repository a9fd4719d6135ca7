"""Compiled: rasterisation to pixels, a depth buffer and a face number buffer.

A place is (x, y, depth): x and y in px from the upper left corner, pixel (i, j) reaching from i to
i + 1 and from j to j + 1; depth in mm, greater towards the eye. The projection is orthographic, so
depth and colour are linear over a triangle.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float
from ocmm_gui.rendering._canvas import Colours, Depths, FaceNumbers, Flags, Pixmap, Shades

# Light direction a little up and left of the eye: (x right, y up, z to the eye), unit. From the eye
# itself the three sides of a box seen over its corner would be equally bright.
_LAMP_X, _LAMP_Y, _LAMP_Z = -0.28, 0.40, 0.8727
# Faces turned from the light still show their colour.
_AMBIENT = 0.42
# A pixel's centre may lie on a common edge; rounding must not exclude it from both triangles.
_EDGE_PX = 1e-6
# Colours that differ by less, the sum over both other corners, are equal: half a level a channel.
_PLAIN = 3.0
# Steeper slopes, mm or levels per pixel, are those of triangles seen edge-on.
_STEEPEST = 1e5
# Below this twice the area (px^2) a triangle is seen edge-on and covers nothing.
_FLAT_PX2 = 1e-9


@compiled()
def project_mesh(
    vertices: Float, normals: Float, colours: Colours, matrix: Float, offset: Float,
    places: Float, shades: Shades,
) -> None:  # fmt: skip
    """Compute places (n, 3) and lit colours (n, 3), 0 to 255, of vertices.

    ``place = vertex @ matrix + offset``. The third column of ``matrix`` (3, 3) is a unit vector
    towards the eye; the first points right, the second down.
    """
    # Image directions are unit vectors; x and y are scaled, and y points down.
    scale = np.sqrt(matrix[0, 0] ** 2 + matrix[1, 0] ** 2 + matrix[2, 0] ** 2)
    for row in range(len(vertices)):
        vx, vy, vz = vertices[row, 0], vertices[row, 1], vertices[row, 2]
        nx, ny, nz = normals[row, 0], normals[row, 1], normals[row, 2]
        for axis in range(3):
            places[row, axis] = (
                vx * matrix[0, axis] + vy * matrix[1, axis] + vz * matrix[2, axis] + offset[axis]
            )
        right = (nx * matrix[0, 0] + ny * matrix[1, 0] + nz * matrix[2, 0]) / scale
        up = -(nx * matrix[0, 1] + ny * matrix[1, 1] + nz * matrix[2, 1]) / scale
        toward = nx * matrix[0, 2] + ny * matrix[1, 2] + nz * matrix[2, 2]
        # The back of a sheet is lit as its front: an open model has no inside.
        sign = 1.0 if toward >= 0.0 else -1.0
        light = sign * (right * _LAMP_X + up * _LAMP_Y + toward * _LAMP_Z)
        share = _AMBIENT + (1.0 - _AMBIENT) * max(light, 0.0)
        for channel in range(3):
            # Half a level from both ends: slopes may be off by that much in between.
            shades[row, channel] = min(max(share * colours[row, channel], 0.5), 254.5)


@compiled()
def _bands_of(places: Float, corners: FaceNumbers, height: int, rows: int) -> tuple[int, int]:
    """Return the first and last band of a triangle; last < first for none."""
    a, b, c = corners[0], corners[1], corners[2]
    # An outline may be a pixel wide.
    low = min(places[a, 1], places[b, 1], places[c, 1]) - 1.0
    high = max(places[a, 1], places[b, 1], places[c, 1]) + 1.0
    if not (low < height and high > 0.0):
        return 0, -1
    return int(max(low, 0.0)) // rows, int(min(high, height - 1.0)) // rows


@compiled()
def into_bands(
    places: Float, triangles: FaceNumbers, height: int, rows: int, starts: FaceNumbers
) -> FaceNumbers:
    """Return the triangles in each band of ``rows`` image rows, band by band.

    Buffers of a whole image exceed a core's cache: at 1920 x 1080 three quarters of the time were
    memory waits. Those of a band fit. `starts`: (bands + 1,), out: start of each.
    """
    bands = len(starts) - 1
    starts[:] = 0
    for number in range(len(triangles)):
        first, last = _bands_of(places, triangles[number], height, rows)
        for band in range(first, last + 1):
            starts[band + 1] += 1
    for band in range(bands):
        starts[band + 1] += starts[band]
    order = np.empty(starts[bands], dtype=np.int32)
    at = starts[:-1].copy()
    for number in range(len(triangles)):
        first, last = _bands_of(places, triangles[number], height, rows)
        for band in range(first, last + 1):
            order[at[band]] = number
            at[band] += 1
    return order


@compiled()
def raster(
    places: Float, shades: Shades, triangles: FaceNumbers, triangle_faces: FaceNumbers,
    closed: Flags, facing: float, order: FaceNumbers, start: int, stop: int, top: int, bottom: int,
    before: Depths, gap: float, depth: Depths, faces: FaceNumbers, image: Pixmap,
) -> None:  # fmt: skip
    """Paint triangles where nothing nearer to the eye is painted.

    `places`, `shades`: (n, 3) from `project_mesh`. `triangles`, `triangle_faces`: (m, 3) rows of
    ``places``, and (m,) numbers for ``faces``. `closed`, `facing`: (m,): 1 for triangles of a
    closed surface, whose backs are skipped. ``facing`` is the sign of the area of triangles that
    face the eye; 0 paints all. `order`, `start`, `stop`, `top`, `bottom`: paints
    ``order[start:stop]``, in the rows ``top`` to ``bottom``; see `into_bands`. `before`: (height,
    width): paint only more than ``gap`` mm behind it, for the second layer of a transparent part;
    shape (0, 0) for everything. `depth`, `faces`, `image`: (height, width), changed in place;
    ``image`` is 0xAARRGGBB.
    """
    height, width = depth.shape
    peels = before.size > 0
    for place in range(start, stop):
        number = order[place]
        a, b, c = triangles[number, 0], triangles[number, 1], triangles[number, 2]
        ax, ay, az = places[a, 0], places[a, 1], places[a, 2]
        bx, by, bz = places[b, 0], places[b, 1], places[b, 2]
        cx, cy, cz = places[c, 0], places[c, 1], places[c, 2]
        low_y, high_y = min(ay, by, cy), max(ay, by, cy)
        low_x, high_x = min(ax, bx, cx), max(ax, bx, cx)
        # This form also skips NaN.
        if not (low_x < width and high_x > 0.0 and low_y < height and high_y > 0.0):
            continue
        first_y = int(max(np.ceil(low_y - 0.5 - _EDGE_PX), float(top)))
        last_y = int(min(np.floor(high_y - 0.5 + _EDGE_PX), bottom - 1.0))
        least_x = max(np.ceil(low_x - 0.5 - _EDGE_PX), 0.0)
        most_x = min(np.floor(high_x - 0.5 + _EDGE_PX), width - 1.0)
        if first_y > last_y or least_x > most_x:
            continue
        ux, uy, vx, vy = bx - ax, by - ay, cx - ax, cy - ay
        # Twice the signed area; the sign is the orientation in the image.
        area = ux * vy - uy * vx
        if not abs(area) > _FLAT_PX2 or (area * facing < 0.0 and closed[number] != 0):
            continue
        inverse = 1.0 / area
        # Cramer's rule for f(x, y) = f_a + f_x (x - ax) + f_y (y - ay) through the three corners.
        z_x = ((bz - az) * vy - (cz - az) * uy) * inverse
        z_y = ((cz - az) * ux - (bz - az) * vx) * inverse
        ra, ga, la = shades[a, 0], shades[a, 1], shades[a, 2]
        rb, gb, lb = shades[b, 0] - ra, shades[b, 1] - ga, shades[b, 2] - la
        rc, gc, lc = shades[c, 0] - ra, shades[c, 1] - ga, shades[c, 2] - la
        # One brightness and one colour: most faces are flat.
        is_plain = abs(rb) + abs(gb) + abs(lb) + abs(rc) + abs(gc) + abs(lc) < _PLAIN
        plain = _packed(int(ra * 65536.0), int(ga * 65536.0), int(la * 65536.0))
        r_x, r_y = (rb * vy - rc * uy) * inverse, (rc * ux - rb * vx) * inverse
        g_x, g_y = (gb * vy - gc * uy) * inverse, (gc * ux - gb * vx) * inverse
        l_x, l_y = (lb * vy - lc * uy) * inverse, (lc * ux - lb * vx) * inverse
        face = triangle_faces[number]
        # Slopes of a sliver seen edge-on are meaningless: its few pixels get one depth and colour.
        # For all others a middle that `_EDGE_PX` admits is off by less than a tenth of a level.
        steepest = max(abs(z_x), abs(z_y), abs(r_x), abs(r_y), abs(g_x), abs(g_y), abs(l_x))
        if not max(steepest, abs(l_y)) < _STEEPEST:
            is_plain = True
            az, z_x, z_y = (az + bz + cz) / 3.0, 0.0, 0.0
        r_step, g_step, l_step = int(r_x * 65536.0), int(g_x * 65536.0), int(l_x * 65536.0)
        # From the lowest to the highest corner: a line through pixel middles crosses the long edge,
        # from top to end, and the short one above or below the middle corner.
        tx, ty, mx, my, ex, ey = _by_height(ax, ay, bx, by, cx, cy)
        along_long = (ex - tx) / (ey - ty) if ey > ty else 0.0
        along_first = (mx - tx) / (my - ty) if my > ty else 0.0
        along_second = (ex - mx) / (ey - my) if ey > my else 0.0
        for y in range(first_y, last_y + 1):
            middle = y + 0.5
            x_long = min(max(tx + along_long * (middle - ty), min(tx, ex)), max(tx, ex))
            if middle < my:
                x_short = min(max(tx + along_first * (middle - ty), min(tx, mx)), max(tx, mx))
            else:
                x_short = min(max(mx + along_second * (middle - my), min(mx, ex)), max(mx, ex))
            first = int(max(np.ceil(min(x_long, x_short) - 0.5 - _EDGE_PX), least_x))
            last = int(min(np.floor(max(x_long, x_short) - 0.5 + _EDGE_PX), most_x))
            if first > last:
                continue
            dx, dy = first + 0.5 - ax, middle - ay
            z = az + z_x * dx + z_y * dy
            # Slices from zero: no negative indices for the compiler to check.
            depths, owners = depth[y, first : last + 1], faces[y, first : last + 1]
            pixels = image[y, first : last + 1]
            if is_plain:
                for k in range(len(depths)):
                    if z > depths[k] and not (peels and z >= before[y, first + k] - gap):
                        depths[k], owners[k], pixels[k] = z, face, plain
                    z += z_x
                continue
            r_at = int((ra + r_x * dx + r_y * dy) * 65536.0)
            g_at = int((ga + g_x * dx + g_y * dy) * 65536.0)
            l_at = int((la + l_x * dx + l_y * dy) * 65536.0)
            for k in range(len(depths)):
                if z > depths[k] and not (peels and z >= before[y, first + k] - gap):
                    depths[k], owners[k] = z, face
                    pixels[k] = _packed(r_at, g_at, l_at)
                z += z_x
                r_at += r_step
                g_at += g_step
                l_at += l_step


@compiled()
def _by_height(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float
) -> tuple[float, float, float, float, float, float]:
    """Return three corners sorted by y."""
    if ay > by:
        ax, ay, bx, by = bx, by, ax, ay
    if by > cy:
        bx, by, cx, cy = cx, cy, bx, by
        if ay > by:
            ax, ay, bx, by = bx, by, ax, ay
    return ax, ay, bx, by, cx, cy


@compiled()
def _packed(red: int, green: int, blue: int) -> np.uint32:
    """Return an opaque colour 0xffRRGGBB from channels with 16 fractional bits."""
    return np.uint32(0xFF000000 | (red & 0xFF0000) | ((green >> 8) & 0xFF00) | (blue >> 16))


@compiled()
def hides(
    vertices: Float, triangles: FaceNumbers, point: Float, toward: Float, least_mm: float
) -> bool:
    """Return whether a triangle lies more than ``least_mm`` in front of a point (3,).

    ``toward`` (3,) is a unit vector to the eye. Ray intersection by Moeller and Trumbore (1997),
    without culling: a sheet hides from both sides.
    """
    for number in range(len(triangles)):
        a, b, c = triangles[number, 0], triangles[number, 1], triangles[number, 2]
        e0 = vertices[b, 0] - vertices[a, 0]
        e1 = vertices[b, 1] - vertices[a, 1]
        e2 = vertices[b, 2] - vertices[a, 2]
        f0 = vertices[c, 0] - vertices[a, 0]
        f1 = vertices[c, 1] - vertices[a, 1]
        f2 = vertices[c, 2] - vertices[a, 2]
        p0 = toward[1] * f2 - toward[2] * f1
        p1 = toward[2] * f0 - toward[0] * f2
        p2 = toward[0] * f1 - toward[1] * f0
        det = e0 * p0 + e1 * p1 + e2 * p2
        # Parallel to the ray, or without area.
        if not abs(det) > 1e-12:
            continue
        s0 = point[0] - vertices[a, 0]
        s1 = point[1] - vertices[a, 1]
        s2 = point[2] - vertices[a, 2]
        u = (s0 * p0 + s1 * p1 + s2 * p2) / det
        if u < 0.0 or u > 1.0:
            continue
        q0 = s1 * e2 - s2 * e1
        q1 = s2 * e0 - s0 * e2
        q2 = s0 * e1 - s1 * e0
        v = (toward[0] * q0 + toward[1] * q1 + toward[2] * q2) / det
        if v < 0.0 or u + v > 1.0:
            continue
        if (f0 * q0 + f1 * q1 + f2 * q2) / det > least_mm:
            return True
    return False
