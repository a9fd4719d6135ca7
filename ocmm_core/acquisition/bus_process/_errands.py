"""Short tasks on the wire in a process with the necessary rights.

One line of JSON on standard input is the request. Output is the devices of a scan as a line, a
pcapng file until a limit or the end of standard input (the parent stores it), or lines of JSON:
the progress of a permanent change to a camera, then its result. Changes need an idle bus.
"""

from __future__ import annotations

import select
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import TypeAlias

import msgspec

from ocmm_core.acquisition.bus_process._commands import run_errand, send_line
from ocmm_core.acquisition.bus_process._launch import WireErrand
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.fieldbus import wire
from ocmm_core.fieldbus.objects import update_firmware, write_alias

_WAIT_S = _TELL_S = 0.1
MOST_SECONDS, MOST_BYTES = 3600.0, 1 << 31


class ScanConfig(WireErrand, frozen=True, kw_only=True, tag="scan"):
    module = "ocmm_core.acquisition.bus_process._errands"


class RecordConfig(WireErrand, frozen=True, kw_only=True, tag="record"):
    module = ScanConfig.module
    seconds: float
    size_bytes: int
    """`seconds`, `size_bytes`: limits; the first one reached ends the recording."""
    program: str = "OCMM"


class MaintenanceConfig(WireErrand, frozen=True, kw_only=True, tag="maintain"):
    module = ScanConfig.module
    serial: int
    alias: int = 0
    """Station alias to store; 0: none."""
    firmware: str = ""
    """Firmware file; empty: none."""


_AnyErrand: TypeAlias = ScanConfig | RecordConfig | MaintenanceConfig


class MaintenanceNews(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    done: int = 0
    total: int = 0
    words: str = ""
    """Result, at the end; empty before."""


def main() -> None:
    run_errand(msgspec.json.Decoder(_AnyErrand), _run, "The task on the bus")


def _run(errand: _AnyErrand) -> None:
    if isinstance(errand, RecordConfig):
        _record(errand)
    elif isinstance(errand, MaintenanceConfig):
        _maintain(errand)
    else:
        wire.check_interface(errand.interface, force=errand.force)
        with closing(wire.RawLine(errand.interface)) as line:
            send_line(wire.encode_scan(wire.scan_devices(line.exchange)))


def _record(errand: RecordConfig) -> None:
    if not (0.0 < errand.seconds <= MOST_SECONDS and 0 < errand.size_bytes <= MOST_BYTES):
        raise InputError(
            "bus.record",
            f"A recording of {errand.seconds:g} s and {errand.size_bytes} bytes has no bound.",
            f"Give up to {MOST_SECONDS:.0f} s and {MOST_BYTES >> 20} MB.",
        )
    wire.check_interface(errand.interface, force=errand.force)
    out = sys.stdout.buffer
    with closing(wire.Tap(errand.interface)) as tap:
        size = out.write(wire.pcapng_head(errand.interface, errand.program))
        deadline = time.monotonic() + errand.seconds
        while (left := deadline - time.monotonic()) > 0.0 and size < errand.size_bytes:
            for frame in tap.frames(min(_WAIT_S, left)):
                size += out.write(
                    wire.pcapng_frame(frame.content, frame.utc_ns, outgoing=frame.outgoing)
                )
                if size >= errand.size_bytes:
                    break
            if select.select([sys.stdin], [], [], 0.0)[0]:
                break
        tap.count()
        send_line(wire.pcapng_end(time.time_ns(), tap.received, tap.dropped))


def _maintain(errand: MaintenanceConfig) -> None:
    image = read_bytes(Path(errand.firmware)) if errand.firmware else b""
    wire.check_interface(errand.interface, force=errand.force)
    told_s = 0.0

    def tell(done: int, total: int) -> None:
        nonlocal told_s
        if time.monotonic() - told_s > _TELL_S or done == total:
            told_s = time.monotonic()
            send_line(MaintenanceNews(done=done, total=total))

    words = []
    with closing(wire.RawLine(errand.interface)) as line:
        if errand.alias:
            before = write_alias(line.exchange, errand.serial, errand.alias)
            words.append(
                f"The camera with serial number {errand.serial} stores the alias {errand.alias} "
                f"(before: {before}). Switch it off and on."
            )
        if image:
            firmware = update_firmware(line.exchange, errand.serial, image, tell)
            words.append(
                f"The camera with serial number {errand.serial} runs the firmware "
                f"{firmware.version}."
            )
    send_line(MaintenanceNews(words=" ".join(words) or "Nothing was to be done."))


if __name__ == "__main__":
    main()
