"""The part frame from measured datum features (3-2-1)."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec
import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.actual import ActualFeature
from ocmm_core.geometry import Float, RigidTransform

_SHORTEST_MM = 1.0


class DatumAlignment(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The part frame from measured features (3-2-1).

    Attributes
    ----------
    primary
        Plane whose normal is the z axis of the part frame.
    secondary
        Two features with centres: x points from the first to the second, along the plane.
    origin
        Feature whose centre, dropped on the primary plane, is the origin.
    """

    primary: str
    secondary: tuple[str, str]
    origin: str

    @property
    def features(self) -> tuple[str, ...]:
        """Return the names of the datum features, each once."""
        return tuple(dict.fromkeys((self.primary, *self.secondary, self.origin)))


def part_frame(rule: DatumAlignment, features: Mapping[str, ActualFeature]) -> RigidTransform:
    """Return the motion from the world to the part frame; see `frame_of`."""
    return frame_of(rule, {name: feature.fit.geometry for name, feature in features.items()})


def frame_of(rule: DatumAlignment, geometries: Mapping[str, Float]) -> RigidTransform:
    """Return the motion from the world to the part frame, ``T_part_from_world``.

    Parameters
    ----------
    rule
        Which features are the datums.
    geometries
        Geometry vectors (12,) of the features, mm, world frame (`features.shapes.Fit`).

    Raises
    ------
    FitError
        A datum is not measured, or the two secondary features lie above each other.
    """
    for name in rule.features:
        if name not in geometries:
            raise FitError(
                "alignment.datum",
                f"The part frame needs {name}, which is not measured.",
                f"Measure {name}.",
            )
    primary = geometries[rule.primary]
    z = primary[3:6] / np.linalg.norm(primary[3:6])
    along = geometries[rule.secondary[1]][0:3] - geometries[rule.secondary[0]][0:3]
    along = along - (along @ z) * z
    length = float(np.linalg.norm(along))
    if length < _SHORTEST_MM:
        raise FitError(
            "alignment.degenerate",
            f"{rule.secondary[0]} and {rule.secondary[1]} give no direction along the plane "
            f"{rule.primary}.",
            "Choose two features that lie side by side on the plane.",
        )
    x = along / length
    rotation = np.stack([x, np.cross(z, x), z])
    centre = geometries[rule.origin][0:3]
    origin = centre - ((centre - primary[0:3]) @ z) * z
    return RigidTransform(rotation, -rotation @ origin)
