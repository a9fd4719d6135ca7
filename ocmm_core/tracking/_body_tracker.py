"""Tracking of one body through blocks of frames: labels, pose, and status."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.camera import USUAL_SLOTS, Rig
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking._body import LedBody, satisfies_rules
from ocmm_core.tracking._identify import (
    IdentifyOptions,
    chi2_limit,
    extended_labels,
    identify,
    ordered_spots,
)
from ocmm_core.tracking._pose import Method, PoseBatch, solve_leds
from ocmm_core.tracking._result import FrameStatus, TrackBlock, interruptions, join
from ocmm_core.tracking._strobe import StrobeReader, is_lit
from ocmm_core.tracking.kernels import without_rivals


@dataclass(frozen=True, slots=True)
class TrackingOptions:
    """How frames are tracked."""

    method: Method = "gauss-newton"
    relabel_after: int = 40
    """Consecutive doubtful frames after which the labels are discarded and searched again."""
    retry_ns: int = 5_000_000
    retry_at_most_ns: int = 320_000_000
    """`retry_ns`, `retry_at_most_ns`: Bus time between two searches for labels without success. It
    doubles with every failure, because a confusing scene takes longest to search."""
    extend_ns: int = 50_000_000
    """Bus time between attempts to assign unclaimed spots to free LEDs."""


@dataclass(slots=True)
class BodyTracker:
    """Track one body in a stream of frames with one rig.

    Only slot labels are kept between blocks; independent of block boundaries; for one thread.
    """

    rig: Rig
    body: LedBody
    point_body: Float
    """(3,), mm, body frame: the point reported as tip."""
    options: TrackingOptions = field(default_factory=TrackingOptions)
    slot_of_led: Int | None = None
    """(C, L): current labels, None if not identified."""
    reason: str = "no frame has arrived yet"
    """Why nothing is identified, or empty."""
    _search_at_ns: int = 0
    _patience_ns: int = 0
    _before_ns: int = 0
    _doubtful: int = 0
    _n_slots: int = USUAL_SLOTS
    _claims: list[tuple[int, Int | None]] = field(default_factory=list)
    _reader: StrobeReader | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        if self.body.code is not None:
            self._reader = StrobeReader(self.body.code)

    @property
    def sigma_px(self) -> float:
        """Return the standard deviation of one spot of one frame, px."""
        return spot_sigma_px(self.rig)

    def slot_leds(self) -> Int:
        """Return the LED of each slot, (C, S), -1 if unknown."""
        leds = np.full((len(self.rig.cameras), self._n_slots), -1, dtype=np.int64)
        if self.slot_of_led is not None:
            for camera, led in np.argwhere(self.slot_of_led >= 0):
                leds[camera, self.slot_of_led[camera, led]] = led
        return leds

    def process(self, block: FrameBlock) -> TrackBlock:
        self._claims.clear()
        self._n_slots = block.uv.shape[2]
        pieces: list[TrackBlock] = []
        breaks = interruptions(block.time_ns, self._before_ns)
        if self._reader is not None:
            # A symmetric body looks the same with exchanged labels: no frame may be missed.
            breaks += self._reader.gaps(block.counter)
        for first, last in pairwise(sorted({0, *breaks, len(block)})):
            if first in breaks:
                self._forget("the frames were interrupted")
            self._track(block.part(slice(first, last)) if breaks else block, pieces)
        return join(pieces)

    def without_claimed(self, block: FrameBlock) -> FrameBlock:
        """Return the last processed block without the spots of this body."""
        uv = block.uv.copy()
        start = 0
        for count, labels in self._claims:
            for camera, slots in enumerate(() if labels is None else labels):
                uv[start : start + count, camera, slots[slots >= 0]] = np.nan
            start += count
        return replace(block, uv=uv)

    def _track(self, block: FrameBlock, pieces: list[TrackBlock]) -> None:
        start = 0
        while start < len(block):
            if self.slot_of_led is None:
                start = self._search(block, start, pieces)
            else:
                start = self._follow(block, start, self.slot_of_led, pieces)
        self._before_ns = int(block.time_ns[-1])
        if self._reader is not None:
            self._reader.remember(block.counter, _there(block.uv))

    def _forget(self, reason: str) -> None:
        self.slot_of_led, self.reason = None, reason
        self._search_at_ns = self._patience_ns = self._doubtful = 0

    def _search(self, block: FrameBlock, start: int, pieces: list[TrackBlock]) -> int:
        end = start
        while end < len(block):
            now_ns = int(block.time_ns[end])
            if now_ns < self._search_at_ns:
                end += int(np.searchsorted(block.time_ns[end:], self._search_at_ns))
                continue
            led_of_slot = self._strobe(block, end)
            if self._reader is not None and led_of_slot is None:
                self.reason = "reading the strobe code of its LEDs"
                end += 1
                continue
            spots = block.uv[end]
            options = IdentifyOptions(sigma_px=self.sigma_px)
            found = identify(self.rig, self.body, spots, options, led_of_slot)
            self.slot_of_led, self.reason = found.slot_of_led, found.reason
            self._doubtful = 0
            if self.slot_of_led is not None:
                break
            # Empty scenes are searched at no cost: a returning probe is found at once.
            busy = bool(enough_spots(spots[None])[0])
            self._patience_ns = self._patience_ns * 2 if busy else 0
            self._patience_ns = min(
                max(self._patience_ns, self.options.retry_ns), self.options.retry_at_most_ns
            )
            self._search_at_ns = now_ns + self._patience_ns
        if end > start:
            self._claims.append((end - start, None))
            pieces.append(self._unidentified(block, start, end))
        return end

    def _strobe(self, block: FrameBlock, frame: int) -> Int | None:
        """Return the LED of each slot by the code of the frames up to this one."""
        if self._reader is None:
            return None
        part = slice(0, frame + 1)
        return self._reader.decode(block.counter[part], _there(block.uv[part]))

    def _solve(self, uv: Float, method: Method = "gauss-newton") -> PoseBatch:
        return solve_leds(uv, self.rig, self.body.leds_body, self.point_body, self.sigma_px, method)

    def _follow(self, block: FrameBlock, start: int, labels: Int, pieces: list[TrackBlock]) -> int:
        self.slot_of_led = labels = self._extended(block, start, labels)
        stop = self._next_extension(block, start)
        apart = without_rivals(block.uv[start:stop], IdentifyOptions(self.sigma_px).rival_px)
        uv = ordered_spots(apart, labels)
        batch = self._solve(uv, self.options.method)
        status = batch.status.copy()
        # Labels exchanged during lost frames may fit a symmetric body: rules detect it.
        with np.errstate(invalid="ignore"):
            wrong = (batch.chi2 > chi2_limit(batch.dof)) | ~satisfies_rules(
                self.body, batch.rotation_world_from_probe
            )
        status[(status == FrameStatus.OK) & wrong] = FrameStatus.DOUBTFUL
        seen = np.asarray(np.isfinite(uv).all(axis=3))
        # A slot that lost its LED may reacquire it: labels persist while any is tracked.
        dark = np.flatnonzero(~seen.reshape(len(seen), -1).any(axis=1))
        end = int(dark[0]) if len(dark) else len(status)
        end = min(end, self._in_step(block.counter[start:stop], seen))
        end = min(end, self._end_of_trust(status))
        if end < len(status):
            self._forget("all targets are hidden" if len(dark) else "LED labels inconsistent")
        if end == 0:
            return start
        self._claims.append((end, labels))
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
        """Return the labels, extended by unclaimed spots if due."""
        before_ns = int(block.time_ns[start - 1]) if start else self._before_ns
        period_ns = self.options.extend_ns
        due = int(block.time_ns[start]) // period_ns != before_ns // period_ns
        if not due or np.isfinite(ordered_spots(block.uv[[start]], labels)).all():
            return labels
        options = IdentifyOptions(sigma_px=self.sigma_px)
        return extended_labels(self.rig, self.body, block.uv[start], labels, options)

    def _next_extension(self, block: FrameBlock, start: int) -> int:
        """Return the next frame of possible label changes, independent of block boundaries."""
        due = np.flatnonzero(np.diff(block.time_ns[start:] // self.options.extend_ns))
        return start + 1 + int(due[0]) if len(due) else len(block)

    def _in_step(self, counter: Int, seen: NDArray[np.bool_]) -> int:
        """Return the index of the first frame with a visible LED (n, C, L) dark by its code."""
        if self.body.code is None:
            return len(seen)
        wrong = (seen & ~is_lit(self.body.code, counter)[:, None]).any(axis=(1, 2))
        return int(np.argmax(wrong)) if wrong.any() else len(seen)

    def _end_of_trust(self, status: NDArray[np.uint8]) -> int:
        """Return the index at which too many consecutive frames were doubtful."""
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
        enough = enough_spots(block.uv[start:end])
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
            seen=np.zeros((n, shape[0]), dtype=np.uint64),
            uv=np.full((n, *shape, 2), np.nan),
        )


def spot_sigma_px(rig: Rig) -> float:
    """Return the standard deviation of one spot of one frame, px, with all effects."""
    return float(np.hypot(rig.noise.white_px, rig.noise.pattern_px))


def enough_spots(uv: Float) -> NDArray[np.bool_]:
    """Return the mask of frames (n, C, S, 2) with three or more spots in two cameras."""
    spots = np.count_nonzero(np.isfinite(uv).all(axis=3), axis=2)
    enough: NDArray[np.bool_] = np.count_nonzero(spots >= 3, axis=1) >= 2
    return enough


def _there(uv: Float) -> NDArray[np.bool_]:
    return np.asarray(np.isfinite(uv).all(axis=3))


def _where(good: NDArray[np.bool_], values: Float) -> Float:
    if good.all():
        return values
    values = values.copy()
    values[~good] = np.nan
    return values


def _bits(seen: NDArray[np.bool_]) -> NDArray[np.uint64]:
    """Return numbers (n, C) with bit l set if LED l is seen (n, C, L), L at most 64."""
    packed = np.packbits(seen, axis=2, bitorder="little")
    bits = np.zeros((*seen.shape[:2], 8), dtype=np.uint8)
    bits[:, :, : packed.shape[2]] = packed
    # The first byte is the lowest.
    return bits.view("<u8")[:, :, 0]
