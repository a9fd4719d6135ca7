"""Checks whether this computer is fit for measuring, with remedies.

In: the files and tools of a computer below a root folder. Out: a status line per check, and changes
that would repair faults without risk; the command applies them.

Start with `_result` (check results and changes), `_computer` (system queries) and `_registry` (one
entry per check), then the checks: `_kernel_checks` (also rights), `_adapter_checks` (by ethtool),
`_disk_checks` (also records); those of the desk are in `_registry`. `_wake` measures wake-ups and
judges cycles on a cable, which the command measures. It must not import stations or screens:
results are plain data.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.doctor._adapter_checks import adapter_settings, change_setting
    from ocmm_core.doctor._computer import Computer, HostCalls, NotAskedError, this_computer
    from ocmm_core.doctor._registry import CHECKS, CheckSpec, examine
    from ocmm_core.doctor._result import (
        LIMITS, UNDO_FILE, ChangeKind, CheckResult, DoctorReport, Light, SystemChange, is_allowed,
    )  # fmt: skip
    from ocmm_core.doctor._wake import PERIOD_NS, LoopTimes, answer_of, judge_loop, part, wake_check
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CHECKS", "LIMITS", "PERIOD_NS", "UNDO_FILE", "ChangeKind", "CheckResult", "CheckSpec",
    "Computer", "DoctorReport", "HostCalls", "Light", "LoopTimes", "NotAskedError", "SystemChange",
    "adapter_settings", "answer_of", "change_setting", "examine", "is_allowed", "judge_loop",
    "part", "this_computer", "wake_check",
]  # fmt: skip
