"""The live snapshot: current state of machine and reference body, and trust in it."""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import replace

import numpy as np

from ocmm_core import measuring
from ocmm_core.acquisition.frames import AcquisitionState, AcquisitionStatus, FrameBlock, StopReason
from ocmm_core.camera import USUAL_SLOTS, Rig
from ocmm_core.coach import Sensitivities
from ocmm_core.errors import TrackingError
from ocmm_core.fieldbus.report import BusPhase, trouble_words
from ocmm_core.geometry import Float, Int
from ocmm_core.inspection.evaluation import LiveView, ReferenceView, StatusWord
from ocmm_core.station._bus_watch import SILENCE_S, BusWatch
from ocmm_core.station.coaching import LastPose, ProbeNow
from ocmm_core.tracking import (
    FrameStatus,
    ProbeBody,
    ReferenceBody,
    TipSensitivity,
    TrackBlock,
    TrackingPipeline,
    in_rig,
    relative_sensitivities,
    tip_sensitivities,
)


def reference_view(
    track: TrackBlock, pipeline: TrackingPipeline, reference: ReferenceBody
) -> ReferenceView:
    """Return the state of the reference body after the latest frame."""
    seen, home = track.reference, pipeline.home
    cameras = np.zeros(reference.n_leds)
    if seen is not None:
        cameras = np.count_nonzero(np.isfinite(seen.body.uv[-1, :, :, 0]), axis=0)
    moved_mm, turned_rad = pipeline.reference_motion or (None, None)
    leds = reference.leds.leds_body
    return ReferenceView(
        name=reference.name,
        n_leds=reference.n_leds,
        seen=int(np.count_nonzero(cameras >= 2)),
        moved_mm=moved_mm,
        turned_rad=turned_rad,
        leds_world=home.T_rig_from_reference.apply(leds) if home is not None else None,
    )


def judge_reference(
    track: TrackBlock, pipeline: TrackingPipeline, rig: Rig
) -> tuple[StatusWord, str]:
    """Return word and sentence for frames without a pose of the reference body."""
    seen = track.reference
    if seen is None:
        return StatusWord.NOT_READY, "Waiting for the cameras."
    status = FrameStatus(int(seen.body.status[-1]))
    if status is FrameStatus.OK:
        return StatusWord.NOT_READY, f"The reference body: {pipeline.reference_reason}."
    if status is FrameStatus.UNIDENTIFIED:
        return (
            StatusWord.LOST,
            f"The reference body is not recognised: {pipeline.reference_reason}.",
        )
    if status is FrameStatus.DOUBTFUL:
        return StatusWord.INACCURATE, "The spots do not fit the reference body."
    return StatusWord.LOST, measuring.explain_reference(seen, rig, 0.0).what


_STALE_S = 0.3
"""Tracking with a larger lag shows the past, even if the cameras deliver."""

_WAITS_S = 2.0
"""A source that waits for its reader may be delayed for a while; after this it stopped."""

_SHOWN_FRAMES = 80
"""The live position is the mean of the latest frames, 10 ms at 8 kHz."""

_SEEN_SHARE = 0.5
"""A spot in fewer of these frames is not seen: it flickers at the rim of its cone."""

_UNCERTAINTY_EVERY_S = 0.2
"""The uncertainty changes slowly and costs milliseconds: at most five times a second."""


class LiveState:
    """State of the latest frames; fed by the reconstruction thread, read by any other.

    `bus`: set if frames are pushed, so that silence is a fault; else None.
    """

    def __init__(
        self,
        rig: Rig,
        body: ProbeBody,
        options: measuring.PointOptions,
        bus: BusWatch | None,
        reference: ReferenceBody | None = None,
    ) -> None:
        self._rig = rig
        self._body = body
        self._options = options
        self._bus = bus
        self._no_spots = np.full((len(rig.cameras), USUAL_SLOTS, 2), np.nan)
        self._no_labels = np.full((len(rig.cameras), USUAL_SLOTS), -1, dtype=np.int64)
        self._raw: FrameBlock | None = None
        self._track: TrackBlock | None = None
        self._labels: Int = self._no_labels
        self._reference = reference
        self._references: Int | None = None
        self._reference_view: ReferenceView | None = None
        self._reference_lost = (StatusWord.NOT_READY, "")
        self._reason = ""
        self._collecting = False
        self._path: measuring.PathProgress | None = None
        self._uncertainty: float | None = None
        self._uncertainty_at = -np.inf
        self._uncertainty_lock = threading.Lock()
        self._last_good: tuple[TrackBlock, int] | None = None
        self._good_at = -np.inf
        self._fed_at = -np.inf
        self._disturbed_at = -np.inf
        self._rate: deque[tuple[int, int]] = deque()

    def push(
        self,
        raw: FrameBlock,
        track: TrackBlock,
        pipeline: TrackingPipeline,
        *,
        collecting: bool,
        path: measuring.PathProgress | None = None,
    ) -> None:
        """Process the latest frames (reconstruction thread only)."""
        now = time.monotonic()
        self._raw, self._labels, self._reason = raw, pipeline.slot_leds(), pipeline.reason
        self._collecting, self._path = collecting, path
        if self._rate and int(raw.time_ns[-1]) < self._rate[-1][0]:
            # The bus clock was reset.
            self._rate.clear()
        self._rate.append((int(raw.time_ns[-1]), len(raw)))
        while self._rate[-1][0] - self._rate[0][0] > 1_000_000_000:
            self._rate.popleft()
        good = np.flatnonzero(track.status == FrameStatus.OK)
        if len(good):
            self._last_good = (track, int(good[-1]))
            if now - self._good_at > _UNCERTAINTY_EVERY_S:
                # Lost for a while: the cached uncertainty is that of another place.
                self._uncertainty_at = -np.inf
            self._good_at = now
        if self._reference is not None:
            self._references = pipeline.slot_references()
            self._reference_view = reference_view(track, pipeline, self._reference)
            if track.status[-1] == FrameStatus.REFERENCE_LOST:
                self._reference_lost = judge_reference(track, pipeline, self._rig)
        self._track = track
        self._fed_at = now

    def view(
        self, acquisition: AcquisitionStatus, blocker: str, faults: tuple[str, ...] = ()
    ) -> LiveView:
        """Return the snapshot; thread-safe. `blocker`: why the calibration forbids points."""
        raw, track, rate = self._raw, self._track, list(self._rate)
        spots, labels, reference = self._no_spots, self._labels, self._reference_view
        if raw is not None:
            spots = raw.uv[-1]
        if not self._comes(acquisition):
            # Stale: neither spots nor a rate stay on the screen.
            spots, labels, rate = np.full_like(spots, np.nan), np.full_like(labels, -1), []
            reference = replace(reference, seen=0) if reference is not None else None
        self._renew_uncertainty()
        word, reason = self._judge(acquisition, track, blocker)
        trusted = word in (StatusWord.READY, StatusWord.MEASURING) and track is not None
        shown = None
        if trusted and track is not None:
            latest = slice(-_SHOWN_FRAMES, None)
            good = track.status[latest] == FrameStatus.OK
            shown = track.tip_world[latest][good].mean(axis=0)
        return LiveView(
            status=word,
            reason=reason,
            tip_world=shown,
            tip_uncertainty=self._uncertainty if shown is not None else None,
            rotation_world_from_probe=(
                track.rotation_world_from_probe[-1] if shown is not None and track else None
            ),
            origin_world=track.origin_world[-1] if shown is not None and track else None,
            spots=spots,
            slot_leds=labels,
            frame_counter=int(raw.counter[-1]) if raw is not None else -1,
            time_s=float(raw.time_ns[-1]) * 1e-9 if raw is not None else 0.0,
            frames_per_second=_frames_per_second(rate),
            acquisition=acquisition,
            slot_references=self._references,
            reference=reference,
            faults=faults,
            path=self._path if shown is not None else None,
        )

    def _comes(self, acquisition: AcquisitionStatus) -> bool:
        """Return whether frames arrive, so that the last ones are current."""
        limit_s = _WAITS_S if self._bus is None else _STALE_S
        running = acquisition.state is not AcquisitionState.STOPPED
        return running and time.monotonic() - self._fed_at <= limit_s

    def probe_now(self) -> ProbeNow | None:
        """Return the last state of the probe; thread-safe; None before frames, if late, silent."""
        track, latest = self._track, self._last_good
        if track is None or time.monotonic() - self._fed_at > _STALE_S:
            return None
        status = FrameStatus(int(track.status[-1]))
        recent = track.uv[-_SHOWN_FRAMES:, ..., 0]
        seen = np.isfinite(recent).mean(axis=0) >= _SEEN_SHARE
        named = status is not FrameStatus.UNIDENTIFIED
        lost = status is FrameStatus.LOST or not named
        if latest is None:
            return ProbeNow(False, lost, named, seen, None)
        good, frame = latest
        own = in_rig(good)
        spots = good.uv[frame]
        # Outside the calibrated volume the uncertainty of the ball is unknown.
        is_good = status is FrameStatus.OK and self._is_inside(own.tip_world[frame])
        last = LastPose(
            own.rotation_world_from_probe[frame], own.tip_world[frame], spots,
            self._sensitivities_at(good, frame),
        )  # fmt: skip
        if is_good:
            seen = np.isfinite(spots[..., 0])
        return ProbeNow(is_good, lost, named, seen, last)

    def failed(
        self, acquisition: AcquisitionStatus, reason: str, faults: tuple[str, ...] = ()
    ) -> LiveView:
        """Return an empty snapshot without computation."""
        return LiveView(
            status=StatusWord.FAILED,
            reason=reason,
            tip_world=None,
            tip_uncertainty=None,
            rotation_world_from_probe=None,
            origin_world=None,
            spots=self._no_spots,
            slot_leds=self._no_labels,
            frame_counter=-1,
            time_s=0.0,
            frames_per_second=0.0,
            acquisition=acquisition,
            faults=faults,
        )

    def _judge(
        self, acquisition: AcquisitionStatus, track: TrackBlock | None, blocker: str
    ) -> tuple[StatusWord, str]:
        if acquisition.internal:
            return StatusWord.FAILED, acquisition.message
        if acquisition.stop_reason is StopReason.FAILED:
            return StatusWord.NOT_READY, acquisition.message or "Acquisition failed."
        if acquisition.state is AcquisitionState.STOPPED:
            return StatusWord.NOT_READY, "Acquisition stopped."
        if self._bus is not None:
            trouble = self._trouble_of(self._bus, acquisition)
            if trouble:
                return StatusWord.NOT_READY, trouble
        if blocker:
            return StatusWord.NOT_READY, blocker
        if track is None:
            detail = f" ({reason})" if (reason := acquisition.message) else ""
            return StatusWord.NOT_READY, f"Waiting for the cameras{detail}."
        if not self._comes(acquisition):
            return StatusWord.NOT_READY, "No new frames from the cameras."
        status = FrameStatus(int(track.status[-1]))
        if status is FrameStatus.REFERENCE_LOST:
            return self._reference_lost
        if status is FrameStatus.LOST:
            return StatusWord.LOST, measuring.explain(track, self._rig, 0.0).what
        if status is FrameStatus.UNIDENTIFIED:
            return StatusWord.LOST, f"LED identification is ambiguous: {self._reason}."
        if status is FrameStatus.DOUBTFUL:
            return StatusWord.INACCURATE, "The spots do not fit the probe."
        return self._judge_tip(in_rig(track).tip_world[-1])

    def _trouble_of(self, bus: BusWatch, acquisition: AcquisitionStatus) -> str:
        """Return why data from the bus cannot be trusted now, or an empty text."""
        now = time.monotonic()
        report = bus.report()
        if report is not None and report.phase is not BusPhase.OPERATION:
            self._disturbed_at = now
            return " ".join(trouble_words(report)).strip()
        silence_s = bus.silence_s()
        silent = silence_s is not None and silence_s > SILENCE_S
        self._disturbed_at = now if silent else self._disturbed_at
        if silent or (now - self._fed_at > _STALE_S and self._track is not None):
            detail = f" ({reason})" if (reason := acquisition.message) else ""
            return f"No new frames from the cameras{detail}."
        # The last tracked frames precede the disturbance until new ones were processed.
        return "Waiting for the cameras." if self._fed_at < self._disturbed_at else ""

    def _judge_tip(self, tip_rig: Float) -> tuple[StatusWord, str]:
        if not self._is_inside(tip_rig):
            return StatusWord.INACCURATE, "The ball is outside the calibrated volume."
        limit = self._options.max_uncertainty
        if self._uncertainty is None or self._uncertainty > limit:
            return (
                StatusWord.INACCURATE,
                f"The position uncertainty exceeds {limit:.3f} mm here: turn the probe so that "
                "both cameras see more LEDs.",
            )
        return (StatusWord.MEASURING if self._collecting else StatusWord.READY), ""

    def _is_inside(self, tip_rig: Float) -> bool:
        low, high = self._rig.volume_world
        return bool(np.all(tip_rig >= low) and np.all(tip_rig <= high))

    def _renew_uncertainty(self) -> None:
        """Renew an old uncertainty of the last good frame, on the reader's thread.

        Frames never wait for it, and without readers nothing is computed.
        """
        latest, now = self._last_good, time.monotonic()
        if latest is None or now - self._uncertainty_at <= _UNCERTAINTY_EVERY_S:
            return
        if not self._uncertainty_lock.acquire(blocking=self._uncertainty_at == -np.inf):
            return
        try:
            if now - self._uncertainty_at > _UNCERTAINTY_EVERY_S:
                self._uncertainty = self._uncertainty_of(*latest)
                self._uncertainty_at = time.monotonic()
        finally:
            self._uncertainty_lock.release()

    def _uncertainty_of(self, track: TrackBlock, frame: int) -> float | None:
        try:
            (sensitivity,) = self._sensitivities_at(track, frame)(track.uv[frame][None])
        except TrackingError:
            return None
        return measuring.point_uncertainty(sensitivity, self._rig, self._body)

    def _sensitivities_at(self, track: TrackBlock, frame: int) -> Sensitivities:
        """Return the sensitivities of the ball to spots, relative to the reference body."""
        rig, body, about, seen = self._rig, self._body, self._reference, track.reference
        if about is None or seen is None or seen.home is None:
            return lambda spots: tip_sensitivities(spots, rig, body)
        home, leds = seen.home, seen.body.uv[frame]

        def relative(spots: Float) -> tuple[TipSensitivity, ...]:
            there = np.repeat(leds[None], len(spots), axis=0)
            return relative_sensitivities(spots, there, home, rig, body, about)

        return relative


def _frames_per_second(rate: list[tuple[int, int]]) -> float:
    if len(rate) < 2:
        return 0.0
    span_s = (rate[-1][0] - rate[0][0]) * 1e-9
    return sum(count for _, count in rate[1:]) / span_s if span_s > 0.0 else 0.0
