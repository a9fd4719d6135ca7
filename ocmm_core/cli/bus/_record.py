"""``ocmm bus record``: the frames of the bus into a file that Wireshark opens."""

from __future__ import annotations

import os
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from ocmm_core.cli.bus._options import BusOption
from ocmm_core.cli.terminal import ForceOption, make_console, say
from ocmm_core.errors import BusError, StorageError

_PIECE = 1 << 16
_NOTHING = 300
"""A file with fewer bytes has heads and ends, and no frame."""


def record(
    file: Annotated[Path, typer.Argument(help="New file, .pcapng.")],
    *,
    source: BusOption,
    seconds: Annotated[
        float, typer.Option("--seconds", min=0.1, max=3600.0, help="How long.")
    ] = 10.0,
    megabytes: Annotated[
        int, typer.Option("--megabytes", min=1, max=2048, help="End at this size.")
    ] = 256,
    force: ForceOption = False,
) -> None:
    """Record what passes the network interface of the cameras, for Wireshark.

    The bus goes on undisturbed. 10 s at 1 kHz take about 70 MB with two cameras. Ctrl-C ends the
    recording and keeps what is there.
    """
    from ocmm_core.cli.bus._session import recorder_of

    if file.exists():
        raise StorageError(
            "out.file", f"{file} is there already.", "Give a new name, or delete that file."
        )
    command, first_lines = recorder_of(source, seconds, megabytes << 20, force=force)
    console = make_console()
    part = file.with_name(f"{file.name}.part")
    size = 0
    try:
        with (
            part.open("xb") as out,
            subprocess.Popen(  # noqa: S603 - our own interpreter and modules, no shell
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
            ) as process,
        ):
            if process.stdin is None or process.stdout is None or process.stderr is None:
                raise BusError("bus.record", "The process does not start.", "Try again.")
            process.stdin.write(first_lines)
            process.stdin.flush()
            console.print(say(f"Recording for {seconds:g} s; Ctrl-C ends it."), highlight=False)
            while True:
                try:
                    piece = os.read(process.stdout.fileno(), _PIECE)
                except KeyboardInterrupt:
                    # It ends by itself when its input ends, and writes the last block.
                    with suppress(OSError):
                        process.stdin.close()
                    continue
                if not piece:
                    break
                size += out.write(piece)
            complaint = process.stderr.read().decode("utf-8", errors="replace").strip()
        if process.returncode:
            lines = complaint.splitlines()
            raise BusError(
                "bus.record",
                lines[-1] if lines else f"The recorder ended (code {process.returncode}).",
                "Check the interface, then record again.",
            )
        part.rename(file)
    except OSError as error:
        raise StorageError(
            "out.file",
            f"{file}: cannot be written ({error.strerror}).",
            "Give a file in a folder that exists and that you may write to.",
        ) from error
    finally:
        part.unlink(missing_ok=True)
    console.print(say(f"{file}: {size:d} bytes"), highlight=False)
    if size < _NOTHING:
        console.print(say("No EtherCAT frame passed: is the bus running?"), highlight=False)
