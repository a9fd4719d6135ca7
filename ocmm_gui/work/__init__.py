"""Long work beside the window: a thread or a process, how far it is, and how it is stopped.

In: what is to be computed. Out: the answer or what went wrong, by signals; the window stays free.

Read `_side_process` (a process of its own, given up at once) and `_worker` (a thread), `_work_line`
(how far it is, and the key that stops it), `_work_sheet` (a sheet that works).
It must not know what is computed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.work._side_process import SideProcess, Tell, Teller, Work
    from ocmm_gui.work._work_line import WorkLine
    from ocmm_gui.work._work_sheet import WorkSheet
    from ocmm_gui.work._worker import Failed, Worker
else:
    __getattr__ = door(
        __name__,
        _side_process="SideProcess Tell Teller Work",
        _work_line="WorkLine",
        _work_sheet="WorkSheet",
        _worker="Failed Worker",
    )

__all__ = ["Failed", "SideProcess", "Tell", "Teller", "Work", "WorkLine", "WorkSheet", "Worker"]
