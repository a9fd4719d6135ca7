"""Touches of model faces: ball centres against the nearest place of the faces.

No element is associated with the points. The ball touches at a surface normal through its centre,
so the deviation is the distance of the centre from the trimmed face less the radius. To first order
it only depends on motion of the centre along the normal: the foot slides along the face.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.geometry import Float
from ocmm_core.measuring import Rows
from ocmm_core.part_model import Feet, NominalFace, followed_feet, nearest_feet, searched
from ocmm_core.tolerances.zones._evaluation import Seen
from ocmm_core.tolerances.zones._surface import own_fit

FAR_MM = 5.0
"""A more distant point belongs to other faces, or the alignment is wrong."""
_SLANT = 0.5
"""Cosine between approach and normal below which another face may have been touched."""


class ModelSurface:
    """Ball centres of one or more touched features against faces; searched together.

    Faces are in the frame of the nominals; ``offset``, mm, is that of the zone's middle from the
    faces, away from the material.
    """

    def __init__(
        self, features: Sequence[ActualFeature], faces: Sequence[NominalFace], offset: float = 0.0
    ) -> None:
        touched = [own_fit(feature)[0] for feature in features]
        self._offset = offset
        self._faces = [searched(face) for face in faces]
        self._feet: Feet | None = None
        self._features = tuple(
            feature.nominal.name
            for feature, touches in zip(features, touched, strict=True)
            for _ in touches.numbers
        )
        self._numbers = tuple(number for touches in touched for number in touches.numbers)
        self._places = tuple(place for touches in touched for place in touches.places)
        self._tips = np.vstack([touches.tips for touches in touched])
        self._directions = np.vstack([touches.directions for touches in touched])
        self._radii = np.concatenate(
            [np.full(len(touches.tips), touches.tip_radius) for touches in touched]
        )

    @property
    def world(self) -> Float:
        """Return the ball centres (n, 3), mm, world."""
        return self._tips

    @property
    def places(self) -> Sequence[int]:
        """Return the indices of the points in rows."""
        return self._places

    def deviations(self, points: Float) -> tuple[Float, Float]:
        """Return deviations (n,), mm, and normals (n, 3), near the previous feet."""
        if self._feet is None:
            self._feet = nearest_feet(points, self._faces)
        else:
            self._feet = followed_feet(points, self._faces, self._feet)
        return self._less_ball(self._feet)

    def checked(self, points: Float, rotation: Float) -> tuple[Float, Float]:
        """Repeat by searching all faces; FitError: on an edge, ambiguous or implausible."""
        self._feet = nearest_feet(points, self._faces)
        values, normals = self._less_ball(self._feet)
        along = np.einsum("ni,ni->n", self._directions @ rotation.T, normals)
        off = values + self._offset
        for i, (unclear, value, cosine) in enumerate(
            zip(self._feet.doubts, off.tolist(), along.tolist(), strict=True)
        ):
            doubt = unclear
            if abs(value) > FAR_MM:
                doubt = f"it lies {value:+.1f} mm off the faces that the plan names"
            elif not doubt and cosine < _SLANT:
                doubt = f"it was approached {_degrees(cosine)} off the normal"
            if doubt:
                raise FitError(
                    "characteristic.no_foot",
                    f"Point {self._numbers[i]} of {self._features[i]} gives no deviation from the "
                    f"model: {doubt}.",
                    "Touch again inside the face, square to it and away from edges and narrow "
                    "hollows, or name the faces that were touched.",
                )
        return values, normals

    def pull_back(self, weights: Float, normals: Float) -> Rows:
        """Return the gradient of the weighted sum of ball centres, less the ball."""
        own = Rows.of_points(np.asarray(self.places), weights.ravel())
        return own.with_radius(-float(np.sum(weights * normals)))

    def by_radius(self, normals: Float) -> Float:
        """Return the derivatives (n,) of deviations by the ball radius."""
        return np.full(len(normals), -1.0)

    def seen(self, values: Float, normals: Float) -> Seen:
        """Return the deviations for pictures."""
        surface = self._tips - self._radii[:, None] * normals
        return Seen(self._features, self._numbers, surface, normals, values)

    def _less_ball(self, feet: Feet) -> tuple[Float, Float]:
        return feet.distances - self._radii - self._offset, feet.normals


def _degrees(cosine: float) -> str:
    return f"{np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))):.0f}°"
