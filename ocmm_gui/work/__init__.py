"""Background work: a thread or a process, its progress, and cancellation.

In: a computation. Out: the answer or the error, by signals; the window stays free.

Read `_worker` (a thread; a process, killed immediately; progress and the key that cancels, a sheet
with work).
It must not know the computations.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.work._worker import (
        Failed, SideProcess, Tell, Teller, Work, WorkLine, WorkSheet, Worker,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["Failed", "SideProcess", "Tell", "Teller", "Work", "WorkLine", "WorkSheet", "Worker"]
