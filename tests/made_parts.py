"""Parts made with numpy: boxes, cylinders and balls as the reader of STEP files would give them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.part_model import ModelFace, PartModel


class PartMaker:
    """Puts faces together to a part."""

    def __init__(self) -> None:
        self._vertices: list[Float] = []
        self._normals: list[Float] = []
        self._triangles: list[Float] = []
        self._of_face: list[int] = []
        self._faces: list[ModelFace] = []
        self._lines: list[Float] = []
        self._sides: list[tuple[int, int]] = []
        self._count = 0

    def sheet(self, places: Float, normals: Float, kind: str = "Plane", colour: str = "") -> int:
        """Add a face of a grid of places (a, b, 3), and return its place in the list."""
        a, b = places.shape[:2]
        number = np.arange(a * b).reshape(a, b) + self._count
        one, two = number[:-1, :-1], number[1:, :-1]
        three, four = number[1:, 1:], number[:-1, 1:]
        rows = np.concatenate(
            [np.stack([one, two, three], -1).reshape(-1, 3),
             np.stack([one, three, four], -1).reshape(-1, 3)]
        )  # fmt: skip
        self._vertices.append(places.reshape(-1, 3))
        self._normals.append(np.broadcast_to(normals, places.shape).reshape(-1, 3))
        self._triangles.append(rows)
        self._of_face += [len(self._faces)] * len(rows)
        self._faces.append(ModelFace(len(self._faces) + 1, kind, colour=colour))
        self._count += a * b
        return len(self._faces) - 1

    def line(self, places: Float, first: int, second: int = -1) -> None:
        """Add an edge between two faces along places (k, 3)."""
        self._lines.append(places)
        self._sides.append((first, second))

    def box(self, low: Sequence[float], high: Sequence[float], steps: int = 1) -> PartMaker:
        """Add the six sides and twelve edges of an upright box."""
        corners = np.array([low, high], dtype=np.float64)
        share = np.linspace(0.0, 1.0, steps + 1)
        base = len(self._faces)
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            for end in (0, 1):
                places = np.empty((steps + 1, steps + 1, 3))
                places[..., axis] = corners[end, axis]
                along = corners[0, u] + share * (corners[1, u] - corners[0, u])
                across = corners[0, v] + share * (corners[1, v] - corners[0, v])
                places[..., u] = along[:, None]
                places[..., v] = across[None, :]
                if end == 0:
                    places = places.transpose(1, 0, 2)
                self.sheet(np.ascontiguousarray(places), (2 * end - 1) * np.eye(3)[axis])
                for other, where in ((v, 0), (v, 1)):
                    ends = np.empty((2, 3))
                    ends[:, axis], ends[:, other] = corners[end, axis], corners[where, other]
                    ends[:, u] = corners[:, u]
                    self.line(ends, base + 2 * axis + end, base + 2 * other + where)
        return self

    def tube(
        self, low: Sequence[float], height: float, radius: float, *, hollow: bool = False,
        around: int = 64, along: int = 2,
    ) -> PartMaker:  # fmt: skip
        """Add a round wall along z, from outside or (``hollow``) from inside, and its two rims."""
        angle = np.linspace(0.0, 2.0 * np.pi, around + 1)
        flat = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
        heights = np.linspace(0.0, height, along)
        places = np.asarray(low) + radius * flat[:, None] + heights[None, :, None] * np.eye(3)[2]
        normals = np.broadcast_to(flat[:, None], places.shape)
        if hollow:
            places, normals = places[::-1].copy(), -normals[::-1]
        face = self.sheet(places, normals, "Cylinder")
        for end in (0, -1):
            self.line(places[:, end], face)
        return self

    def disc(self, centre: Sequence[float], radius: float, sign: float = 1.0) -> PartMaker:
        """Add a round end that faces up or down."""
        angle = np.linspace(0.0, 2.0 * np.pi, 65)[:: int(sign)]
        flat = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
        shares = np.array([0.0, 1.0])[:, None, None]
        places = np.asarray(centre) + radius * shares * flat[None]
        self.sheet(places, sign * np.eye(3)[2])
        return self

    def ball(self, centre: Sequence[float], radius: float, steps: int = 32) -> PartMaker:
        """Add a whole sphere."""
        tilt = np.linspace(0.0, np.pi, steps + 1)
        turn = np.linspace(0.0, 2.0 * np.pi, 2 * steps + 1)
        outward = np.stack(
            [
                np.sin(tilt)[:, None] * np.cos(turn),
                np.sin(tilt)[:, None] * np.sin(turn),
                np.broadcast_to(np.cos(tilt)[:, None], (steps + 1, 2 * steps + 1)),
            ],
            axis=-1,
        )
        self.sheet(np.asarray(centre) + radius * outward, outward, "Sphere")
        return self

    def part(self, name: str = "made.step") -> PartModel:
        """Return the part."""
        lengths = [len(line) for line in self._lines]
        return PartModel(
            source_name=name,
            source_sha256="0" * 64,
            vertices=np.concatenate(self._vertices),
            normals=np.concatenate(self._normals),
            triangles=np.concatenate(self._triangles).astype(np.int32),
            triangle_faces=np.array(self._of_face, dtype=np.int32),
            faces=tuple(self._faces),
            edge_points=np.concatenate(self._lines) if self._lines else np.empty((0, 3)),
            edge_starts=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32),
            edge_faces=np.array(self._sides, dtype=np.int32).reshape(-1, 2),
            deflection_mm=0.05,
        )
