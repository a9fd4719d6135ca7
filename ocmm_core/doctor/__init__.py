"""Checks whether this computer is fit for measuring, with remedies.

In: the files and tools of a computer below a root folder. Out: a status line per check, and changes
that repair faults without risk.

Start with `_result` (check results and changes), `_computer` (system queries) and `_registry` (one
entry per check), then the checks: `_kernel_checks` (also rights), `_adapter_checks` (by
ethtool), `_disk_checks` (also records), `_desk_checks`. `_wake` measures wake-ups and judges
cycles measured by `composition`. `_mend` applies and reverts changes. It must not import stations
or screens: results are plain data.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.doctor._computer import Computer, HostCalls, NotAskedError, this_computer
    from ocmm_core.doctor._mend import Mended, can_undo, may_mend, mend, undo
    from ocmm_core.doctor._registry import CHECKS, CheckSpec, examine
    from ocmm_core.doctor._result import CheckResult, DoctorReport, Light, SystemChange
    from ocmm_core.doctor._wake import PERIOD_NS, LoopTimes, answer_of, judge_loop, part, wake_check
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CHECKS", "PERIOD_NS", "CheckResult", "CheckSpec", "Computer", "DoctorReport", "HostCalls",
    "Light", "LoopTimes", "Mended", "NotAskedError", "SystemChange", "answer_of", "can_undo",
    "examine", "judge_loop", "may_mend", "mend", "part", "this_computer", "undo", "wake_check",
]  # fmt: skip
