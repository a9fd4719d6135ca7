"""``ocmm bus decode``: counters of a bus recorded with tcpdump."""

from __future__ import annotations

from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from ocmm_cli.terminal import PlainConsole, heads, print_grid, tr, tr_later, tr_word
from ocmm_core.acquisition.frames import FrameBlock, SourceDescription
from ocmm_core.acquisition.recording import BusCapture, CaptureAccount, FrameRecorder
from ocmm_core.camera import Rig
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.wire import Command

_CYCLE_NS = 1_000_000
_MEANINGS = {
    "answers": tr_later("answers"),
    "damaged": tr_later("  check sum wrong"),
    "unproven": tr_later("  before their serial number was told"),
    "idle": tr_later("  not in operation"),
    "repeated": tr_later("  repeated"),
    "contradicting": tr_later("  contradicting"),
    "frames": tr_later("frames"),
    "known": tr_later("  sent again"),
    "missing": tr_later("  left out"),
    "overruns": tr_later("buffer overruns"),
    "restarts": tr_later("new starts"),
}
"""Counters of a camera, by field."""


def decode_capture(
    path: Path, n_cameras: int, recording: Path | None, rig: Rig, console: PlainConsole
) -> CaptureAccount:
    """Read a recorded bus, print its counters, and keep its frames in `recording`, if any."""
    capture = BusCapture(path, n_cameras)
    with ExitStack() as stack:
        progress = stack.enter_context(
            Progress(
                SpinnerColumn(),
                TextColumn("{task.fields[packets]} " + tr("packets"), markup=False),
                TimeElapsedColumn(),
                console=console,
                transient=True,
            )
        )
        task = progress.add_task("", total=None, packets=0)
        recorder: FrameRecorder | None = None
        for block in capture.blocks():
            progress.update(task, packets=capture.account.packets)
            if recording is None:
                continue
            if recorder is None:
                order = _order(path, capture, rig)
                recorder = stack.enter_context(
                    FrameRecorder(recording, _description(path, capture, rig), rig)
                )
            recorder.append(_reordered(block, order))
    print_account(capture.account, console)
    if recording is not None and recorder is None:
        raise InputError(
            "capture.no_frames",
            f"{path}: contains no frame from all cameras.",
            "Record while the cameras are in operation.",
        )
    return capture.account


def print_account(account: CaptureAccount, console: PlainConsole) -> None:
    console.show(
        f"Packets    {account.packets}: {account.other} not EtherCAT, {account.malformed} "
        f"malformed, {account.cut} recorded in part"
    )
    if account.first_ns:
        begin = datetime.fromtimestamp(account.first_ns * 1e-9, UTC)
        seconds = (account.last_ns - account.first_ns) * 1e-9
        console.show(f"Time       {begin:%Y-%m-%d %H:%M:%S} UTC, {seconds:.3f} s")
    if account.cut_off:
        console.show("The file ends in the middle of a packet.")
    names = [command.name for command in Command]
    known = [name for name in names if name in account.sent or name in account.returned]
    unknown = sorted((set(account.sent) | set(account.returned)) - set(names))
    rows = [
        (name, str(account.sent[name]), str(account.returned[name])) for name in (*known, *unknown)
    ]
    print_grid(console, heads("Command", "Sent", "Returned"), rows)
    console.show(
        f"Cycles     {account.cycles} sent, {account.answered} answered, "
        f"{account.short} answers with a low working counter"
    )
    console.show(f"Exposures  {account.joined} from all cameras, {account.unjoined} not from all")
    cameras = account.cameras
    counters = [
        (tr(meaning), *(str(getattr(camera, field)) for camera in cameras))
        for field, meaning in _MEANINGS.items()
    ]
    if cameras:
        columns = (tr_word("Answers and frames"), *(camera.name for camera in cameras))
        print_grid(console, columns, counters)


def _order(path: Path, capture: BusCapture, rig: Rig) -> list[int]:
    """Return, for each camera of the rig, its position on the recorded wire."""
    serials = capture.serials
    wanted = [camera.serial for camera in rig.cameras]
    if all(serial is None for serial in serials) and len(serials) == len(wanted):
        return list(range(len(wanted)))
    if sorted(serial or 0 for serial in serials) != sorted(wanted):
        found = ", ".join(str(serial) for serial in serials)
        raise InputError(
            "capture.cameras",
            f"{path}: the cameras with the serial numbers {found} are not those of the rig.",
            "Give --rig the document of these cameras.",
        )
    return [serials.index(serial) for serial in wanted]


def _reordered(block: FrameBlock, order: list[int]) -> FrameBlock:
    return FrameBlock(
        block.counter,
        block.time_ns,
        block.flags,
        np.ascontiguousarray(block.valid[:, order]),
        np.ascontiguousarray(block.uv[:, order]),
    )


def _description(path: Path, capture: BusCapture, rig: Rig) -> SourceDescription:
    return SourceDescription(
        name=f"EtherCAT, recorded in {path.name}",
        camera_serials=tuple(camera.serial for camera in rig.cameras),
        frame_period_ns=capture.period_ns,
        cycle_period_ns=_CYCLE_NS,
        live=True,
        # A capture file does not contain the kind of its interface.
        simulated=False,
    )
