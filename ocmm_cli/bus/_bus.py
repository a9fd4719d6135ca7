"""``ocmm bus``: list cameras, read and write their objects, record the bus; ``ocmm rig``."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ocmm_cli.bus._camera import black_app, history, intrinsics_app, snapshot, write_bytes
from ocmm_cli.terminal import error_text, heads, lead, make_console, print_grid, tr
from ocmm_core.cleanup import temporary_file
from ocmm_core.errors import BusError, InputError, StorageError
from ocmm_core.host import HOST

if TYPE_CHECKING:
    from ocmm_sim.bus import RigStatus


rig_app = typer.Typer(
    no_args_is_help=True,
    help="Software cameras on named interfaces, for a second program.\n\n'up' creates a pair of "
    "virtual network interfaces (ocmm0 and ocmm1); the cameras of the virtual rig answer "
    "on one as EtherCAT slaves, and a master (ocmm measure --source ethercat:ocmm0 or any "
    "other) uses the other. Needs root; touches only interfaces it created.",
)


@rig_app.command()
def up(*, plan: Path, rig: Path, probe: Path, part: Path, seed: int) -> None:
    """Make the interfaces and start the software cameras; the script begins with operation."""
    from ocmm_core.camera import load_rig
    from ocmm_core.composition import StationRequest
    from ocmm_core.inspection.plan import load_plan
    from ocmm_sim.bus import rig_up
    from ocmm_sim.sources import segment_of

    request = StationRequest(plan=plan, out=Path(), rig=rig, probe=probe, part=part, seed=seed)
    _print(rig_up(segment_of(request, load_plan(plan), load_rig(rig))))


@rig_app.command()
def down() -> None:
    """Stop the software cameras and remove the interfaces that 'up' made."""
    from ocmm_sim.bus import rig_down

    removed = rig_down()
    if removed is None:
        make_console().print(tr("No virtual rig on named interfaces."))
    else:
        make_console().print(
            tr(f"Removed {removed.host}, {removed.cameras} and their cameras."), highlight=True
        )


@rig_app.command()
def status() -> None:
    """Say what 'up' made and what of it runs."""
    from ocmm_sim.bus import rig_status

    _print(rig_status())


def _print(state: RigStatus) -> None:
    console = make_console()
    record = state.record
    if record is None:
        console.show("No virtual rig on named interfaces. Create one: ocmm rig up")
        return
    console.show(
        f"Master's side   {record.host}: {'there' if state.interface_there else 'gone'}",
        highlight=True,
    )
    running = tr(f"running, process {record.pid}") if state.cameras_running else tr("not running")
    console.show(
        f"Cameras         {', '.join(record.names)} on {record.cameras}: {running}", highlight=True
    )
    console.show(
        f"Measure         ocmm measure --source ethercat:{record.host} --plan ... --out ...",
        highlight=True,
    )


_PIECE = 1 << 16
_NOTHING = 300
"""Bytes; a smaller file has only headers, no frame."""


def record(file: Path, *, source: str, seconds: float, megabytes: int, force: bool) -> None:
    """Record what passes the network interface of the cameras, for Wireshark.

    The bus goes on undisturbed. 10 s at 1 kHz take about 70 MB with two cameras. Ctrl-C ends the
    recording and keeps what is there.
    """
    from ocmm_cli.bus._session import errand, recorder_of

    if file.exists():
        raise StorageError(
            "out.file", f"{file} is there already.", "Give a new name, or delete that file."
        )
    command, first_lines = recorder_of(source, seconds, megabytes << 20, force=force)
    console = make_console()
    part, size = None, 0
    try:
        descriptor, part = temporary_file(file)
        with (
            open(descriptor, "wb") as out,  # noqa: PTH123 - made next to the file
            errand(command, first_lines) as ran,
        ):
            console.show(f"Recording for {seconds:g} s; Ctrl-C ends it.")
            while True:
                try:
                    piece = os.read(ran.stdout.fileno(), _PIECE)
                except KeyboardInterrupt:
                    # It ends when its input ends, and writes the last block.
                    with suppress(OSError):
                        ran.stdin.close()
                    continue
                if not piece:
                    break
                size += out.write(piece)
            complaint = ran.complaint()
        if ran.returncode:
            raise BusError(
                "bus.record",
                complaint or f"The recorder ended (code {ran.returncode}).",
                "Check the interface, then record again.",
            )
        HOST.rename_new(part, file)
    except OSError as error:
        raise StorageError(
            "out.file",
            f"{file}: cannot be written ({error.strerror}).",
            "Give a file in a folder that exists and that you may write to.",
        ) from error
    finally:
        if part is not None:
            part.unlink(missing_ok=True)
    console.show(f"{file}: {size:d} bytes")
    if size < _NOTHING:
        console.show("No EtherCAT frame passed: is the bus running?")


bus_app = typer.Typer(
    no_args_is_help=True,
    help="Inspect the cameras on the bus and their objects.\n\nAll commands except 'decode' "
    "and 'record' take the bus into operation and release it at the end; nothing else may use it "
    "meanwhile. --source ethercat:virtual runs them on software cameras.",
)
object_app = typer.Typer(no_args_is_help=True, help="Read and write the objects of a camera.")
bus_app.add_typer(object_app, name="object")
bus_app.add_typer(black_app, name="black")
bus_app.add_typer(intrinsics_app, name="intrinsics")
bus_app.command()(snapshot)
bus_app.command()(history)
bus_app.command()(record)

_STATISTICS = (".json", ".csv")


@bus_app.command("scan")
def scan_command(*, source: str, rig: Path, force: bool) -> None:
    """List the devices on the bus and compare them with the rig.

    Configures nothing, so the serial number is the one in the EEPROM; when the bus is brought up
    it is compared with the camera's object 0x1018. Exit code 0: they are the cameras of the rig.
    """
    from ocmm_cli.bus._session import scan
    from ocmm_core.camera import load_rig
    from ocmm_core.composition import identities
    from ocmm_core.fieldbus.described import load_device
    from ocmm_core.fieldbus.device import assign

    console = make_console()
    loaded = load_rig(rig)
    expected = identities(loaded)
    # As at bring-up: cameras of other makers are compared with their description.
    described = load_device(loaded.device) if loaded.device else None
    devices = scan(source, rig, force=force)
    names = {camera.serial: camera.name for camera in expected}
    rows = []
    for position, scanned in enumerate(devices, start=1):
        device = scanned.device
        serial = device.serial if device.serial is not None else -1
        rows.append((
            str(position), names.get(serial, tr("not in the rig")), str(device.serial),
            str(device.alias), f"{device.vendor:#010x}", f"{device.product:#010x}",
            f"{device.revision:#010x}", scanned.state,
        ))  # fmt: skip
    columns = heads("Place", "Camera", "Serial", "Alias", "Vendor", "Product", "Revision", "State")
    print_grid(console, columns, rows)
    try:
        kind = None if described is None else (described.name, described.is_for)
        assign([scanned.device for scanned in devices], expected, kind)
    except BusError as error:
        console.print(error_text(error))
        raise typer.Exit(1) from error
    console.show("These are the cameras of the rig.")


@object_app.command()
def read(
    camera: str, address: str, *, source: str, rig: Path, out: Path | None, force: bool
) -> None:
    """Print an entry of a camera's object dictionary: bytes, number and text."""
    from ocmm_cli.bus._session import open_bus

    index, sub = _address(address)
    with open_bus(source, rig, camera=camera, force=force) as bus:
        value = bus.objects(camera).read(index, sub)
    if out is not None:
        write_bytes(out, value)
        return
    console = make_console()
    console.show(f"{index:04x}:{sub:02x}  {len(value)} bytes")
    console.print_line(value.hex(" ", 1) or tr("(empty)"))
    if 1 <= len(value) <= 8:
        console.print(f"{lead('number  ')}{int.from_bytes(value, 'little')}")
    if value and value.isascii() and value.decode("ascii").isprintable():
        console.print(f"{lead('text    ')}{value.decode('ascii')}")


@object_app.command()
def write(camera: str, address: str, value: str, *, source: str, rig: Path, force: bool) -> None:
    """Write an entry of a camera's object dictionary, read it back and compare."""
    from ocmm_cli.bus._session import open_bus

    index, sub = _address(address)
    try:
        content = bytes.fromhex(value)
    except ValueError:
        raise InputError(
            "bus.value",
            f"VALUE is '{value}', not a sequence of hexadecimal bytes.",
            "Give two digits for each byte, the lowest byte first.",
        ) from None
    with open_bus(source, rig, camera=camera, force=force) as bus:
        objects = bus.objects(camera)
        objects.write(index, sub, content)
        found = objects.read(index, sub)
    if found != content:
        raise BusError(
            "bus.value",
            f"Camera '{camera}' holds {found.hex(' ')} in {index:04x}:{sub:02x} after "
            f"{content.hex(' ')} was written.",
            "This is normal for commands; for a setting, check the value.",
        )
    make_console().print(
        tr(f"{index:04x}:{sub:02x} of camera '{camera}' is {content.hex(' ')}"), highlight=True
    )


@bus_app.command()
def watch(
    *, source: str, seconds: float, every: float | None, out: Path | None, statistics: Path | None,
    bus_processor: int | None, rig: Path, force: bool,
) -> None:  # fmt: skip
    """Run the bus for a while and print its report: cameras, cycles, clocks, events.

    It is the text that the window writes in Maintain, made to be mailed to support. Exit code 0:
    the bus was in operation at the end.
    """
    from ocmm_cli.bus._session import open_bus, watch_bus
    from ocmm_core.fieldbus.report import statistics_csv, statistics_json

    console = make_console()
    if statistics is not None and statistics.suffix not in _STATISTICS:
        raise InputError(
            "bus.statistics",
            f"'{statistics.name}' is neither .json nor .csv.",
            "Give a file with one of these endings.",
        )
    with open_bus(source, rig, force=force, wait=False, processor=bus_processor) as bus:
        text, in_operation = watch_bus(bus, seconds, every, console)
        report = bus.report()
    if statistics is not None:
        if report is None:
            raise BusError("bus.statistics", "The bus reported nothing.", "Watch it for longer.")
        form = statistics_csv if statistics.suffix == ".csv" else statistics_json
        write_bytes(statistics, form(report))
    if out is not None:
        write_bytes(out, text.encode("utf-8"))
    raise typer.Exit(0 if in_operation else 1)


@bus_app.command()
def decode(file: Path, *, cameras: int, record: Path | None, rig: Path) -> None:
    """Account for a bus that was recorded with tcpdump or tshark, down to the frames.

    A file that begins before the cameras are started explains itself. Damaged, repeated and
    contradicting answers are counted and not used.
    """
    from ocmm_cli.bus._decode import decode_capture
    from ocmm_core.camera import load_rig

    decode_capture(file, cameras, record, load_rig(rig), make_console())


def _address(text: str) -> tuple[int, int]:
    index, _, sub = text.partition(":")
    try:
        address = int(index, 16), int(sub or "0", 16)
    except ValueError:
        address = (-1, -1)
    if not (0 <= address[0] <= 0xFFFF and 0 <= address[1] <= 0xFF):
        raise InputError(
            "bus.address",
            f"'{text}' is not the address of an object.",
            "Give index and entry in hexadecimal, e.g. 1018:04.",
        )
    return address
