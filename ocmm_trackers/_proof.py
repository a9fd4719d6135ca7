"""Unit and axes of a tracker, proven by the known distances of the LEDs of the probe."""

from __future__ import annotations

from enum import Enum, auto
from itertools import combinations

import numpy as np

from ocmm_core.errors import AcquisitionError
from ocmm_core.geometry import Float, rigid_fit

_GATE = 6.0
"""Standard deviations of a marker, for distances and residuals."""
_APART = 3.0
"""A mirrored body fits worse than the body by this factor."""
_WRONG_UNIT = 50.0
_MOST_MARKERS = 10
_LEAST_MARKERS = 4


class GeometryProof(Enum):
    """Result of comparing markers with a probe."""

    UNKNOWN = auto()
    PROVEN = auto()
    TOO_SMALL = auto()
    TOO_LARGE = auto()
    MIRRORED = auto()


def flatness(leds: Float) -> float:
    """Return the RMS distance of LEDs (L, 3) from their plane, mm."""
    return float(np.linalg.svd(leds - leds.mean(axis=0))[1][2] / np.sqrt(len(leds)))


def judge_geometry(places: Float, leds: Float, sigma: float) -> GeometryProof:
    """Return whether markers (M, 3), NaN if not seen, prove unit and handedness.

    ``leds`` (L, 3): of the probe; ``sigma``: largest standard deviation of a marker; mm.
    """
    seen = places[np.isfinite(places[:, 0])][:_MOST_MARKERS]
    if len(seen) < 3:
        return GeometryProof.UNKNOWN
    between, known = _distances(seen), _distances(leds)
    if between.max() * _WRONG_UNIT < known.max():
        return GeometryProof.TOO_SMALL
    if np.min(between + 1e12 * np.eye(len(seen))) > _WRONG_UNIT * known.max():
        return GeometryProof.TOO_LARGE
    gate = _GATE * np.sqrt(2.0) * sigma
    best: list[tuple[int, int]] = []
    for i, j, k in combinations(range(len(seen)), 3):
        for a, b in np.argwhere(np.abs(known - between[i, j]) <= gate).tolist():
            near = np.abs(known[[a, b]] - between[[i, j], k][:, None]) <= gate
            for c in np.flatnonzero(near.all(axis=0)).tolist():
                if len({a, b, c}) == 3:
                    pairs = _extended(between, known, gate, [(i, a), (j, b), (k, c)])
                    best = max(best, pairs, key=len)
        if len(best) == min(len(seen), len(leds)):
            break
    if len(best) < _LEAST_MARKERS:
        return GeometryProof.UNKNOWN
    of_markers, of_leds = (list(one) for one in zip(*best, strict=True))
    plain, mirrored = (
        _residual(seen[of_markers], leds[of_leds] * sign) for sign in ([1, 1, 1], [1, 1, -1])
    )
    if plain <= _GATE * sigma and mirrored > _APART * _GATE * sigma:
        return GeometryProof.PROVEN
    if mirrored <= _GATE * sigma and plain > _APART * _GATE * sigma:
        return GeometryProof.MIRRORED
    return GeometryProof.UNKNOWN


def refuse(found: GeometryProof, unit: str) -> None:
    """Raise AcquisitionError if the probe contradicts unit or axes of the document."""
    if found in (GeometryProof.TOO_SMALL, GeometryProof.TOO_LARGE):
        raise AcquisitionError(
            "tracker.unit",
            "The distances between the markers are far smaller or larger than those of the "
            f"probe: the tracker does not send coordinates in {unit}, as its document says.",
            "Correct 'device_unit' in the document of the tracker.",
        )
    if found is GeometryProof.MIRRORED:
        raise AcquisitionError(
            "tracker.handedness",
            "The markers are a mirror image of the probe: the axes of the tracker have another "
            "handedness than its document says.",
            "Correct 'handedness' in the document of the tracker, or its axes.",
        )


def _distances(points: Float) -> Float:
    found: Float = np.linalg.norm(points[:, None] - points, axis=2)
    return found


def _extended(
    between: Float, known: Float, gate: float, pairs: list[tuple[int, int]]
) -> list[tuple[int, int]]:
    """Return pairs of marker and LED with all that have the same distances from them."""
    for marker in range(len(between)):
        for led in range(len(known)):
            if all(
                marker != other and led != chosen
                and abs(between[marker, other] - known[led, chosen]) <= gate
                for other, chosen in pairs
            ):  # fmt: skip
                pairs = [*pairs, (marker, led)]
    return pairs


def _residual(places: Float, leds: Float) -> float:
    """Return the largest residual of a rigid fit, mm."""
    rotation, shift = rigid_fit(leds, places)
    return float(np.linalg.norm(places - leds @ rotation.T - shift, axis=1).max())
