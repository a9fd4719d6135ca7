"""Conformance test of a camera in a process with the necessary rights; idle bus only.

A line of JSON on standard input; lines of JSON as output: progress, then the report.
"""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import msgspec

from ocmm_bench.conform._findings import ConformanceReport
from ocmm_bench.conform._mail_line import WireLine
from ocmm_bench.conform._run import conform, find_place
from ocmm_core.acquisition.bus_process import WireErrand, run_errand, send_line
from ocmm_core.documents import read_bytes
from ocmm_core.fieldbus.wire import RawLine, check_interface


class ConformConfig(WireErrand, frozen=True, kw_only=True, forbid_unknown_fields=True):
    module = "ocmm_bench.conform._conform_process"
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
