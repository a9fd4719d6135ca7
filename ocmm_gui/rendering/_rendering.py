"""Painting of a part into a canvas, at once or incrementally.

A whole image of an opaque part, for moving views, is one compiled call: releasing the GIL costs up
to the switch interval (1 ms) a call, so one call waits once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from time import perf_counter

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float
from ocmm_gui.rendering import _line_kernel, _raster_kernel
from ocmm_gui.rendering._canvas import Canvas, Colours, Depths, FaceNumbers, Flags, Pixmap, Shades
from ocmm_gui.rendering._line_kernel import (
    blend_polygon,
    draw_discs,
    draw_lines,
    draw_outline,
    draw_segments,
    lay_ground,
    merge_layers,
)
from ocmm_gui.rendering._mesh import RenderMesh
from ocmm_gui.rendering._raster_kernel import hides, into_bands, project_mesh, raster


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


_TRIANGLES = 4096
_LINES = 512
_ROWS = 128
"""Rows painted between two checks of the time: some milliseconds."""
_BIAS_PX = 1.2
"""A line lies on its surface to about a pixel; more would show the edges under a thin sheet."""
_OUTLINE_PX = 8.0
_BAND_BYTES = 500_000
"""Half of the cache of a current core."""
_PIXEL_BYTES = 12
_NO_DEPTHS: Depths = np.empty((0, 0), dtype=np.float32)
_FRONT, _BACK = 0.42, 0.5


class RenderMode(Enum):
    SHADED = "shaded"
    HIDDEN_LINES = "hidden lines"
    TRANSPARENT = "transparent"

    @property
    def following(self) -> RenderMode:
        """Return the next mode, cyclically."""
        modes = tuple(RenderMode)
        return modes[(modes.index(self) + 1) % len(modes)]


@dataclass(frozen=True, slots=True)
class RenderStyle:
    """Mode and colours, each ``#rrggbb``."""

    mode: RenderMode
    edge: str
    fill: str
    """Faces in line modes: the background."""
    half_px: float = 0.6
    ground: str = ""
    """Background; empty leaves it transparent."""


class Rendering:
    """Paint a mesh into a canvas; `go_on` continues until the time is up.

    `matrix`, `offset`: (3, 3) and (3,): ``vertex @ matrix + offset`` is x and y, px, and the height
    towards the eye, mm; the third column of ``matrix`` is a unit vector. `canvas`: cleared first.
    `colours`: (n, 3) of its vertices, from `RenderMesh.vertex_colours`.
    """

    def __init__(
        self,
        mesh: RenderMesh,
        matrix: Float,
        offset: Float,
        canvas: Canvas,
        style: RenderStyle,
        colours: Colours,
    ) -> None:
        self._mesh, self._canvas, self._style = mesh, canvas, style
        self._matrix = np.ascontiguousarray(matrix, dtype=np.float64)
        self._offset = np.ascontiguousarray(offset, dtype=np.float64)
        self._colours = colours
        # Triangles are counter-clockwise seen from outside; the sign of their area in the image
        # indicates facing the eye.
        self._facing = float(np.sign(np.linalg.det(self._matrix)))
        self.px_mm = 1.0 / float(np.linalg.norm(self._matrix[:, 0]))
        self._steps = self._painting()
        self.is_done = self._has_begun = False

    @property
    def bias(self) -> float:
        """Return the depth below the surface that still counts as on it, mm."""
        return _BIAS_PX * self.px_mm + self._mesh.cell_mm

    def go_on(self, until_s: float = math.inf) -> bool:
        """Paint until a time of `time.perf_counter`; return whether all is painted."""
        at_once = math.isinf(until_s) and self._style.mode is not RenderMode.TRANSPARENT
        if at_once and not self._has_begun:
            self._paint_frame()
            self.is_done = True
        while not self.is_done:
            self._has_begun = True
            if next(self._steps, True):
                self.is_done = True
            elif perf_counter() > until_s:
                break
        return self.is_done

    def _painting(self) -> Iterator[bool]:
        mesh, canvas, style = self._mesh, self._canvas, self._style
        canvas.clear()
        places, shades, _ = canvas.room(len(mesh.vertices), len(mesh.edge_points))
        colours = self._vertex_colours()
        project_mesh(
            mesh.vertices, mesh.normals, colours, self._matrix, self._offset, places, shades
        )
        if style.mode is RenderMode.HIDDEN_LINES:
            shades[:] = colours
        yield False
        front = (canvas.depth, canvas.faces, canvas.image)
        yield from self._raster(places, shades, _NO_DEPTHS, front, self._facing)
        if style.mode is RenderMode.TRANSPARENT:
            image, depth, faces = canvas.second_layer()
            yield from self._raster(places, shades, canvas.depth, (depth, faces, image), 0.0)
            for start in range(0, canvas.height, _ROWS):
                stop = min(start + _ROWS, canvas.height)
                merge_layers(canvas.image, image, start, stop, _FRONT, _BACK)
                yield False
            canvas.merged()
        yield from self._lines()

    def _vertex_colours(self) -> Colours:
        mesh, style = self._mesh, self._style
        if style.mode is RenderMode.HIDDEN_LINES:
            fill = _number(style.fill)
            colours = np.empty((len(mesh.vertices), 3), dtype=np.uint8)
            colours[:] = (fill >> 16, (fill >> 8) & 255, fill & 255)
            return colours
        return self._colours

    def _strengths(self) -> tuple[float, float]:
        """Return the opacity of outlines and edges, 0 to 1."""
        return (1.0, 1.0) if self._style.mode is RenderMode.HIDDEN_LINES else (0.6, 0.85)

    def _paint_frame(self) -> None:
        mesh, canvas, style = self._mesh, self._canvas, self._style
        outline, shown = self._strengths()
        places, shades, edges = canvas.room(len(mesh.vertices), len(mesh.edge_points))
        paint_frame(
            mesh.vertices, mesh.normals, self._vertex_colours(), mesh.triangles,
            mesh.triangle_faces, mesh.closed, mesh.edge_points, mesh.edge_starts, self._matrix,
            self._offset, self._facing, style.mode is RenderMode.SHADED, places, shades, edges,
            _OUTLINE_PX * self.px_mm, _number(style.edge), outline, shown, style.half_px,
            self.bias, _number(style.ground) if style.ground else -1,
            _band_rows(canvas.width), canvas.depth, canvas.faces, canvas.image,
        )  # fmt: skip

    def _raster(
        self, places: Float, shades: Shades, before: Depths,
        into: tuple[Depths, FaceNumbers, Pixmap], facing: float,
    ) -> Iterator[bool]:  # fmt: skip
        mesh, canvas = self._mesh, self._canvas
        gap = 0.5 * self.px_mm + mesh.cell_mm
        rows = _band_rows(canvas.width)
        starts = np.empty(-(-canvas.height // rows) + 1, dtype=np.int32)
        order = into_bands(places, mesh.triangles, canvas.height, rows, starts)
        yield False
        for band in range(len(starts) - 1):
            last = int(starts[band + 1])
            for start in range(int(starts[band]), last, _TRIANGLES):
                raster(
                    places, shades, mesh.triangles, mesh.triangle_faces, mesh.closed, facing,
                    order, start, min(start + _TRIANGLES, last), band * rows,
                    min((band + 1) * rows, canvas.height), before, gap, *into,
                )  # fmt: skip
                yield False

    def _lines(self) -> Iterator[bool]:
        mesh, canvas, style = self._mesh, self._canvas, self._style
        colour = _number(style.edge)
        hidden = 0.3 if style.mode is RenderMode.TRANSPARENT else 0.0
        share, shown = self._strengths()
        step = _OUTLINE_PX * self.px_mm
        ground = _number(style.ground) if style.ground else -1
        for start in range(0, canvas.height, _ROWS):
            stop = min(start + _ROWS, canvas.height)
            draw_outline(canvas.depth, start, stop, step, colour, share, ground, canvas.image)
            if style.ground and style.mode is RenderMode.TRANSPARENT:
                lay_ground(ground, start, stop, canvas.image)
            yield False
        edges = np.ascontiguousarray(mesh.edge_points @ self._matrix + self._offset)
        for start in range(0, len(mesh.edge_starts) - 1, _LINES):
            stop = min(start + _LINES, len(mesh.edge_starts) - 1)
            draw_lines(
                edges, mesh.edge_starts, start, stop, style.half_px, colour, shown, hidden,
                self.bias, canvas.depth, canvas.image,
            )  # fmt: skip
            yield False


def blend_flat(canvas: Canvas, corners: Float, colour: str, share: float, bias: float) -> None:
    """Blend a convex flat polygon (n, 3), opacity ``share``, hidden beyond ``bias`` mm."""
    blend_polygon(
        np.ascontiguousarray(corners), _number(colour), share, bias, canvas.depth, canvas.image
    )


class Wires:
    """Lines and round marks of many styles as arrays, made once and drawn in many views.

    `lines`: segments (n, 2, 3), mm, width, px, and colour. `dots`: places (n, 3), mm, diameter, px,
    colour, and that of the outline, or "".
    """

    def __init__(
        self,
        lines: Sequence[tuple[Float, float, str]],
        dots: Sequence[tuple[Float, float, str, str]],
    ) -> None:
        nothing, counts = np.empty((0, 3)), [len(one[0]) for one in dots]
        self._ends = np.concatenate([nothing, *(one[0].reshape(-1, 3) for one in lines)])
        self._firsts = np.cumsum([0, *(len(one[0]) for one in lines)], dtype=np.int32)
        self._half_px = np.array([0.5 * one[1] for one in lines])
        self._colours = np.array([_number(one[2]) for one in lines], dtype=np.int32)
        self._places = np.concatenate([nothing, *(one[0] for one in dots)])
        self._style = np.repeat(np.arange(len(dots)), counts)
        self._radii = np.array([0.5 * one[1] for one in dots])
        self._fills = np.array([_number(one[2]) for one in dots], dtype=np.int32)
        self._rims = np.array([_number(one[3]) if one[3] else -1 for one in dots], dtype=np.int32)

    def draw_lines(
        self, canvas: Canvas, pixels: Callable[[Float], Float], scale: float, bias: float,
        hidden: float,
    ) -> None:  # fmt: skip
        """Draw the lines over a part; behind it with opacity ``hidden``.

        `pixels`: returns places in the canvas. `scale`: its pixels per pixel of a width. `bias`: mm
        in front of the part at which they are still seen.
        """
        draw_segments(
            pixels(self._ends), self._firsts, scale * self._half_px, self._colours, hidden, bias,
            canvas.depth, canvas.image,
        )  # fmt: skip

    def draw_dots(
        self, canvas: Canvas, pixels: Callable[[Float], Float], scale: float, bias: float,
        hidden: float, rim_px: float,
    ) -> None:  # fmt: skip
        """Draw the marks of each style from far to near, as `draw_lines`."""
        places = pixels(self._places)
        order = np.lexsort((places[:, 2], self._style))
        style = self._style[order]
        draw_discs(
            places[order], scale * self._radii[style], self._fills[style], self._rims[style],
            0.5 * scale * rim_px, hidden, bias, canvas.depth, canvas.image,
        )  # fmt: skip


def is_hidden(mesh: RenderMesh, point: Float, toward: Float, least_mm: float) -> bool:
    """Return whether the part, beyond `least_mm`, hides a point (3,), mm, `toward` (3,), unit."""
    return hides(
        mesh.vertices, mesh.triangles, np.ascontiguousarray(point, dtype=np.float64),
        np.ascontiguousarray(toward, dtype=np.float64), least_mm,
    )  # fmt: skip


def _band_rows(width: int) -> int:
    return min(max(_BAND_BYTES // (_PIXEL_BYTES * width), 8), 256)


def _number(colour: str) -> int:
    return int(colour[1:7], 16)
