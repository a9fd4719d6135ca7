"""``ocmm camera``: alias, errors, identification, firmware and conformance of one camera."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from ocmm_core.cli.bus._camera import bar, interruptible
from ocmm_core.cli.bus._options import BusOption, CameraArgument, write_bytes
from ocmm_core.cli.terminal import ForceOption, RigOption, make_console, say
from ocmm_core.composition import RECOMMENDED_RIG
from ocmm_core.errors import BusError

_EXIT_RED, _EXIT_INCOMPLETE = 1, 3


def conform(
    interface: Annotated[
        str,
        typer.Argument(
            metavar="IFACE",
            help="Network interface with the camera, e.g. enp3s0; or ethercat:virtual.",
        ),
    ],
    *,
    serial: Annotated[
        int, typer.Option("--serial", help="Its serial number, if there are several cameras.")
    ] = 0,
    firmware: Annotated[
        Path | None,
        typer.Option("--firmware", help="Signed firmware of another version, to try an update."),
    ] = None,
    json: Annotated[Path | None, typer.Option("--json", help="New file for the report.")] = None,
    page: Annotated[
        Path | None, typer.Option("--page", help="New HTML page for the report.")
    ] = None,
    rig: RigOption = RECOMMENDED_RIG,
    force: ForceOption = False,
) -> None:
    """Test a camera against every rule of its description (docs/camera_objects.md).

    Takes one to two minutes on an idle bus. Deletes the camera's black image, clears its errors
    and, with --firmware, updates it permanently. Exit code 0: GREEN; 1: RED; 3: INCOMPLETE.
    """
    from ocmm_core.acquisition.bus_process import ConformNews
    from ocmm_core.cli.bus._session import conformance_of
    from ocmm_core.documents import read_bytes
    from ocmm_core.fieldbus.conform import Outcome, conformance_page, conformance_text
    from ocmm_core.fieldbus.device import Firmware

    if firmware is not None:
        # Reject invalid firmware before the bus is disturbed.
        Firmware.read(read_bytes(firmware))
    image = "" if firmware is None else str(firmware.absolute())
    source = interface if ":" in interface else f"ethercat:{interface}"
    command, first_lines = conformance_of(source, rig, serial, image, force=force)
    console = make_console()
    report = None
    with (
        subprocess.Popen(  # noqa: S603 - our own interpreter and modules, no shell
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
        ) as process,
        interruptible(console),
    ):
        if process.stdin is None or process.stdout is None or process.stderr is None:
            raise BusError("bus.conform", "The process does not start.", "Try again.")
        process.stdin.write(first_lines)
        process.stdin.flush()
        with bar(console, "Testing") as told:
            for line in process.stdout:
                news = msgspec.json.decode(line, type=ConformNews)
                report = news.report or report
                if news.total:
                    told(news.done, news.total)
        complaint = process.stderr.read().decode("utf-8", errors="replace").strip()
    if report is None:
        lines = complaint.splitlines()
        raise BusError(
            "bus.conform",
            lines[-1] if lines else f"The test ended without a report (code {process.returncode}).",
            "Check cable and power of the camera, then repeat the test.",
        )
    console.print(conformance_text(report), highlight=False, markup=False, soft_wrap=True)
    if json is not None:
        write_bytes(json, report.to_json())
    if page is not None:
        write_bytes(page, conformance_page(report).encode())
    codes = {Outcome.RED: _EXIT_RED, Outcome.INCOMPLETE: _EXIT_INCOMPLETE}
    raise typer.Exit(codes.get(report.outcome, 0))


camera_app = typer.Typer(
    no_args_is_help=True,
    help="Maintain one camera: alias, errors, identification, firmware.\n\n'alias' and 'firmware' "
    "need an idle bus and leave it in INIT.",
)


camera_app.command()(conform)


@camera_app.command()
def alias(
    camera: CameraArgument,
    value: Annotated[int, typer.Argument(help="New station alias.")],
    *,
    source: BusOption,
    rig: RigOption = RECOMMENDED_RIG,
    force: ForceOption = False,
) -> None:
    """Store a station alias in the EEPROM of a camera; it is in force after power-on.

    Distinct aliases and serial numbers reveal swapped cameras.
    """
    _maintain(source, rig, camera, alias_value=value, force=force)


@camera_app.command()
def firmware(
    camera: CameraArgument,
    file: Annotated[Path, typer.Argument(help="Firmware, signed by the maker of the camera.")],
    *,
    source: BusOption,
    rig: RigOption = RECOMMENDED_RIG,
    force: ForceOption = False,
) -> None:
    """Send firmware to a camera and start it.

    The camera accepts only firmware signed by its maker, stores it next to the running one, and
    returns to that if the new one does not start. An interrupted update changes nothing.
    """
    from ocmm_core.documents import read_bytes
    from ocmm_core.fieldbus.device import Firmware

    # Reject invalid firmware before the bus is disturbed.
    found = Firmware.read(read_bytes(file))
    make_console().print(
        say(f"Firmware {found.version}, {len(found.content)} bytes"), highlight=False
    )
    _maintain(source, rig, camera, image=file, force=force)


@camera_app.command()
def clear(
    camera: CameraArgument,
    *,
    source: BusOption,
    rig: RigOption = RECOMMENDED_RIG,
    force: ForceOption = False,
) -> None:
    """Clear the errors of a camera, and print their number."""
    from ocmm_core.cli.bus._session import open_bus
    from ocmm_core.fieldbus.objects import clear_error_history, read_error_history

    with open_bus(source, rig, camera=camera, force=force) as bus:
        access = bus.objects(camera)
        count = len(read_error_history(access))
        clear_error_history(access)
        left = len(read_error_history(access))
    make_console().print(
        say(f"Camera '{camera}' forgot {count} error(s); {left} left."), highlight=False
    )
    raise typer.Exit(1 if left else 0)


@camera_app.command()
def identify(
    camera: CameraArgument,
    *,
    source: BusOption,
    seconds: Annotated[int, typer.Option("--seconds", help="Duration of blinking, s.")] = 20,
    rig: RigOption = RECOMMENDED_RIG,
    force: ForceOption = False,
) -> None:
    """Make a camera blink, to find it in the machine."""
    from ocmm_core.cli.bus._session import open_bus
    from ocmm_core.fieldbus.objects import blink

    with open_bus(source, rig, camera=camera, force=force) as bus:
        left = blink(bus.objects(camera), seconds)
    make_console().print(say(f"Camera '{camera}' blinks for {left} s."), highlight=False)


def _maintain(
    source: str,
    rig: Path,
    camera: str,
    *,
    alias_value: int = 0,
    image: Path | None = None,
    force: bool = False,
) -> None:
    """Run it in the privileged process; show its progress."""
    from ocmm_core.acquisition.bus_process import MaintenanceNews
    from ocmm_core.camera import load_rig
    from ocmm_core.cli.bus._session import camera_of, maintenance_of

    serial = camera_of(load_rig(rig), camera).serial
    firmware_path = "" if image is None else str(image.absolute())
    command, first_lines = maintenance_of(
        source, rig, serial, alias_value, firmware_path, force=force
    )
    console = make_console()
    words = ""
    with (
        subprocess.Popen(  # noqa: S603 - our own interpreter and modules, no shell
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
        ) as process,
        interruptible(console),
    ):
        if process.stdin is None or process.stdout is None or process.stderr is None:
            raise BusError("bus.maintenance", "The process does not start.", "Try again.")
        process.stdin.write(first_lines)
        process.stdin.flush()
        with bar(console, say("Sending")) as told:
            for line in process.stdout:
                news = msgspec.json.decode(line, type=MaintenanceNews)
                words = news.words or words
                told(news.done, news.total)
        complaint = process.stderr.read().decode("utf-8", errors="replace").strip()
    if process.returncode or not words:
        lines = complaint.splitlines()
        raise BusError(
            "bus.maintenance",
            lines[-1] if lines else f"Nothing was changed (code {process.returncode}).",
            "Then repeat the command.",
        )
    console.print(say(words), highlight=False)
