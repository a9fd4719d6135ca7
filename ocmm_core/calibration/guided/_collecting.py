"""Average resting targets and poses of a moving probe, or give the reason why not."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided._procedure import CameraLive, Live
from ocmm_core.calibration.guided._shot_table import label_roughly
from ocmm_core.camera import USUAL_SLOTS, Rig, independent_share
from ocmm_core.geometry import Float, Int, Pixels
from ocmm_core.tracking import IdentifyOptions, ProbeBody, identify, ordered_spots, solve

STILL_FRAMES = 100
"""As many as a measured point: noise of single exposures falls to a tenth."""

_WAVED_FRAMES, _WAVED_S = 8, 4e-3
"""Most frames of a waved probe, within a time in which it moves evenly."""

_SAME_PX = 1.0
_SETTLED_PX = 0.02
_SETTLED_MM = 0.02
_SIGMAS = 6.0
_REST_S = 0.1
"""Longer than the standstill of a hand that reverses."""

_MOST_TIP_SIGMA_MM = 0.06
"""Of a resting ball; more of the probe must be seen for it to be less. Trackers state theirs."""

_ENOUGH_SPOTS = 4
_SHOW = "Show the whole probe to all cameras: its LEDs are not recognised yet."
AVERAGING = "Hold still: averaging."
PLACE_DONE = "This place is done: move to the next one."
STRANGE = (
    "The visible lights are not those of the probe: cover other lights, use the selected probe, "
    "or relocate the cameras if they have moved since the calibration."
)
_TURN = "Turn the probe so that the cameras see more of its LEDs."

_OUTSIDE_MM = 60.0
"""Farther outside the calibrated volume the lens model is only extrapolated."""

_INSIDE = (
    "LEDs are outside the calibrated volume: hold the probe so that its handle points into it."
)
_LABEL_EVERY_NS = 20_000_000


def waved_frames(rig: Rig) -> int:
    """Return the frames to average of a waved probe: the mean is then its place in the middle.

    A tracker is slow: already two of its frames have their mean inside the arc of a waved marker.
    """
    least = 2 if rig.markers is None else 1
    return int(np.clip(round(_WAVED_S * rig.frame_rate_hz), least, _WAVED_FRAMES))


@dataclass(frozen=True, slots=True)
class Average:
    """Mean of some frames."""

    uv: Pixels
    """(C, n, 2), px: by spot or LED; NaN unless seen in every frame."""
    sigma_px: float
    """Standard deviation of one mean, px per axis."""


def sigma_of_mean(rig: Rig, frames: int) -> float:
    """Return the standard deviation of the mean of resting spots, px per axis."""
    filtered = 0.0 if rig.markers is None else rig.markers.document.noise.correlation
    independent = frames * independent_share(filtered)
    return float(np.hypot(rig.noise.white_px / np.sqrt(independent), rig.noise.pattern_px))


@dataclass(slots=True)
class _Window:
    size: int
    counter: Int = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    uv: Float = field(default_factory=lambda: np.empty((0, 0, USUAL_SLOTS, 2)))

    def push(self, block: FrameBlock) -> None:
        """Add frames; a gap in them starts a new window."""
        counter, uv = block.counter[-self.size :], block.uv[-self.size :]
        if len(self.counter) and counter[0] == self.counter[-1] + 1:
            counter = np.concatenate([self.counter, counter])[-self.size :]
            uv = np.concatenate([self.uv, uv])[-self.size :]
        breaks = np.flatnonzero(np.diff(counter) != 1)
        start = int(breaks[-1]) + 1 if len(breaks) else 0
        self.counter, self.uv = counter[start:], uv[start:]

    @property
    def full(self) -> bool:
        return len(self.counter) == self.size


class StaticSpotAverager:
    """Averages ``count`` bright points that rest, identified only by place.

    ``frames`` more must show rest before: the slow last part of a motion would bias the average.
    """

    def __init__(self, rig: Rig, count: int, frames: int = STILL_FRAMES) -> None:
        self._rig = rig
        self._count = count
        self._frames = frames
        self._window = _Window(2 * frames)
        self._taken: Average | None = None
        self._judged: Live | None = None

    def push(self, block: FrameBlock) -> None:
        if len(block):
            self._judged = None
            self._window.push(block)

    def taken(self, average: Average) -> None:
        """Remember a recorded average: the same place is not ready again."""
        self._judged = None
        self._taken = average

    def average(self) -> Average:
        """Return the mean of the window; NaN for a camera that missed a point."""
        uv = np.full((len(self._rig.cameras), self._count, 2), np.nan)
        for camera, slots in enumerate(self._slots()):
            if len(slots) == self._count:
                uv[camera] = self._window.uv[-self._frames :, camera, slots].mean(axis=0)
        return Average(uv, sigma_of_mean(self._rig, self._frames))

    def live(self) -> Live:
        """Return the current view and whether it can be recorded."""
        if self._judged is None:
            self._judged = self._live()
        return self._judged

    def _live(self) -> Live:
        window = self._window
        if not len(window.counter):
            return Live(wanted=window.size)
        slots = self._slots()
        motion = self._motion(slots)
        hint = self._hint(slots, motion)
        return Live(
            cameras=tuple(
                CameraLive(camera.name, uv, np.full(len(uv), -1, dtype=np.int64))
                for camera, uv in zip(self._rig.cameras, _bright(window.uv[-1]), strict=True)
            ),
            ready=not hint,
            hint=hint,
            frames=len(window.counter),
            wanted=window.size,
            motion_px=motion,
        )

    def _slots(self) -> list[Int]:
        """Return the slots of each camera that held a spot in every frame of the window."""
        there = np.asarray(np.isfinite(self._window.uv).all(axis=(0, 3)))
        return [np.flatnonzero(of_camera).astype(np.int64) for of_camera in there]

    def _motion(self, slots: list[Int]) -> float:
        """Return the distance between the means of both halves of the window, px."""
        half = len(self._window.uv) // 2
        if not half:
            return float("nan")
        moves = [
            np.linalg.norm(
                self._window.uv[half:, c, seen].mean(axis=0)
                - self._window.uv[:half, c, seen].mean(axis=0),
                axis=1,
            )
            for c, seen in enumerate(slots)
        ]
        return float(np.max(np.concatenate(moves), initial=0.0))

    def _hint(self, slots: list[Int], motion: float) -> str:
        names = [camera.name for camera in self._rig.cameras]
        crowded = [name for name, seen in zip(names, slots, strict=True) if len(seen) > self._count]
        if crowded:
            return (
                f"Camera '{crowded[0]}' sees more than the target: cover other lights and "
                f"reflections."
            )
        views = sum(len(seen) == self._count for seen in slots)
        if views < min(2, len(names)):
            blind = next(
                name for name, seen in zip(names, slots, strict=True) if len(seen) != self._count
            )
            return f"Camera '{blind}' does not see the target: move it into the view."
        if not self._window.full:
            return AVERAGING
        limit = _SETTLED_PX + _SIGMAS * self._rig.noise.white_px * np.sqrt(2.0 / self._frames)
        if motion > limit:
            return f"The target moves by {motion:.2f} px: wait until it is at rest."
        return PLACE_DONE if self._taken is not None and not self._has_moved(self._taken) else ""

    def _has_moved(self, taken: Average) -> bool:
        apart = self.average().uv[:, :, None] - taken.uv[:, None]
        nearest = np.linalg.norm(apart, axis=3).min(axis=2)
        return bool(np.nanmax(nearest, initial=0.0) > _SAME_PX)


class ProbeSpotAverager:
    """Averages the probe's labelled spots, at rest or in motion.

    ``resting``: the ball must rest for `_REST_S`, ``distance_mm`` away from the last one recorded.
    Waved: it must move by ``distance_mm`` or turn by ``turn_rad``. ``inside``: the LEDs must be in
    or near the calibrated volume. ``moved``: find labels without the cameras' poses, which have
    changed.
    """

    def __init__(
        self,
        rig: Rig,
        body: ProbeBody,
        frames: int,
        *,
        resting: bool,
        distance_mm: float,
        turn_rad: float = np.inf,
        inside: bool = False,
        moved: bool = False,
    ) -> None:
        self._rig, self._body = rig, body
        self._frames = frames
        rest = round(_REST_S * rig.frame_rate_hz / frames) if resting else 1
        self._parts = max(min(2, frames), rest)
        self._window = _Window(self._parts * frames if resting else frames)
        self._resting, self._inside, self._moved = resting, inside, moved
        self._distance_mm, self._turn_rad = distance_mm, turn_rad
        self._slot_of_led: Int | None = None
        self._label_at_ns = 0
        self._before: tuple[Float, Float] | None = None
        self._judged: Live | None = None

    def push(self, block: FrameBlock) -> None:
        if not len(block):
            return
        self._judged = None
        self._window.push(block)
        if self._slot_of_led is not None:
            self._drop_labels(self._slot_of_led, block)
        self._find_labels(int(block.time_ns[-1]))

    def taken(self, average: Average) -> None:
        """Remember a recorded average: the next one must be elsewhere."""
        pose = solve(average.uv[None], self._rig, self._body, average.sigma_px)
        self._judged = None
        self._before = pose.rotation_world_from_probe[0], pose.tip_world[0]

    def average(self) -> Average:
        """Return the mean of the last frames by LED, (C, L, 2)."""
        spots = self.spots()[-self._frames :]
        return Average(spots.mean(axis=0), sigma_of_mean(self._rig, self._frames))

    def spots(self) -> Pixels:
        """Return the spots of the window by LED, (n, C, L, 2), px; NaN if not seen."""
        assert self._slot_of_led is not None  # noqa: S101 - only asked for when ready
        return ordered_spots(self._window.uv, self._slot_of_led)

    def live(self) -> Live:
        """Return the current view and whether it can be recorded."""
        # Cached: a procedure polls this several times between two blocks of frames.
        if self._judged is None:
            self._judged = self._live()
        return self._judged

    def _live(self) -> Live:
        window = self._window
        if not len(window.counter):
            return Live(wanted=window.size)
        hint, motion = self._judge()
        return Live(
            cameras=self._cameras(), ready=not hint, hint=hint, frames=len(window.counter),
            wanted=window.size, motion_px=motion,
        )  # fmt: skip

    def _cameras(self) -> tuple[CameraLive, ...]:
        led_of_slot = np.full(self._window.uv.shape[1:3], -1, dtype=np.int64)
        if self._slot_of_led is not None:
            for camera, led in np.argwhere(self._slot_of_led >= 0):
                led_of_slot[camera, self._slot_of_led[camera, led]] = led
        latest = self._window.uv[-1]
        seen = np.isfinite(latest).all(axis=2)
        return tuple(
            CameraLive(camera.name, latest[c, seen[c]], led_of_slot[c, seen[c]])
            for c, camera in enumerate(self._rig.cameras)
        )

    def _judge(self) -> tuple[str, float]:
        """Return why the window cannot be recorded (empty if it can), and its motion, px."""
        if self._slot_of_led is None:
            counts = np.isfinite(self._window.uv[-1, :, :, 0]).sum(axis=1)
            return (STRANGE if np.sort(counts)[-2] >= _ENOUGH_SPOTS else _SHOW), np.nan
        spots = ordered_spots(self._window.uv, self._slot_of_led)
        seen = np.isfinite(spots).all(axis=(0, 3))
        if np.count_nonzero(seen.sum(axis=0) >= 2) < 3:
            return "Fewer than three LEDs are seen by two cameras: turn the probe to them.", np.nan
        if not self._window.full:
            return AVERAGING, np.nan
        part = len(spots) // self._parts
        means = spots.reshape(self._parts, part, *spots.shape[1:]).mean(axis=1)
        motion = float(np.nanmax(np.linalg.norm(means - means[-1], axis=3)))
        pose = solve(means, self._rig, self._body, self._rig.noise.white_px)
        if np.any(pose.status):
            return _TURN, motion
        if self._resting:
            share = sigma_of_mean(self._rig, self._frames) / self._rig.noise.white_px
            variance = float(np.linalg.eigvalsh(pose.tip_covariance[-1])[-1])
            if not self._rig.markers and share * np.sqrt(variance) > _MOST_TIP_SIGMA_MM:
                return _TURN, motion
            if self._inside and self._outside(
                pose.rotation_world_from_probe[-1], pose.origin_world[-1]
            ):
                return _INSIDE, motion
            drift = float(np.linalg.norm(pose.tip_world - pose.tip_world[-1], axis=1).max())
            sigma = np.sqrt(np.trace(pose.tip_covariance[-1]) * 2.0 / part)
            if drift > _SETTLED_MM + _SIGMAS * sigma:
                return f"The ball moves by {drift:.2f} mm: wait until it is at rest.", motion
        return self._too_near(pose.rotation_world_from_probe[-1], pose.tip_world[-1]), motion

    def _outside(self, rotation: Float, origin: Float) -> bool:
        leds = self._body.leds_probe @ rotation.T + origin
        low, high = self._rig.volume_world
        return bool(np.maximum(low - leds, leds - high).max() > _OUTSIDE_MM)

    def _too_near(self, rotation: Float, tip: Float) -> str:
        if self._before is None:
            return ""
        far = np.linalg.norm(tip - self._before[1]) > self._distance_mm
        cosine = 0.5 * (np.trace(self._before[0].T @ rotation) - 1.0)
        turned = np.arccos(np.clip(cosine, -1.0, 1.0)) > self._turn_rad
        if far or turned:
            return ""
        return PLACE_DONE if self._resting else "Keep moving and turning the probe."

    def _drop_labels(self, slot_of_led: Int, block: FrameBlock) -> None:
        """Drop the labels of slots that were empty in any frame: they may hold another LED."""
        there = np.asarray(np.isfinite(block.uv).all(axis=(0, 3)))
        cameras = np.arange(len(slot_of_led))[:, None]
        kept = np.where((slot_of_led >= 0) & there[cameras, slot_of_led], slot_of_led, -1)
        self._slot_of_led = kept if np.any(kept >= 0) else None

    def _find_labels(self, now_ns: int) -> None:
        latest = self._window.uv[-1]
        spots = np.count_nonzero(np.isfinite(latest[..., 0]))
        known = 0 if self._slot_of_led is None else np.count_nonzero(self._slot_of_led >= 0)
        if known >= spots or now_ns < self._label_at_ns:
            return
        self._label_at_ns = now_ns + _LABEL_EVERY_NS
        noise = self._rig.noise
        options = IdentifyOptions(float(np.hypot(noise.white_px, noise.pattern_px)))
        found = identify(self._rig, self._body, latest, options).slot_of_led
        if found is None and self._moved:
            found = label_roughly(self._rig, self._body, latest)
        if found is not None:
            self._slot_of_led = found


def _bright(uv: Float) -> list[Pixels]:
    return [of_camera[np.isfinite(of_camera).all(axis=1)] for of_camera in uv]
