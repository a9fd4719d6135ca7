"""Bridge from the station to Qt: state by signals, live values by a timer.

In: a station with its threads. Out: signals on the window's thread, and commands to the station.

Start with `_bridge` (signals, timer, services) and `_threads` (rate-limited evaluation of the
job, and commands). Commands of the window go through a queue, by ``job``,
``choice``, ``results``, ``jobs``, ``maintenance`` and ``serving``; read-only values come from
``bridge.station``.
Nothing lengthy runs on the window's thread. It must not import screens.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.bridge._bridge import StationBridge
    from ocmm_gui.bridge._threads import Evaluator
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["Evaluator", "StationBridge"]
