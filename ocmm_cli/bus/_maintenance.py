"""``ocmm camera``: alias, errors, firmware, descriptions, and GigE Vision cameras."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import msgspec
import typer

from ocmm_cli.bus._camera import follow_errand, write_bytes
from ocmm_cli.terminal import error_text, heads, make_console, print_grid, tr
from ocmm_core.errors import AcquisitionError, BusError, InputError

if TYPE_CHECKING:
    from ocmm_core.fieldbus.described import Role

_Sends = Literal["pixels", "corrected mm, one step", "corrected mm, exact"]
_Clock = Literal["distributed", "arrival"]


def describe(
    esi: Path, *, out: Path | None, product: str, revision: str, role: list[str] | None,
    output: list[str] | None, sends: _Sends | None, step: float | None, clock: _Clock | None,
    doubt_ns: int | None, cycle_ns: int, latency_ns: int,
) -> None:  # fmt: skip
    """Convert the ESI file of another maker's camera to a device description.

    The file contains places and types, not their meaning: roles, unit, step and clock are in the
    manual of the camera. Without --out, the entries and the missing statements are listed.
    """
    from ocmm_core.fieldbus import described

    device = described.choose_device(
        esi,
        _number("--product", product) if product else None,
        _number("--revision", revision) if revision else None,
    )
    stated = described.EsiStatements(
        roles={
            _role(name): tuple(_key("--role", part) for part in keys.split(","))
            for name, keys in (_halves("--role", one) for one in role or ())
        },
        constants={
            _key("--output", key): _number("--output", value)
            for key, value in (_halves("--output", one) for one in output or ())
        },
        sends=described.Sends(sends) if sends else None, step=step,
        clock=described.Clock(clock) if clock else None, doubt_ns=doubt_ns, cycle_ns=cycle_ns,
        latency_ns=latency_ns,
    )  # fmt: skip
    console = make_console(soft_wrap=True)
    rows = []
    for pdo in (*device.inputs, *device.outputs):
        for entry in pdo.entries if pdo.assigned else ():
            key = entry.key if entry.index else tr("gap")
            rows.append((f"{pdo.index:#06x}", key, str(entry.bits), entry.type, entry.name))
    title = f"{device.name}: {device.product:#010x}, {device.revision:#010x}"
    print_grid(console, heads("Object", "Entry", "Bits", "Type", "Name"), rows, title)
    for part in device.left_out:
        console.show(f"Left out: {part}.")
    if out is not None:
        write_bytes(out, described.describe_esi(device, stated).encode())
        return
    for sentence in described.missing_statements(device, stated):
        console.show(sentence)


def _halves(option: str, text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise _error(option, text)
    return name.strip().lower(), value.strip()


def _role(name: str) -> Role:
    from ocmm_core.fieldbus.described import Role

    try:
        return Role(name)
    except ValueError:
        raise _error("--role", name) from None


def _key(option: str, text: str) -> str:
    """Return an entry in the form of the table."""
    index, colon, sub = text.strip().partition(":")
    try:
        return f"{int(index, 16):#06x}:{int(sub if colon else '0', 16):02x}"
    except ValueError:
        raise _error(option, text) from None


def _number(option: str, text: str) -> int:
    try:
        return int(text, 0)
    except ValueError:
        raise _error(option, text) from None


def _error(option: str, text: str) -> InputError:
    return InputError(
        "esi.option",
        f"{option}: {text[:60]!r} cannot be read.",
        "Write roles like x=0x6000:01,0x6000:03, outputs like 0x7000:01=5, codes like 0x1234.",
    )


camera_app = typer.Typer(
    no_args_is_help=True,
    help="Maintain one camera: alias, errors, identification, firmware.\n\n'alias' and 'firmware' "
    "need an idle bus and leave it in INIT.",
)


camera_app.command()(describe)


@camera_app.command()
def alias(camera: str, value: int, *, source: str, rig: Path, force: bool) -> None:
    """Store a station alias in the EEPROM of a camera; it is in force after power-on.

    Distinct aliases and serial numbers reveal swapped cameras.
    """
    _maintain(source, rig, camera, alias_value=value, force=force)


@camera_app.command()
def firmware(camera: str, file: Path, *, source: str, rig: Path, force: bool) -> None:
    """Send firmware to a camera and start it.

    The camera accepts only firmware signed by its maker, stores it next to the running one, and
    returns to that if the new one does not start. An interrupted update changes nothing.
    """
    from ocmm_core.documents import read_bytes
    from ocmm_core.fieldbus.device import Firmware

    # Reject invalid firmware before the bus is disturbed.
    found = Firmware.read(read_bytes(file))
    make_console().print(tr(f"Firmware {found.version}, {len(found.content)} bytes"))
    _maintain(source, rig, camera, image=file, force=force)


@camera_app.command()
def clear(camera: str, *, source: str, rig: Path, force: bool) -> None:
    """Clear the errors of a camera, and print their number."""
    from ocmm_cli.bus._session import open_bus
    from ocmm_core.fieldbus.objects import clear_error_history, read_error_history

    with open_bus(source, rig, camera=camera, force=force) as bus:
        access = bus.objects(camera)
        count = len(read_error_history(access))
        clear_error_history(access)
        left = len(read_error_history(access))
    make_console().print(tr(f"Camera '{camera}' forgot {count} error(s); {left} left."))
    raise typer.Exit(1 if left else 0)


@camera_app.command()
def identify(camera: str, *, source: str, seconds: int, rig: Path, force: bool) -> None:
    """Make a camera blink, to find it in the machine."""
    from ocmm_cli.bus._session import open_bus
    from ocmm_core.fieldbus.objects import blink

    with open_bus(source, rig, camera=camera, force=force) as bus:
        left = blink(bus.objects(camera), seconds)
    make_console().print(tr(f"Camera '{camera}' blinks for {left} s."))


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
    from ocmm_cli.bus._session import bus_to_scan, camera_of, command_of, segment_for
    from ocmm_core.acquisition.bus_process import MaintenanceConfig, MaintenanceNews
    from ocmm_core.camera import load_rig

    serial = camera_of(load_rig(rig), camera).serial
    firmware_path = "" if image is None else str(image.absolute())
    named = bus_to_scan(source)
    config = MaintenanceConfig(
        interface=named.value, force=force, serial=serial, alias=alias_value, firmware=firmware_path
    )
    command, first_lines = command_of(config, segment_for(named, rig))
    console = make_console()
    words = ""

    def parse(line: bytes) -> tuple[int, int]:
        nonlocal words
        news = msgspec.json.decode(line, type=MaintenanceNews)
        words = news.words or words
        return news.done, news.total

    returncode, complaint = follow_errand(command, first_lines, console, tr("Sending"), parse)
    if returncode or not words:
        raise BusError(
            "bus.maintenance",
            complaint or f"Nothing was changed (code {returncode}).",
            "Then repeat the command.",
        )
    console.show(words)


@camera_app.command()
def expose(
    *, source: str, rig: Path, exposure: float | None, gain: float | None, keep: bool
) -> None:
    """Set exposure time and gain of GigE Vision cameras: the brightest LED fills 70 % of a pixel.

    Wave the probe through the volume meanwhile, nearest to the cameras too. All cameras get one
    exposure time. Ends with 1 if an LED is too dark, too bright, or not seen.
    """
    from ocmm_core.camera import load_rig
    from ocmm_genicam import Brightness, ViewfinderProcess, named_cameras

    console = make_console()
    with contextlib.closing(ViewfinderProcess(*named_cameras(source, load_rig(rig)))) as cameras:
        if gain is not None:
            cameras.gain(gain)
        if exposure is not None:
            cameras.expose(exposure)
        looks = cameras.look() if exposure is not None else cameras.settle()
        if keep:
            cameras.store()
    rows = [
        (one.serial, *(text.replace("nan", "–") for text in (
            f"{one.exposure_us:.6g}", f"{one.gain:.4g}", f"{100.0 * one.brightest:.0f} %",
            f"{one.width_px:.2f}")),
         str(len(one.spots_px)), f"{one.incomplete}", tr(one.brightness), one.load)
        for one in looks
    ]  # fmt: skip
    columns = heads("Serial", "Exposure, µs", "Gain", "Brightest", "Spot px", "LEDs", "Incomplete",
                    "Verdict", "Network card")  # fmt: skip
    print_grid(console, columns, rows)
    if keep:
        console.show("The cameras load these settings at power-up.")
    if any(one.brightness is not Brightness.GOOD for one in looks):
        raise typer.Exit(1)


@camera_app.command()
def black(*, source: str, rig: Path, calibrations: Path | None) -> None:
    """Take the black images of GigE Vision cameras, with LEDs off and lenses covered.

    They are used by jobs with the same exposure time and gain; hot pixels by all jobs. Take them
    again after a change of exposure, and when the cameras are warm.
    """
    from ocmm_core.calibration.records import default_folder, store_folder
    from ocmm_core.camera import load_rig
    from ocmm_genicam import ViewfinderProcess, named_cameras

    design = load_rig(rig)
    named = named_cameras(source, design)
    folder = store_folder(calibrations or default_folder(), design.name)
    with contextlib.closing(ViewfinderProcess(*named)) as cameras:
        found = cameras.black(folder)
    console = make_console()
    for serial, count in zip(named[0], found, strict=True):
        console.show(f"Camera {serial}: black image stored, {count} hot pixel(s).")


@camera_app.command()
def genicam(*, gentl: bool) -> None:
    """List the GenICam cameras that are found, and what their sensors and features allow.

    Each camera is opened, not changed, and released. Ends with 1 if there is none.
    """
    from ocmm_genicam import camera_library, lost_by, sensor_size, settings_of

    console = make_console()
    cameras = camera_library(gentl)
    rows, notes = [], []
    for serial, model in cameras.found().items():
        try:
            camera = cameras.open(serial)
        except AcquisitionError as error:
            rows.append((serial, model, "–", "–"))
            notes.append(error_text(error))
            continue
        try:
            size = "{} x {}".format(*sensor_size(camera))
            rows.append((serial, model, size, f"{settings_of(camera)[0]:.6g}"))
            notes += [f"{serial}: {tr(lost)}" for lost in lost_by(camera)]
        finally:
            camera.close()
    if not rows:
        console.show(
            "No camera was found. Check power and cables; for GigE Vision, also that their "
            "addresses are in the network of this computer, and that no firewall blocks UDP port "
            "3956."
        )
        raise typer.Exit(1)
    print_grid(console, heads("Serial", "Maker and model", "Pixels", "Exposure, µs"), rows)
    for note in notes:
        console.print(note)
