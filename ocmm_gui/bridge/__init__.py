"""Between the measuring station and Qt: state by signals, live values by a timer.

In flow signals and snapshots of the station; out they flow on the thread of the window. What the
window asks for goes through the queue of one of its services: ``job``, ``choice``, ``results``,
``jobs`` and ``maintenance``. What only is read is read from ``bridge.station`` itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.bridge._bridge import StationBridge
    from ocmm_gui.bridge._evaluator import Evaluator
else:
    __getattr__ = door(
        __name__,
        _bridge="StationBridge",
        _evaluator="Evaluator",
    )

__all__ = [
    "Evaluator",
    "StationBridge",
]
