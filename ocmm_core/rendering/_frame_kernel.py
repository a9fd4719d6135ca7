"""Compiled: a whole image of an opaque part in one call, for moving views.

Releasing the GIL costs up to the switch interval (1 ms) a call, so one call waits once.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float
from ocmm_core.rendering import _line_kernel, _raster_kernel
from ocmm_core.rendering._arrays import Colours, Depths, FaceNumbers, Flags, Pixmap, Shades
from ocmm_core.rendering._line_kernel import draw_lines, draw_outline
from ocmm_core.rendering._raster_kernel import into_bands, project_mesh, raster


@compiled(_raster_kernel, _line_kernel)
def paint_frame(
    vertices: Float, normals: Float, colours: Colours, triangles: FaceNumbers,
    triangle_faces: FaceNumbers, closed: Flags, edge_points: Float, edge_starts: FaceNumbers,
    matrix: Float, offset: Float, facing: float, is_lit: bool, places: Float, shades: Shades,
    edge_places: Float, step_mm: float, edge: int, outline: float, shown: float, half_px: float,
    bias: float, ground: int, rows: int, depth: Depths, faces: FaceNumbers, image: Pixmap,
) -> None:  # fmt: skip
    """Paint a mesh with its outlines and edges, overwriting the buffers.

    See `project_mesh`, `raster`, `draw_outline` and `draw_lines` for the arrays. ``places``,
    ``shades`` and ``edge_places`` are scratch arrays. Without ``is_lit`` the vertex colours are
    used unlit; ``ground`` is a background colour 0xRRGGBB, -1 for none; ``rows``: of a band
    (`into_bands`).
    """
    height, width = depth.shape
    project_mesh(vertices, normals, colours, matrix, offset, places, shades)
    if not is_lit:
        for row in range(len(vertices)):
            for channel in range(3):
                shades[row, channel] = colours[row, channel]
    starts = np.empty((height + rows - 1) // rows + 1, dtype=np.int32)
    order = into_bands(places, triangles, height, rows, starts)
    before = np.empty((0, 0), dtype=np.float32)
    for band in range(len(starts) - 1):
        top, bottom = band * rows, min((band + 1) * rows, height)
        for y in range(top, bottom):
            for x in range(width):
                depth[y, x], faces[y, x], image[y, x] = -np.inf, -1, 0
        raster(
            places, shades, triangles, triangle_faces, closed, facing, order, starts[band],
            starts[band + 1], top, bottom, before, 0.0, depth, faces, image,
        )  # fmt: skip
        # The outline needs the row below: draw one row behind, while in the cache.
        first, last = max(top - 1, 0), bottom - 1 if bottom < height else height
        draw_outline(depth, first, last, step_mm, edge, outline, ground, image)
    for row in range(len(edge_points)):
        for axis in range(3):
            edge_places[row, axis] = (
                edge_points[row, 0] * matrix[0, axis] + edge_points[row, 1] * matrix[1, axis]
                + edge_points[row, 2] * matrix[2, axis] + offset[axis]
            )  # fmt: skip
    draw_lines(
        edge_places, edge_starts, 0, len(edge_starts) - 1, half_px, edge, shown, 0.0, bias, depth,
        image,
    )  # fmt: skip
