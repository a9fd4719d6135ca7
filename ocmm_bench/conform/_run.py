"""Conformance test of a camera, and its process with the necessary rights; idle bus only.

A line of JSON on standard input; lines of JSON as output: progress, then the report.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import msgspec

from ocmm_bench.conform._bench import Bench, Rule
from ocmm_bench.conform._findings import (
    ConformanceReport,
    NotAsDescribedError,
    NotTestedError,
    RuleFindings,
    RuleResult,
    RuleVerdict,
    TimingSheet,
    printable,
)
from ocmm_bench.conform._mail_line import INIT, PREOP, ConformLine, WireLine
from ocmm_bench.conform._rules_errors import MAILBOX_RULES as MAILBOX
from ocmm_bench.conform._rules_errors import RULES as ERRORS
from ocmm_bench.conform._rules_objects import RULES as OBJECTS
from ocmm_bench.conform._rules_process_data import CLOCK, FRAMES
from ocmm_bench.conform._rules_services import COMMANDS, FIRMWARE
from ocmm_bench.conform._rules_startup import EEPROM, STATES
from ocmm_core.acquisition.bus_process import WireErrand, run_errand, send_line
from ocmm_core.documents import read_bytes
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.wire import RawLine, check_interface

RULES: tuple[Rule, ...] = (
    *EEPROM, *STATES, *OBJECTS, *MAILBOX, *FRAMES, *CLOCK, *ERRORS, *COMMANDS, *FIRMWARE,
)  # fmt: skip
"""Test order: basics first, permanent changes last."""

_TRIES = 3
_SILENT = "bus.silent"

Told = Callable[[int, int, str], None]
"""Called with rules done, rules in total, and the title of the next."""


def conform(
    line: ConformLine,
    place: int = 0,
    *,
    firmware: bytes = b"",
    rules: tuple[Rule, ...] = RULES,
    told: Told = lambda _done, _total, _title: None,
) -> ConformanceReport:
    """Test a camera against the rules of its object description.

    Drops the camera's black image, clears its error history and, with `firmware`, leaves that
    running; restores everything else. The camera ends in INIT.

    Parameters
    ----------
    place
        Position of the camera, 0 first.
    firmware
        Firmware file signed by the maker, of another version than the running one.

    Raises
    ------
    BusError
        The camera stopped answering.
    """
    bench = Bench(line, place, firmware)
    times: dict[str, tuple[int, list[int]]] = {}
    bench.findings = RuleFindings(times)
    started = datetime.now(UTC).isoformat(timespec="seconds")
    eeprom = bench.eeprom()
    vendor, product, revision, bench.serial = struct.unpack_from("<IIII", eeprom, 16)
    results: list[RuleResult] = []
    for number, rule in enumerate(rules):
        told(number, len(rules), rule.title)
        results.append(_tried(bench, rule, times))
    told(len(rules), len(rules), "")
    return ConformanceReport(
        serial=bench.serial,
        alias=int.from_bytes(eeprom[8:10], "little"),
        vendor=vendor,
        product=product,
        revision=revision,
        firmware=_left(bench),
        started_utc=started,
        program=_program(),
        results=tuple(results),
        timings=tuple(
            TimingSheet.from_times(name, found, limit) for name, (limit, found) in times.items()
        ),
    )


def _tried(bench: Bench, rule: Rule, times: dict[str, tuple[int, list[int]]]) -> RuleResult:
    """Run one rule; retry failures during which this computer paused."""
    for _ in range(_TRIES):
        bench.line.paused_ns()
        taken: dict[str, tuple[int, list[int]]] = {}
        result = _once(bench, rule, taken)
        late = any(limit and max(found) > limit for limit, found in taken.values())
        paused_ns = bench.line.paused_ns()
        if not paused_ns or not (late or result.verdict is RuleVerdict.FAILED):
            for name, (limit, found) in taken.items():
                times.setdefault(name, (limit, []))[1].extend(found)
            return result
    why = (
        f"This computer paused for {paused_ns / 1e6:.0f} ms in each of {_TRIES} tries. Close other "
        "programs, then repeat the test."
    )
    return msgspec.structs.replace(result, verdict=RuleVerdict.NOT_TESTED, complaints=(why,))


def _once(bench: Bench, rule: Rule, times: dict[str, tuple[int, list[int]]]) -> RuleResult:
    """Run one rule; failures never end the run."""
    see = bench.findings = RuleFindings(times)
    verdict = RuleVerdict.PASSED
    bench.feeding = False
    try:
        rule.run(bench, see)
    except NotTestedError as why:
        verdict = RuleVerdict.NOT_TESTED
        see.complaints.append(why.complaint)
    except NotAsDescribedError as broken:
        see.checked += 1
        if printable(broken.complaint) not in see.complaints:
            see.complaints.append(printable(broken.complaint))
    except BusError as broken:
        if broken.code == _SILENT:
            raise
        see.checked += 1
        see.complaints.append(printable(broken.what))
    except (struct.error, IndexError) as broken:
        see.checked += 1
        see.complaints.append(f"An answer is too short to be read ({broken}).")
    if see.complaints and verdict is RuleVerdict.PASSED:
        verdict = RuleVerdict.FAILED
    return RuleResult(
        code=rule.code,
        section=rule.section,
        title=rule.title,
        verdict=verdict,
        checked=see.checked,
        complaints=tuple(see.complaints),
    )


def _left(bench: Bench) -> str:
    """Leave the camera in INIT; return its reported firmware version."""
    try:
        bench.go(PREOP)
        found = bench.mail.value(0x100A).rstrip(b"\x00").decode("ascii", errors="replace")
        bench.go(INIT)
    except NotAsDescribedError:
        return "unknown"
    return printable(found)


def find_place(line: ConformLine, serial: int) -> int:
    """Return a camera's position, 0 for the only one; BusError if not unique."""
    from ocmm_core.fieldbus.wire import scan_devices

    devices = scan_devices(lambda datagram: line.exchange([datagram])[0])
    numbers = [each.device.serial for each in devices]
    places = [n for n, number in enumerate(numbers) if serial in (0, number)]
    if len(places) == 1:
        return places[0]
    there = ", ".join(map(str, numbers)) or "none"
    raise BusError(
        "bus.camera_missing",
        f"{len(places) or 'No'} devices match; serial numbers on the bus: {there}.",
        "Connect one camera only, or name it with --serial.",
    )


def _program() -> str:
    try:
        return version("ocmm")
    except PackageNotFoundError:
        return "unknown"


class ConformConfig(WireErrand, frozen=True, kw_only=True, forbid_unknown_fields=True):
    module = "ocmm_bench.conform._run"
    serial: int = 0
    """Serial number; 0: the only camera."""
    firmware: str = ""
    """File signed by its maker; empty: none."""


class ConformNews(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    done: int = 0
    total: int = 0
    title: str = ""
    report: ConformanceReport | None = None
    """At the end; None before."""


def main() -> None:
    run_errand(msgspec.json.Decoder(ConformConfig), _run, "The conformance test")


def _run(config: ConformConfig) -> None:
    image = read_bytes(Path(config.firmware)) if config.firmware else b""
    check_interface(config.interface, force=config.force)
    with closing(RawLine(config.interface)) as raw:
        line = WireLine(raw)
        report = conform(
            line,
            find_place(line, config.serial),
            firmware=image,
            told=lambda done, total, title: send_line(
                ConformNews(done=done, total=total, title=title)
            ),
        )
    send_line(ConformNews(report=report))


if __name__ == "__main__":
    main()
