"""``ocmm calibrate pictures``: simultaneous pictures of all cameras, one view after the other."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer


def take_pictures(
    *, folder: Annotated[Path, typer.Argument()], source: str, rig: Path, views: int, every: float,
    board: Path | None,
) -> None:  # fmt: skip
    """Take pictures of a calibration board with all cameras at the same moment.

    The cameras are those of a source genicam:SERIAL,SERIAL, with a common clock (PTP). Each view
    becomes a file VIEW-SERIAL.png for each camera; a folder with views is continued. With --board,
    the corners that were found in each picture are told. Hold the board still at the end of each
    countdown. Ctrl-C ends; all pictures so far are kept.
    """
    from ocmm_boards._board import load_board
    from ocmm_boards._detection import corner_finder, genicam_source, next_view, write_view
    from ocmm_cli.terminal import DeferredInterrupt, make_console, progress_line, say
    from ocmm_core.camera import load_rig

    console = make_console()
    design = load_rig(rig)
    known = None if board is None else load_board(board)
    find = None if known is None else corner_finder(known)
    cameras = genicam_source(source, design)
    first = next_view(folder)
    interrupt = DeferredInterrupt(say("All pictures so far are kept."))
    try:
        cameras.open()
        for number in range(first, first + views):
            with progress_line() as tell:
                begun = time.monotonic()
                while (left := begun + every - time.monotonic()) > 0.0:
                    # Read meanwhile: a silent camera is told at once, and no image waits.
                    cameras.read()
                    tell(say(f"View {number:d}: hold the board still"), 1.0 - left / every)
                    if interrupt.check():
                        return
            pictures = cameras.pictures(2.0)
            said = []
            for camera, picture in zip(design.cameras, pictures, strict=True):
                found = "" if find is None else say(f", {find(picture):d} corners")
                said.append(f"{camera.name}{found}")
            write_view(folder, number, design, pictures)
            console.say(f"View {number:d}: {', '.join(said)}", highlight=True)
    finally:
        cameras.close()
        interrupt.close()
    console.say(f"{views:d} views are in {folder}.")
