"""Exposures of cameras without a common clock, paired by counting."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from ocmm_genicam._grabber import Spots

_FIRST = 25
"""Exposures of each camera, paired by their arrival."""
_GAIN = 1.0 / 64.0
_SLIP = 1.0
"""Paired exposures that arrive this many periods further apart than at first have slipped."""


class ExposurePairing:
    """Pair the exposures of cameras that run at one rate without a common clock.

    The first pairs are the exposures that arrive together; then exposures are counted, so that the
    skew of the cameras does not depend on late or missing frames. Free-running cameras
    drift apart: after a period they are paired again, with a gap that ends all that was learnt of
    their skew.
    """

    def __init__(self, period_ns: int) -> None:
        self._period_s = period_ns * 1e-9
        self._offsets: list[int] | None = None
        self._apart_s = self._first_apart_s = np.zeros(0)

    def join(self, queues: Sequence[deque[Spots]]) -> list[list[Spots]]:
        """Remove the pairs from the queues of the cameras, and return them."""
        if self._offsets is None:
            if min(map(len, queues)) < _FIRST:
                return []
            leads = np.array(
                [
                    np.median([one.heard_s - one.exposure * self._period_s for one in queue])
                    for queue in map(tuple, queues)
                ]
            )
            periods = np.round((leads - leads[0]) / self._period_s)
            self._offsets = [int(one) for one in periods]
            self._apart_s = self._first_apart_s = leads - leads[0] - periods * self._period_s
            # A gap: nothing before it belongs to these pairs.
            for queue in queues:
                for _ in range(_FIRST):
                    queue.popleft()
        joined = []
        while all(queues):
            numbers = [
                queue[0].exposure + offset
                for queue, offset in zip(queues, self._offsets, strict=True)
            ]
            newest = max(numbers)
            if min(numbers) == newest:
                frame = [queue.popleft() for queue in queues]
                if self._slipped(frame):
                    self._offsets = None
                    break
                joined.append(frame)
                continue
            for queue, number in zip(queues, numbers, strict=True):
                if number < newest:
                    queue.popleft()
        return joined

    def _slipped(self, frame: list[Spots]) -> bool:
        heard = np.array([one.heard_s for one in frame])
        # Clipped: one late arrival is the computer's, not the camera's.
        late = np.clip(heard - heard[0] - self._apart_s, -self._period_s, self._period_s)
        self._apart_s = self._apart_s + _GAIN * late
        return bool(np.abs(self._apart_s - self._first_apart_s).max() > _SLIP * self._period_s)
