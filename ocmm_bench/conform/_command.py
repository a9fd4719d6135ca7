"""``ocmm camera conform``: an entry point of the group `ocmm.commands`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import typer

from ocmm_cli.bus import follow_errand, write_bytes
from ocmm_cli.terminal import make_console
from ocmm_core.documents import read_bytes
from ocmm_core.errors import BusError

if TYPE_CHECKING:
    from ocmm_bench.conform._findings import ConformanceReport

_EXIT_RED, _EXIT_INCOMPLETE = 1, 3


def conform_camera(
    interface: str, *, serial: int, firmware: Path | None, json: Path | None, page: Path | None,
    rig: Path, force: bool,
) -> None:  # fmt: skip
    """Test a camera against every rule of its description (docs/integrator/camera_objects.md).

    Takes one to two minutes on an idle bus. Deletes the camera's black image, clears its errors
    and, with --firmware, updates it permanently. Exit code 0: GREEN; 1: RED; 3: INCOMPLETE.
    """
    from ocmm_bench.conform._findings import CameraOutcome, conformance_page, conformance_text
    from ocmm_bench.conform._run import ConformConfig, ConformNews
    from ocmm_cli.bus import bus_to_scan, command_of, segment_for
    from ocmm_core.fieldbus.device import Firmware

    if firmware is not None:
        # Reject invalid firmware before the bus is disturbed.
        Firmware.read(read_bytes(firmware))
    image = "" if firmware is None else str(firmware.absolute())
    named = bus_to_scan(interface if ":" in interface else f"ethercat:{interface}")
    segment = segment_for(named, rig)
    if segment is not None:
        # By default the first camera: the test is for one.
        serial = serial or segment.cameras[0].serial
    config = ConformConfig(interface=named.value, force=force, serial=serial, firmware=image)
    command, first_lines = command_of(config, segment)
    console = make_console()
    report: ConformanceReport | None = None

    def parse(line: bytes) -> tuple[int, int]:
        nonlocal report
        news = msgspec.json.decode(line, type=ConformNews)
        report = news.report or report
        return news.done, news.total

    code, complaint = follow_errand(command, first_lines, console, "Testing", parse)
    if report is None:
        raise BusError(
            "bus.conform",
            complaint or f"The test ended without a report (code {code}).",
            "Check cable and power of the camera, then repeat the test.",
        )
    console.print_line(conformance_text(report))
    if json is not None:
        write_bytes(json, report.to_json())
    if page is not None:
        write_bytes(page, conformance_page(report).encode())
    codes = {CameraOutcome.RED: _EXIT_RED, CameraOutcome.INCOMPLETE: _EXIT_INCOMPLETE}
    raise typer.Exit(codes.get(report.outcome, 0))
