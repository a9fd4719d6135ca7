"""Frames of cameras that do not expose together, interpolated to common times."""

from __future__ import annotations

import numpy as np

from ocmm_core.acquisition.frames._frames import FrameBlock
from ocmm_core.geometry import Float, Int

MOST_FRAMES = 8
"""Largest skew that can be aligned, in frame periods."""
_APART = 1.5
"""Frames further apart than this many periods are no neighbours."""
_NODES = np.array([-1.0, 0.0, 1.0, 2.0])


class FrameAligner:
    """Shift the spots of each camera by its skew; frames come out some periods later.

    Camera c exposes a frame at its time stamp plus ``skew_s[c]``. Spots are interpolated between
    consecutive frames of a slot: by a cubic, or a line at the ends; a spot without neighbour is
    left out. For one thread.
    """

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._held: FrameBlock | None = None
        self._sent_ns = -1

    def push(self, block: FrameBlock, skew_s: Float) -> FrameBlock | None:
        """Return the frames whose neighbours have arrived in all cameras; None if there are none.

        Frames before a pause, or before a step back of the clock, are dropped if not yet returned.
        """
        held = block if self._held is None else _joined(self._held, block)
        reach_ns = MOST_FRAMES * self._period_ns
        steps = np.diff(held.time_ns)
        breaks = np.flatnonzero((steps <= 0) | (steps > reach_ns))
        if len(breaks):
            held, self._sent_ns = held.part(slice(int(breaks[-1]) + 1, None)), -1
        skew_ns = np.round(skew_s * 1e9).astype(np.int64)
        latest = int(held.time_ns[-1]) + min(0, int(skew_ns.min())) - self._period_ns
        chosen = np.flatnonzero((held.time_ns > self._sent_ns) & (held.time_ns <= latest))
        keep_ns = latest - reach_ns - 2 * self._period_ns
        self._held = held.part(held.time_ns >= keep_ns)
        if not len(chosen):
            return None
        self._sent_ns = int(held.time_ns[chosen[-1]])
        uv = np.stack(
            [
                self._at(held, camera, held.time_ns[chosen] - shift)
                for camera, shift in enumerate(skew_ns)
            ],
            axis=1,
        )
        found = np.isfinite(uv[..., 0])
        bits = np.uint64(1) << np.arange(uv.shape[2], dtype=np.uint64)
        valid = np.where(found, bits, np.uint64(0)).sum(axis=2, dtype=np.uint64)
        return FrameBlock(held.counter[chosen], held.time_ns[chosen], held.flags[chosen], valid, uv)

    def _at(self, held: FrameBlock, camera: int, times_ns: Int) -> Float:
        """Return the spots (n, S, 2) of a camera at some of its time stamps (n,)."""
        stamps, spots = held.time_ns, held.uv[:, camera]
        if len(stamps) < 2:
            return np.full((len(times_ns), *spots.shape[1:]), np.nan)
        left = np.clip(np.searchsorted(stamps, times_ns, side="right") - 1, 0, len(stamps) - 2)
        step = stamps[left + 1] - stamps[left]
        share = (times_ns - stamps[left]) / step
        places = np.clip(left[:, None] + _NODES.astype(np.int64), 0, len(stamps) - 1)
        near = np.abs(stamps[places] - stamps[left][:, None] - _NODES * self._period_ns) < (
            (_APART - 1.0) * self._period_ns
        )
        taken = np.where(near[..., None, None], spots[places], np.nan)
        line = taken[:, 1] + share[:, None, None] * (taken[:, 2] - taken[:, 1])
        # A time on a frame needs no neighbour.
        line = np.where((share == 0.0)[:, None, None], taken[:, 1], line)
        line[(share < 0.0) | (share > 1.0)] = np.nan
        cubic = np.einsum("nk,nksa->nsa", _lagrange(share), taken)
        out: Float = np.where(np.isfinite(cubic) & np.isfinite(line), cubic, line)
        return out


def _lagrange(share: Float) -> Float:
    """Return the weights (n, 4) of the frames at -1, 0, 1 and 2 periods."""
    weights = np.ones((len(share), 4))
    for k, node in enumerate(_NODES):
        for other in _NODES[np.arange(4) != k]:
            weights[:, k] *= (share - other) / (node - other)
    return weights


def _joined(first: FrameBlock, then: FrameBlock) -> FrameBlock:
    return FrameBlock(
        *(
            np.concatenate([getattr(first, name), getattr(then, name)])
            for name in FrameBlock.__slots__
        )
    )
