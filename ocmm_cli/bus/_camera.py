"""``ocmm bus snapshot | black | intrinsics | history``: data of one camera.

Also options and file writing shared by the commands of ``ocmm bus``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from ocmm_cli.terminal import PlainConsole, heads, make_console, print_grid, tr
from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError, StorageError
from ocmm_core.failure import INTERRUPTED

if TYPE_CHECKING:
    from ocmm_core.fieldbus.device import Window
    from ocmm_core.fieldbus.objects import BlackImageState
    from ocmm_core.fieldbus.objects import Progress as Told


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file atomically and print its path."""
    try:
        write_atomic(path, content)
    except OSError as error:
        raise StorageError(
            "out.file",
            f"{path}: cannot be written ({error.strerror}).",
            "Give a file in a folder that exists and that you may write to.",
        ) from error
    make_console().print(tr(f"{path}: {len(content)} bytes"))


black_app = typer.Typer(
    no_args_is_help=True,
    help="The black image of a camera: what its sensor shows without light.\n\nThe camera "
    "subtracts it from every exposure. 'measure' makes a new one, used at once and until "
    "power-off; 'store' keeps it permanently.",
)
intrinsics_app = typer.Typer(
    no_args_is_help=True, help="The intrinsics that a camera stores: its lens and sensor."
)


def snapshot(
    camera: str, file: Path, *, source: str, region: str | None, rig: Path, force: bool
) -> None:
    """Take a raw picture with a camera.

    Grey levels are those of the sensor (0 to 16383), not scaled: most programs show them dark.
    The cameras go on measuring. Ctrl-C gives up and writes nothing.
    """
    from ocmm_cli.bus._session import open_bus
    from ocmm_core.fieldbus.objects import encoder_for, take_snapshot

    encode = encoder_for(file)
    window = _window(region)
    console = make_console()
    with open_bus(source, rig, camera=camera, force=force) as bus, interruptible(console):
        access = bus.objects(camera)
        console.show(f"Camera '{camera}' takes a picture; Ctrl-C cancels.", highlight=True)
        with bar(console, tr("Fetching it")) as told:
            picture = take_snapshot(access, window, told)
    console.show(
        f"{picture.shape[1]} x {picture.shape[0]} pixels, grey levels {picture.min()} to "
        f"{picture.max()}, mean {picture.mean():.1f}"
    )
    write_bytes(file, encode(picture))


@black_app.command()
def measure(camera: str, *, source: str, frames: int, store: bool, rig: Path, force: bool) -> None:
    """Average exposures without light; there are no spots meanwhile."""
    from ocmm_cli.bus._session import open_bus
    from ocmm_core.fieldbus.objects import measure_black_image, store_black_image

    console = make_console()
    with open_bus(source, rig, camera=camera, force=force) as bus, interruptible(console):
        access = bus.objects(camera)
        with bar(console, "Averaging") as told:
            state = measure_black_image(access, frames, told)
        if store:
            state = store_black_image(access)
    _print_black(console, state)


def _black_command(name: str, help_: str) -> None:
    """Add a command whose only argument is the camera."""

    @black_app.command(name, help=help_)
    def command(camera: str, *, source: str, rig: Path, force: bool) -> None:
        from ocmm_cli.bus._session import open_bus
        from ocmm_core.fieldbus.objects import (
            clear_black_image,
            load_black_image,
            read_black_image,
            store_black_image,
        )

        with open_bus(source, rig, camera=camera, force=force) as bus:
            works = {
                "store": store_black_image,
                "load": load_black_image,
                "clear": clear_black_image,
                "show": read_black_image,
            }
            state = works[name](bus.objects(camera))
        _print_black(make_console(), state)


_black_command("store", "Store the active black image permanently.")
_black_command("load", "Use the stored black image.")
_black_command("clear", "Use no black image and delete the stored one.")
_black_command("show", "List the black images.")


@intrinsics_app.command("read")
def read_command(camera: str, *, source: str, rig: Path, force: bool) -> None:
    """Print the intrinsics that a camera stores, beside those of the rig document.

    Exit code 0: they are the same.
    """
    from ocmm_cli.bus._session import camera_of, open_bus
    from ocmm_core.fieldbus.device import Intrinsics
    from ocmm_core.fieldbus.objects import read_intrinsics

    console = make_console()
    with open_bus(source, rig, camera=camera, force=force) as bus:
        stored = read_intrinsics(bus.objects(camera))
        expected = Intrinsics.from_camera(camera_of(bus.rig, camera), 0)
    if stored is None:
        console.show(f"Camera '{camera}' stores no intrinsics.", highlight=True)
        raise typer.Exit(1)
    rows, same = [], True
    for field in fields(Intrinsics):
        if field.name == "date_s":
            continue
        ours, theirs = getattr(expected, field.name), getattr(stored, field.name)
        same = same and ours == theirs
        rows.append((field.name, repr(theirs), repr(ours) if ours != theirs else tr("the same")))
    print_grid(console, ("", *heads("Camera", "Rig document")), rows)
    date = datetime.fromtimestamp(stored.date_s, UTC)
    console.show(f"Written {date:%Y-%m-%d %H:%M:%S} UTC.")
    raise typer.Exit(0 if same else 1)


@intrinsics_app.command("write")
def write_command(camera: str, *, source: str, note: str, rig: Path, force: bool) -> None:
    """Store the intrinsics of the rig document in a camera and read them back."""
    from ocmm_cli.bus._session import camera_of, open_bus
    from ocmm_core.fieldbus.device import Intrinsics
    from ocmm_core.fieldbus.objects import write_intrinsics

    with open_bus(source, rig, camera=camera, force=force) as bus:
        intrinsics = Intrinsics.from_camera(camera_of(bus.rig, camera), int(time.time()))
        write_intrinsics(bus.objects(camera), intrinsics, note)
    make_console().print(
        tr(f"Camera '{camera}' (serial {intrinsics.serial}) stores the intrinsics of {rig}."),
        highlight=True,
    )


def history(camera: str, *, source: str, clear: bool, rig: Path, force: bool) -> None:
    """List the errors that a camera remembers, oldest first."""
    from ocmm_cli.bus._session import open_bus
    from ocmm_core.fieldbus.objects import Emergency, clear_error_history, read_error_history

    console = make_console()
    with open_bus(source, rig, camera=camera, force=force) as bus:
        access = bus.objects(camera)
        messages = read_error_history(access)
        if clear:
            clear_error_history(access)
    if not messages:
        console.show(f"Camera '{camera}' has no errors in its history.", highlight=True)
        return
    rows = [
        (
            f"{one.time_ns * 1e-9:.3f}", f"{one.code:#06x}",
            tr(Emergency(one.code, one.register, one.data).text), f"{one.register:#04x}",
            one.data.hex(" "),
        )
        for one in messages
    ]  # fmt: skip
    print_grid(console, heads("Bus time s", "Code", "Meaning", "Register", "Data"), rows)


@contextmanager
def bar(console: PlainConsole, text: str) -> Iterator[Told]:
    with Progress(
        TextColumn(text, markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        console=console,
        transient=True,
    ) as progress:
        task = progress.add_task("", total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total or None)


def follow_errand(
    command: list[str],
    first_lines: bytes,
    console: PlainConsole,
    text: str,
    take: Callable[[bytes], tuple[int, int]],
) -> tuple[int, str]:
    """Run an errand with a bar, and return its exit code and complaint.

    ``take`` gets each line that it writes, and returns how much of how much is done.
    """
    from ocmm_cli.bus._session import errand

    with errand(command, first_lines) as ran, interruptible(console):
        with bar(console, text) as told:
            for line in ran.stdout:
                done, total = take(line)
                if total:
                    told(done, total)
        complaint = ran.complaint()
    return ran.returncode, complaint


@contextmanager
def interruptible(console: PlainConsole) -> Iterator[None]:
    """Print a message on Ctrl-C."""
    try:
        yield
    except KeyboardInterrupt:
        console.show("Stopped; the camera was notified.")
        raise typer.Exit(INTERRUPTED) from None


def _window(text: str | None) -> Window | None:
    if text is None:
        return None
    try:
        left, top, width, height = (int(part) for part in text.split(","))
    except ValueError:
        left = top = width = height = -1
    if min(left, top) < 0 or min(width, height) < 1 or max(left, top, width, height) > 0xFFFF:
        raise InputError(
            "bus.region",
            f"--region is '{text}', which is not a region.",
            "Give LEFT,TOP,WIDTH,HEIGHT in whole pixels, e.g. 100,80,64,48.",
        )
    return left, top, width, height


def _print_black(console: PlainConsole, state: BlackImageState) -> None:
    from ocmm_core.fieldbus.device import BlackImage

    images = {BlackImage.IN_USE: tr("in use"), BlackImage.STORED: tr("stored")}
    words = [word for flag, word in images.items() if state.images & flag]
    if BlackImage.IN_USE not in state.images:
        console.show(
            f"No black image is in use{'; one is stored' if words else ''}.", highlight=True
        )
        return
    console.show_line(
        f"Black image {tr(' and ').join(words)}: mean {state.mean:.1f} grey levels, "
        f"SHA-256 {state.sha256}"
    )
