"""``ocmm record``: the raw frames of a source to a file."""

from __future__ import annotations

import time
from pathlib import Path

from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from ocmm_cli.measure._headless import print_counters
from ocmm_cli.terminal import DeferredInterrupt, PlainConsole, lead, tr
from ocmm_core.acquisition.frames import AcquisitionState, StopReason, read_status
from ocmm_core.acquisition.recording import FrameRecorder
from ocmm_core.composition import StationRequest, calibration_of, make_feed
from ocmm_core.inspection.plan import load_plan

_BATCH = 800
_IDLE_S = 0.005


def record_source(
    request: StationRequest, path: Path, seconds: float | None, console: PlainConsole
) -> None:
    """Record until a source ends or ``seconds`` of bus time; AcquisitionError keeps the frames."""
    plan, rig = load_plan(request.plan), calibration_of(request).rig
    feed = make_feed(request, plan, rig, untimed=True)
    frames = 0
    limit = feed.script_frames
    if seconds is not None:
        limit = round(seconds * 1e9 / feed.description.frame_period_ns)
    interrupt = DeferredInterrupt(f"{lead('Recording ')}{path}")
    try:
        with FrameRecorder(path, feed.description, rig) as recorder, _progress(console) as progress:
            task = progress.add_task("", total=None)
            feed.acquisition.start()
            while not interrupt.check() and (limit is None or frames < limit):
                stopped = read_status(feed.ring).state is AcquisitionState.STOPPED
                left = _BATCH if limit is None else limit - frames
                block = feed.ring.read(min(_BATCH, left))
                if block is not None:
                    recorder.append(block)
                    frames += len(block)
                    progress.update(task, description=tr(f"{frames:d} frames"))
                elif stopped:
                    break
                else:
                    time.sleep(_IDLE_S)
    finally:
        status = feed.end()
        interrupt.close()
    print_counters(console, status)
    if status.stop_reason is StopReason.FAILED:
        raise status.error("record.source", f"The {frames} frames before that are in {path}.")
    console.show(f"Recording  {path}: {frames} frames", highlight=True)


def _progress(console: PlainConsole) -> Progress:
    return Progress(
        SpinnerColumn(),
        TextColumn(lead("Recording ") + "{task.description}", markup=False),
        TimeElapsedColumn(),
        console=console,
        transient=True,
    )
