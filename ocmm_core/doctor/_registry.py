"""All checks of the computer in order, one entry each."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC

from ocmm_core.build import build_version
from ocmm_core.doctor import _adapter_checks as on_adapter
from ocmm_core.doctor import _desk_checks as at_desk
from ocmm_core.doctor import _disk_checks as on_disk
from ocmm_core.doctor import _kernel_checks as in_kernel
from ocmm_core.doctor import _result as result
from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._desk_checks import settings
from ocmm_core.failure import contained

Check = Callable[[Computer], result.Answer]


@dataclass(frozen=True, slots=True)
class CheckSpec:
    name: str
    title: str
    """`name`, `title`: for programs, and for people."""
    about: str
    check: Check
    """Raises `NotAskedError` if it cannot be determined."""


CHECKS = (
    CheckSpec(
        "program",
        "Version",
        "versions of the program files and of the installation agree",
        on_disk.program,
    ),
    CheckSpec("kernel", "Kernel", "PREEMPT_RT", in_kernel.kernel),
    CheckSpec(
        "cores",
        "Processor for the bus",
        "`isolcpus` and `nohz_full` of a processor, and that the service runs on it",
        in_kernel.cores,
    ),
    CheckSpec("governor", "Clock governor", "`performance` on every processor", in_kernel.governor),
    CheckSpec("idle", "Idle states", "no C-state with more than 50 us to wake up", in_kernel.idle),
    CheckSpec(
        "adapter",
        "Camera adapter",
        "there, connected, full duplex, at most 1 Gbit/s, no address, no USB, pause frames or EEE",
        on_adapter.adapter,
    ),
    CheckSpec(
        "interrupts",
        "Adapter interrupts",
        "none of its interrupts on the processor of the bus",
        on_adapter.interrupts,
    ),
    CheckSpec(
        "coalescing",
        "Adapter coalescing",
        "`rx-usecs`, `tx-usecs` and adaptive modes off (ethtool)",
        on_adapter.coalescing,
    ),
    CheckSpec("offloads", "Adapter offloads", "`gro` and `lro` off (ethtool)", on_adapter.offloads),
    CheckSpec("group", "Group", "the user is in the group `ocmm`", in_kernel.group),
    CheckSpec(
        "rights",
        "Rights of the bus",
        "of the service or of `ocmm-acq-python`, which nobody but root can change",
        in_kernel.rights,
    ),
    CheckSpec("memory", "Memory lock", "all memory can be locked", in_kernel.memory),
    CheckSpec(
        "clock",
        "Clock",
        "synchronised; not before what the station remembers; near the clock of the board",
        at_desk.clock,
    ),
    CheckSpec("time_zone", "Time zone", "set", at_desk.time_zone),
    CheckSpec(
        "disk",
        "Disk",
        "5 GiB and files free (RED below 0.5 GiB), writable, of jobs and of records",
        on_disk.disk,
    ),
    CheckSpec(
        "sync",
        "Disk latency",
        "95 % of points on the disk within 25 ms (RED above 100 ms); a disk, not memory",
        on_disk.sync,
    ),
    CheckSpec(
        "screen", "Screen", "1280 x 720 after scaling (RED below 1024 x 640)", at_desk.screen
    ),
    CheckSpec("sound", "Sound", "a player and a sound card", at_desk.sound),
    CheckSpec(
        "calibrations",
        "Calibrations",
        "those made last have not expired, nor will in 14 days",
        on_disk.calibrations,
    ),
    CheckSpec(
        "certificates",
        "Certificates",
        "the same of the artefacts that they rest on",
        on_disk.certificates,
    ),
    CheckSpec(
        "key",
        "Station key",
        "present, mode 0600, in a folder that only its user can change",
        on_disk.key,
    ),
    CheckSpec("settings", "Settings", "root has no other settings than the station", settings),
)


def examine(
    computer: Computer,
    more: Iterable[CheckSpec] = (),
    told: Callable[[str, float], None] = lambda title, share: None,
) -> tuple[result.DoctorReport, tuple[result.SystemChange, ...]]:
    """Return the report of a computer, and all changes that repair faults.

    ``more`` are measured checks; ``told`` gets each title beforehand, and the share done.
    """
    results: list[result.CheckResult] = []
    changes: list[result.SystemChange] = []
    everything = (*CHECKS, *more)
    for number, spec in enumerate(everything):
        told(spec.title, number / len(everything))
        answer = _asked(spec, computer)
        changes += answer.changes
        results.append(
            result.CheckResult(
                spec.name, spec.title, answer.light, answer.code, answer.what, answer.remedy,
                bool(answer.changes), answer.figures,
            )
        )  # fmt: skip
    utc = computer.calls.now().astimezone(UTC).isoformat(timespec="seconds")
    found = tuple(results)
    return result.DoctorReport(
        result.SCHEMA, utc, build_version(), result.worst_of(found), found
    ), tuple(changes)


def _asked(spec: CheckSpec, computer: Computer) -> result.Answer:
    """Return the answer of a check; NOT CHECKED if it fails."""
    try:
        return spec.check(computer)
    except NotAskedError as error:
        return result.Answer(result.Light.NOT_CHECKED, error.what, error.code, error.remedy)
    except Exception as error:
        # An unexpected error in one check must not stop the others.
        told = contained(error, f"The check '{spec.title}'")
        return result.Answer(result.Light.NOT_CHECKED, told.what, told.code, told.remedy)
