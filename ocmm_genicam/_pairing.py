"""Exposures of cameras without a common clock, paired by counting."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from ocmm_core.geometry import Float
from ocmm_genicam._grabber import Spots

_FIRST = 25
"""Exposures of each camera, paired by their arrival."""
_BLOCK, _LATELY = 64, 16
"""Pairs of a block, and the last blocks whose earliest arrivals are compared with the first ones:
no image arrives early, but all of them may be late for seconds, behind incomplete ones.
Free-running cameras drift apart by a period in minutes."""
_SLIP = 0.75
"""Paired exposures that arrive this many periods further apart than at first have slipped; less
than one, so that first pairs made of late images are made again."""


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
        self._first_apart_s = np.zeros(0)
        self._block: list[list[float]] = []
        self._earliest: deque[Float] = deque(maxlen=_LATELY)

    def join(self, queues: Sequence[deque[Spots]]) -> list[list[Spots]]:
        """Remove the pairs from the queues of the cameras, and return them."""
        if self._offsets is None:
            if min(map(len, queues)) < _FIRST:
                return []
            leads = np.array([min(map(self._lead, tuple(queue))) for queue in queues])
            self._first_apart_s = leads - leads[0]
            self._offsets = [round(one / self._period_s) for one in self._first_apart_s.tolist()]
            self._block.clear()
            self._earliest.clear()
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

    def _lead(self, one: Spots) -> float:
        """Return the arrival of an exposure, s, by the clock that counts the exposures."""
        return one.heard_s - one.exposure * self._period_s

    def _slipped(self, frame: list[Spots]) -> bool:
        self._block.append([self._lead(one) for one in frame])
        if len(self._block) < _BLOCK:
            return False
        self._earliest.append(np.min(self._block, axis=0))
        self._block.clear()
        leads = np.min(self._earliest, axis=0)
        moved = float(np.abs(leads - leads[0] - self._first_apart_s).max())
        return len(self._earliest) == _LATELY and moved > _SLIP * self._period_s
