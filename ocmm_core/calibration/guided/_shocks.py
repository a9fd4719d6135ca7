"""Probe shocks reported by frames, and their effect on a running check."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from ocmm_core.acquisition.frames import FrameBlock, FrameFlag
from ocmm_core.calibration.records import MONITOR, ProbeStore, TipEventKind
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Int

_AT_ONCE = timedelta(seconds=2)


@dataclass(slots=True)
class ShockDetector:
    """Finds the starts of shocks; each is reported by the frames of a second."""

    _felt: bool = False

    def feed(self, block: FrameBlock) -> Int:
        """Return the indices (n,) of the frames in which a shock starts."""
        if not len(block):
            return np.empty(0, dtype=np.int64)
        felt = (block.flags & FrameFlag.DROPPED) != 0
        begun = np.flatnonzero(felt & ~np.concatenate([[self._felt], felt[:-1]]))
        self._felt = bool(felt[-1])
        return begun.astype(np.int64)


def record_shock(store: ProbeStore, now: datetime) -> None:
    """Record a shock unless the station has just done so; StorageError if impossible."""
    store.refresh()
    last = store.events[-1] if store.events else None
    written = last is not None and (last.kind, last.who) == (TipEventKind.DOUBTED, MONITOR)
    if last is None or not written or now - datetime.fromisoformat(last.utc) > _AT_ONCE:
        store.doubt(MONITOR, "Probe shock detected during the check.", now, now)


def require_no_doubt_since(store: ProbeStore, tip: str, begun: datetime) -> None:
    """Raise CalibrationError if the tip was suspected or mounted since a check started."""
    doubts = [
        one
        for one in store.events
        if one.tip == tip
        and one.kind in (TipEventKind.DOUBTED, TipEventKind.MOUNTED)
        and datetime.fromisoformat(one.utc) > begun
    ]
    if doubts:
        raise CalibrationError(
            "tip.doubt_meanwhile",
            f"The status of tip '{tip}' changed after this session was started "
            f"({doubts[-1].kind.value}: {doubts[-1].reason}).",
            "End it without storing and repeat it: earlier points prove nothing.",
        )
