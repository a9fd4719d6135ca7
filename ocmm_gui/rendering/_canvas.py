"""Image in memory: colours, depths and faces of its pixels, a second layer, and array types."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ocmm_core.geometry import Float

Depths: TypeAlias = NDArray[np.float32]
"""(height, width), mm towards the eye; `NOWHERE` for background."""

FaceNumbers: TypeAlias = NDArray[np.int32]
"""Indices of faces or vertices; `NO_FACE` for none."""

Flags: TypeAlias = NDArray[np.uint8]
"""(m,), 0 or 1."""

Pixmap: TypeAlias = NDArray[np.uint32]
"""(height, width), 0xAARRGGBB with premultiplied alpha; 0 for background."""

Shades: TypeAlias = NDArray[np.float32]
"""(n, 3), red, green, blue after lighting, 0 to 255."""

Colours: TypeAlias = NDArray[np.uint8]
"""(n, 3), red, green, blue of vertices."""

NOWHERE = np.float32(-np.inf)
NO_FACE = -1


_KEPT_PIXELS = 2_500_000
"""The second layer of larger images is not kept: 12 bytes per pixel."""


@dataclass(slots=True, eq=False)
class Canvas:
    """Reusable buffers of an image."""

    width: int
    height: int
    image: Pixmap = field(init=False)
    depth: Depths = field(init=False)
    faces: FaceNumbers = field(init=False)
    """`image`, `depth`, `faces`: (height, width)."""
    _room: tuple[Float, Shades, Float] | None = field(init=False, default=None)
    _second: tuple[Pixmap, Depths, FaceNumbers] | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        self.image, self.depth, self.faces = self._layer()

    def clear(self) -> None:
        """Reset all pixels to background."""
        self.image.fill(0)
        self.depth.fill(NOWHERE)
        self.faces.fill(NO_FACE)

    def copy_from(self, other: Canvas) -> None:
        """Copy another canvas of this size."""
        self.image[:] = other.image
        self.depth[:] = other.depth
        self.faces[:] = other.faces

    def room(self, vertices: int, edge_points: int) -> tuple[Float, Shades, Float]:
        """Return scratch arrays for places and colours of vertices, and places of edges."""
        room = self._room
        if room is None or len(room[0]) != vertices or len(room[2]) != edge_points:
            room = self._room = (
                np.empty((vertices, 3)),
                np.empty((vertices, 3), dtype=np.float32),
                np.empty((edge_points, 3)),
            )
        return room

    def second_layer(self) -> tuple[Pixmap, Depths, FaceNumbers]:
        """Return empty buffers for the layer behind the first."""
        if self._second is None:
            self._second = self._layer()
        else:
            for buffer, empty in zip(self._second, (0, NOWHERE, NO_FACE), strict=True):
                buffer.fill(empty)
        return self._second

    def merged(self) -> None:
        """Free the second layer if it is large."""
        if self.width * self.height > _KEPT_PIXELS:
            self._second = None

    def face_at(self, x: float, y: float) -> int:
        """Return the face index at a pixel; `NO_FACE` for none or outside."""
        column, row = int(np.floor(x)), int(np.floor(y))
        if not (0 <= column < self.width and 0 <= row < self.height):
            return NO_FACE
        return int(self.faces[row, column])

    def in_sight(self, places: Float, bias: float) -> NDArray[np.bool_]:
        """Return which places (n, 3), px, px, mm, are visible: ``bias`` mm deep, all outside."""
        x = np.floor(places[:, 0])
        y = np.floor(places[:, 1])
        inside = (x >= 0) & (x < self.width) & (y >= 0) & (y < self.height)
        columns = np.where(inside, x, 0).astype(np.int64)
        rows = np.where(inside, y, 0).astype(np.int64)
        seen: NDArray[np.bool_] = ~inside | (places[:, 2] + bias >= self.depth[rows, columns])
        return seen

    def _layer(self) -> tuple[Pixmap, Depths, FaceNumbers]:
        size = (self.height, self.width)
        return (
            np.zeros(size, dtype=np.uint32),
            np.full(size, NOWHERE, dtype=np.float32),
            np.full(size, NO_FACE, dtype=np.int32),
        )
