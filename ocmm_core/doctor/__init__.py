"""Is this computer fit to measure with: what a technician would look at, and what to do about it.

In: the files and tools of a computer below a root folder. Out: a line with a light for each check,
and the changes that would put something right without any risk.

Read `_result` (what a check says), `_computer` with `_host_calls` (how anything is asked) and
`_registry` (one entry a check), then the checks: `_kernel_checks` with `_cores`,
`_adapter_checks` with `_ethtool`, `_rights_checks`, `_time_checks`, `_disk_checks`, `_desk_checks`,
`_record_checks`. `_wake` measures for a while, `_loop` judges what `composition` measures.
`_changes` says what can be changed, `_mend` changes it and takes it back.
It must not know a station or a screen: what was found is plain data.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.doctor._changes import SystemChange
    from ocmm_core.doctor._computer import Computer, NotAskedError, this_computer
    from ocmm_core.doctor._host_calls import HostCalls
    from ocmm_core.doctor._loop import LoopTimes, judge_loop
    from ocmm_core.doctor._mend import Mended, can_undo, may_mend, mend, undo
    from ocmm_core.doctor._registry import CHECKS, CheckSpec, examine
    from ocmm_core.doctor._result import CheckResult, DoctorReport, Light
    from ocmm_core.doctor._wake import PERIOD_NS, answer_of, part, wake_check
else:
    __getattr__ = door(
        __name__,
        _changes="SystemChange",
        _computer="Computer NotAskedError this_computer",
        _host_calls="HostCalls",
        _loop="LoopTimes judge_loop",
        _mend="Mended can_undo may_mend mend undo",
        _registry="CHECKS CheckSpec examine",
        _result="CheckResult DoctorReport Light",
        _wake="PERIOD_NS answer_of part wake_check",
    )

__all__ = [
    "CHECKS",
    "PERIOD_NS",
    "CheckResult",
    "CheckSpec",
    "Computer",
    "DoctorReport",
    "HostCalls",
    "Light",
    "LoopTimes",
    "Mended",
    "NotAskedError",
    "SystemChange",
    "answer_of",
    "can_undo",
    "examine",
    "judge_loop",
    "may_mend",
    "mend",
    "part",
    "this_computer",
    "undo",
    "wake_check",
]
