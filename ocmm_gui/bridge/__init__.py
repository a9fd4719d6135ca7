"""Between the measuring station and Qt: state by signals, live values by a timer.

In: a station with its threads. Out: signals on the window's thread, and commands to the station.

Read `_bridge` (signals, timer; it joins the services) and `_evaluator` (the job evaluated on a
thread of its own, no more often than somebody can look). What the window asks for goes through the
queue in `_commands`, by ``job``, ``choice`` and ``results`` (`_job_commands`), ``jobs``
(`_bridge`) and ``maintenance``; what is only read is read from ``bridge.station`` itself.
Nothing long runs on the window's thread. It must not know a single screen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.bridge._bridge import StationBridge
    from ocmm_gui.bridge._evaluator import Evaluator
else:
    __getattr__ = door(__name__, _bridge="StationBridge", _evaluator="Evaluator")

__all__ = ["Evaluator", "StationBridge"]
