"""Background work: a thread or a process, its progress, and cancellation.

In: a computation. Out: the answer or the error, by signals; the window stays free.

Read `_side_process` (a process, killed immediately) and `_worker` (a thread; progress and the key
that cancels, a sheet with work).
It must not know the computations.
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_gui.work._side_process import SideProcess, Tell, Teller, Work
    from ocmm_gui.work._worker import Failed, WorkLine, WorkSheet, Worker
else:
    __getattr__ = door(__name__)

__all__ = ["Failed", "SideProcess", "Tell", "Teller", "Work", "WorkLine", "WorkSheet", "Worker"]
