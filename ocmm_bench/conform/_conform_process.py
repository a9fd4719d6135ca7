"""Conformance test of a camera in a process with the necessary rights; idle bus only.

A line of JSON on standard input; lines of JSON as output: progress, then the report.
"""

from __future__ import annotations

import sys
from pathlib import Path

import msgspec

from ocmm_bench.conform._findings import ConformanceReport
from ocmm_bench.conform._mail_line import WireLine
from ocmm_bench.conform._run import conform, find_place
from ocmm_core.acquisition.bus_process import bus_command, run_errand
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.wire import HOST_INTERFACE, RawLine, check_interface
from ocmm_sim.bus import SegmentConfig, errand_virtual

_MODULE = "ocmm_bench.conform._conform_process"


class ConformConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    interface: str
    force: bool = False
    serial: int = 0
    """Serial number; 0: the only camera."""
    firmware: str = ""
    """File signed by its maker; empty: none."""

    def to_json(self) -> bytes:
        """Return the configuration as one line of JSON."""
        return msgspec.json.encode(self) + b"\n"


class ConformNews(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    done: int = 0
    total: int = 0
    title: str = ""
    report: ConformanceReport | None = None
    """At the end; None before."""


def conform_command() -> list[str]:
    """Return the command of this process, with the bus process interpreter."""
    return [*bus_command()[:-1], _MODULE]


def conform_virtual(segment: SegmentConfig, config: ConformConfig) -> tuple[list[str], bytes]:
    """Return the command that tests a virtual software camera, and its input."""
    # By default the first camera: the test is for one.
    serial = config.serial or segment.cameras[0].serial
    told = msgspec.structs.replace(config, interface=HOST_INTERFACE, serial=serial)
    return errand_virtual(segment, _MODULE, told.to_json())


def main() -> None:
    run_errand(_run, "The conformance test")


def _run(content: bytes) -> None:
    try:
        config = msgspec.json.decode(content, type=ConformConfig)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise InputError(
            "bus.conform", f"Invalid request: {error}.", "Use the command 'ocmm camera conform'."
        ) from error
    image = read_bytes(Path(config.firmware)) if config.firmware else b""
    check_interface(config.interface, force=config.force)
    raw = RawLine(config.interface)
    try:
        line = WireLine(raw)
        place = find_place(line, config.serial)
        report = conform(
            line,
            place,
            firmware=image,
            told=lambda done, total, title: _say(ConformNews(done=done, total=total, title=title)),
        )
    finally:
        raw.close()
    _say(ConformNews(report=report))


def _say(news: ConformNews) -> None:
    sys.stdout.buffer.write(msgspec.json.encode(news) + b"\n")
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
