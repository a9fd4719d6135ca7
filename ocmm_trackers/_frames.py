"""Markers joined to frames by their time, and unit and axes proven by the probe."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from enum import Enum, auto
from itertools import combinations

import numpy as np

from ocmm_core.camera import TrackerDocument
from ocmm_core.errors import AcquisitionError
from ocmm_core.geometry import Float, rigid_fit
from ocmm_trackers._messages import MarkerPlace, Pose

_RESTART_NS = 1_000_000_000
_PAUSE_NS = 60_000_000_000
_MOST_OLD = 100
_FARTHEST = 1e7
"""mm; no tracker reaches so far, also with coordinates in mm read as metres."""
_SHOWN = 6
_RATED = 50
_RATE_SHARE = 0.2
_UNIT_MM = {"mm": 1.0, "m": 1000.0}


@dataclass(slots=True)
class FrameAccount:
    """``markers == used + missing + repeated + unknown + late + doubled``, and frames."""

    markers: int = 0
    used: int = 0
    missing: int = 0
    """Reported as not seen, or farther away than any tracker reaches."""
    repeated: int = 0
    """The last place again, if that is a hidden marker, or a frame equal to the last one."""
    unknown: int = 0
    """Not named in the document."""
    late: int = 0
    """Older than a frame that is complete."""
    doubled: int = 0
    """A second time in the same frame."""
    frames: int = 0
    frames_lost: int = 0


@dataclass(frozen=True, slots=True)
class MarkerFrame:
    """Markers of one exposure."""

    time_ns: int
    places: Float
    """(M, 3), mm, right-handed, in the order of the document; NaN if not seen."""


class FrameBuilder:
    """Join markers to frames of increasing time.

    A message with all markers completes its frame. Messages of single markers complete it with the
    last marker, or with the first one of a later time.
    """

    def __init__(self, document: TrackerDocument) -> None:
        self.account = FrameAccount()
        self._index = {name: index for index, name in enumerate(document.markers)}
        self._document = document
        self._period_ns = round(1e9 / document.frame_rate_hz)
        self._scale = (
            _UNIT_MM[document.device_unit]
            * document.noise.scale
            * np.array([1.0, 1.0, 1.0 if document.handedness == "right" else -1.0])
        )
        self._before = self._nothing()
        self.strangers: dict[str, None] = {}
        """Names of markers that the document does not have, at most six."""
        self._steps: deque[int] = deque(maxlen=_RATED)
        self.restart()

    def restart(self) -> None:
        """Accept another clock; a repeated place is still none."""
        self._open_ns = self._last_ns = self._old_running = 0
        self._raw = self._nothing()
        self._steps.clear()

    def add(self, pose: Pose, time_ns: int) -> list[MarkerFrame]:
        """Return the frames that a message completes.

        AcquisitionError for poses of tools, messages without time, and a clock that was set.
        """
        known = [one for one in pose.elements if one.name in self._index]
        self.account.markers += len(pose.elements)
        self.account.unknown += len(pose.elements) - len(known)
        for one in pose.elements if len(self.strangers) < _SHOWN else ():
            if one.name not in self._index:
                self.strangers[one.name] = None
        if not known and not (pose.whole and not pose.elements):
            return []
        self._require_markers(known, time_ns)
        if time_ns <= self._last_ns:
            return self._refuse_old(len(known), time_ns)
        self._old_running = 0
        found = []
        if self._open_ns and time_ns > self._open_ns:
            found += self._complete()
        elif time_ns < self._open_ns:
            self.account.late += len(known)
            return found
        self._open_ns = time_ns
        for one in known:
            self._enter(one)
        if pose.whole or np.isfinite(self._raw[:, 0]).all():
            found += self._complete()
        return found

    def _nothing(self) -> Float:
        return np.full((len(self._index), 3), np.nan)

    def _require_markers(self, known: list[MarkerPlace], time_ns: int) -> None:
        for one in known:
            if one.turned:
                raise AcquisitionError(
                    "tracker.poses",
                    f"The tracker sends '{one.name}' as the pose of a tool, not as a marker: its "
                    "markers, and so the uncertainty of a tip, are unknown.",
                    "Let the device send its markers (points, strays, labelled markers), and name "
                    "these in the document of the tracker.",
                )
        if known and not time_ns:
            raise AcquisitionError(
                "tracker.no_time",
                "The tracker sends markers without a time stamp.",
                "Switch the time stamps of the sender on: the time of arrival is not that of the "
                "exposure.",
            )

    def _refuse_old(self, count: int, time_ns: int) -> list[MarkerFrame]:
        self._old_running += 1
        if time_ns == self._last_ns:
            self.account.doubled += count
            if self._old_running > _MOST_OLD:
                raise AcquisitionError(
                    "tracker.no_time",
                    "The time stamps of the tracker stand still.",
                    "Let the sender stamp each exposure with its own time.",
                )
            return []
        self.account.late += count
        if self._last_ns - time_ns > _RESTART_NS or self._old_running > _MOST_OLD:
            raise AcquisitionError(
                "tracker.clock_step",
                f"The clock of the tracker went back by {(self._last_ns - time_ns) * 1e-9:.3f} s: "
                "it was started again, or its time was set.",
                "Let the tracker warm up before the next point.",
            )
        return []

    def _enter(self, one: MarkerPlace) -> None:
        index, place = self._index[one.name], np.array(one.place)
        if np.isfinite(self._raw[index, 0]):
            self.account.doubled += 1
        elif (
            not np.isfinite(place).all()
            or not place.any()
            or np.abs(place * self._scale).max() > _FARTHEST
        ):
            self.account.missing += 1
        elif self._document.missing == "frozen" and np.array_equal(place, self._before[index]):
            self.account.repeated += 1
        else:
            self.account.used += 1
            self._raw[index] = place

    def _complete(self) -> list[MarkerFrame]:
        raw, time_ns = self._raw, self._open_ns
        self._raw, self._open_ns = self._nothing(), 0
        first = not self._last_ns
        step, self._last_ns = time_ns - self._last_ns, time_ns
        if not first:
            if step > _PAUSE_NS:
                raise AcquisitionError(
                    "tracker.clock_step",
                    f"The clock of the tracker went on by {step * 1e-9:.0f} s between two frames.",
                    "Let the tracker warm up before the next point.",
                )
            self.account.frames_lost += max(0, round(step / self._period_ns) - 1)
            self._require_rate(step)
        self.account.frames += 1
        seen = np.isfinite(raw[:, 0])
        if seen.any() and np.array_equal(raw, self._before, equal_nan=True):
            # Noise never repeats all coordinates: nothing was measured.
            count = int(np.count_nonzero(seen))
            self.account.used -= count
            self.account.repeated += count
            return [MarkerFrame(time_ns, self._nothing())]
        self._before = np.where(seen[:, None], raw, self._before)
        return [MarkerFrame(time_ns, raw * self._scale)]

    def _require_rate(self, step: int) -> None:
        self._steps.append(step)
        if len(self._steps) < _RATED:
            return
        usual = float(np.median(self._steps))
        self._steps.clear()
        if abs(usual / self._period_ns - 1.0) > _RATE_SHARE:
            raise AcquisitionError(
                "tracker.rate",
                f"The tracker sends {1e9 / usual:.1f} frames a second, and its document says "
                f"{self._document.frame_rate_hz}.",
                "Correct 'frame_rate_hz' in the document, or the rate of the device.",
            )


_GATE = 6.0
"""Standard deviations of a marker, for distances and residuals."""
_APART = 3.0
"""A mirrored body fits worse than the body by this factor."""
_WRONG_UNIT = 50.0
_MOST_MARKERS = 10
LEAST_MARKERS = 4


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
    if len(best) < LEAST_MARKERS:
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
