"""Blocks of frames in, tracked frames out: labels, pose, tip, and a status for every frame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.camera.rig import MAX_SLOTS, Rig
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.body import ProbeBody, satisfies_rules
from ocmm_core.tracking.identify import (
    IdentifyOptions,
    chi2_limit,
    identify,
    nearest_slots,
    ordered_spots,
)
from ocmm_core.tracking.pose import Method, solve
from ocmm_core.tracking.result import FrameStatus, TrackBlock, join

_EXTEND_GATE_PX = 2.0
"""A spot that is offered to a free LED lies this close to where the LED must be, px."""


@dataclass(frozen=True, slots=True)
class TrackingOptions:
    """How frames are tracked.

    Attributes
    ----------
    method
        See `pose.solve`.
    relabel_after
        Consecutive doubtful frames after which the labels are thrown away and sought anew.
    retry_every
        Frames between two searches for labels while nothing can be identified.
    extend_every
        Every so many exposures, spots that no label claims yet are offered to the free LEDs.
    """

    method: Method = "gauss-newton"
    relabel_after: int = 40
    retry_every: int = 40
    extend_every: int = 400


@dataclass(slots=True)
class TrackingPipeline:
    """Track a stream of frames with one rig and one probe.

    Holds the labels of the slots between blocks and nothing else; used by one thread. Where the
    labels come into being does not depend on how the stream is cut into blocks.

    Attributes
    ----------
    rig, body, options
        What to track with.
    slot_of_led
        (C, L): current labels, None while nothing is identified.
    reason
        Why nothing is identified, in words; empty otherwise.
    """

    rig: Rig
    body: ProbeBody
    options: TrackingOptions = field(default_factory=TrackingOptions)
    slot_of_led: Int | None = None
    reason: str = "no frame has arrived yet"
    _wait: int = 0
    _doubtful: int = 0

    @property
    def sigma_px(self) -> float:
        """Return the standard deviation of one spot of one frame, px."""
        noise = self.rig.noise
        return float(np.hypot(noise.white_px, noise.pattern_px))

    def slot_leds(self) -> Int:
        """Return the LED that each slot follows, (C, 8), -1 where unknown."""
        leds = np.full((len(self.rig.cameras), MAX_SLOTS), -1, dtype=np.int64)
        if self.slot_of_led is not None:
            for camera, led in np.argwhere(self.slot_of_led >= 0):
                leds[camera, self.slot_of_led[camera, led]] = led
        return leds

    def process(self, block: FrameBlock) -> TrackBlock:
        """Return what the frames of ``block`` say."""
        pieces: list[TrackBlock] = []
        start = 0
        while start < len(block):
            if self.slot_of_led is None:
                start = self._search(block, start, pieces)
            else:
                start = self._follow(block, start, self.slot_of_led, pieces)
        return pieces[0] if len(pieces) == 1 else join(pieces)

    def _search(self, block: FrameBlock, start: int, pieces: list[TrackBlock]) -> int:
        end = start
        while end < len(block):
            if self._wait > 0:
                self._wait -= 1
                end += 1
                continue
            found = identify(
                self.rig, self.body, block.uv[end], IdentifyOptions(sigma_px=self.sigma_px)
            )
            self.slot_of_led, self.reason = found.slot_of_led, found.reason
            self._doubtful = 0
            if self.slot_of_led is not None:
                break
            self._wait = self.options.retry_every
        if end > start:
            pieces.append(self._unidentified(block, start, end))
        return end

    def _follow(self, block: FrameBlock, start: int, labels: Int, pieces: list[TrackBlock]) -> int:
        self.slot_of_led = labels = self._extended(block, start, labels)
        stop = self._next_extension(block, start, labels)
        uv = ordered_spots(block.uv[start:stop], labels)
        batch = solve(uv, self.rig, self.body, self.sigma_px, self.options.method)
        status = batch.status.copy()
        # Labels exchanged while nobody looked (lost frames) may fit a symmetric body: rules tell.
        with np.errstate(invalid="ignore"):
            wrong = (batch.chi2 > chi2_limit(batch.dof)) | ~satisfies_rules(
                self.body, batch.rotation_world_from_probe
            )
        status[(status == FrameStatus.OK) & wrong] = FrameStatus.DOUBTFUL
        seen = np.asarray(np.isfinite(uv).all(axis=3))
        # A slot that lost its LED may come back on another one: labels live while any is followed.
        dark = np.flatnonzero(~seen.reshape(len(seen), -1).any(axis=1))
        end = int(dark[0]) if len(dark) else len(status)
        end = min(end, self._end_of_trust(status))
        if end < len(status):
            self.slot_of_led, self._wait = None, 0
            self.reason = "all targets are hidden" if len(dark) else "the labels went wrong"
        if end == 0:
            return start
        part = slice(0, end)
        good = status[part] == FrameStatus.OK
        pieces.append(
            TrackBlock(
                counter=block.counter[start : start + end],
                time_ns=block.time_ns[start : start + end],
                flags=block.flags[start : start + end],
                status=status[part],
                tip_world=_where(good, batch.tip_world[part]),
                tip_covariance=_where(good, batch.tip_covariance[part]),
                rotation_world_from_probe=_where(good, batch.rotation_world_from_probe[part]),
                origin_world=_where(good, batch.origin_world[part]),
                chi2=batch.chi2[part],
                dof=batch.dof[part],
                seen=_bits(seen[part]),
                uv=uv[part],
            )
        )
        return start + end

    def _extended(self, block: FrameBlock, start: int, labels: Int) -> Int:
        """Return the labels, after free LEDs were given to unclaimed spots where that is due."""
        if block.counter[start] % self.options.extend_every or labels.min() >= 0:
            return labels
        spots = block.uv[start]
        unclaimed = spots.copy()
        for camera, slots in enumerate(labels):
            unclaimed[camera, slots[slots >= 0]] = np.nan
        if not np.isfinite(unclaimed).any():
            return labels
        pose = solve(ordered_spots(spots[None], labels), self.rig, self.body, self.sigma_px)
        if pose.status[0] != FrameStatus.OK or pose.chi2[0] > chi2_limit(pose.dof)[0]:
            return labels
        rotation, origin = pose.rotation_world_from_probe[0], pose.origin_world[0]
        near = nearest_slots(self.rig, self.body, unclaimed, rotation, origin, _EXTEND_GATE_PX)
        more = np.where(labels < 0, near, labels)
        pose = solve(ordered_spots(spots[None], more), self.rig, self.body, self.sigma_px)
        return more if pose.chi2[0] <= chi2_limit(pose.dof)[0] else labels

    def _next_extension(self, block: FrameBlock, start: int, labels: Int) -> int:
        """Return where labels may change next: the same frame however the stream is cut."""
        if labels.min() >= 0:
            return len(block)
        due = np.flatnonzero(block.counter[start + 1 :] % self.options.extend_every == 0)
        return start + 1 + int(due[0]) if len(due) else len(block)

    def _end_of_trust(self, status: NDArray[np.uint8]) -> int:
        """Return the index at which too many doubtful frames have followed each other."""
        if not np.any(status == FrameStatus.DOUBTFUL):
            self._doubtful = 0
            return len(status)
        for index, value in enumerate(status):
            self._doubtful = self._doubtful + 1 if value == FrameStatus.DOUBTFUL else 0
            if self._doubtful > self.options.relabel_after:
                return index
        return len(status)

    def _unidentified(self, block: FrameBlock, start: int, end: int) -> TrackBlock:
        n, shape = end - start, (len(self.rig.cameras), self.body.n_leds)
        spots = np.count_nonzero(np.isfinite(block.uv[start:end]).all(axis=3), axis=2)
        enough = np.count_nonzero(spots >= 3, axis=1) >= 2
        return TrackBlock(
            counter=block.counter[start:end],
            time_ns=block.time_ns[start:end],
            flags=block.flags[start:end],
            status=np.where(enough, FrameStatus.UNIDENTIFIED, FrameStatus.LOST).astype(np.uint8),
            tip_world=np.full((n, 3), np.nan),
            tip_covariance=np.full((n, 3, 3), np.nan),
            rotation_world_from_probe=np.full((n, 3, 3), np.nan),
            origin_world=np.full((n, 3), np.nan),
            chi2=np.full(n, np.nan),
            dof=np.zeros(n, dtype=np.int64),
            seen=np.zeros((n, shape[0]), dtype=np.uint16),
            uv=np.full((n, *shape, 2), np.nan),
        )


def _where(good: NDArray[np.bool_], values: Float) -> Float:
    if good.all():
        return values
    values = values.copy()
    values[~good] = np.nan
    return values


def _bits(seen: NDArray[np.bool_]) -> NDArray[np.uint16]:
    weights = (1 << np.arange(seen.shape[2])).astype(np.uint16)
    bits: NDArray[np.uint16] = (seen * weights).sum(axis=2).astype(np.uint16)
    return bits
