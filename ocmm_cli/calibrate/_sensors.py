"""``ocmm calibrate sensors``: learn the sensor pattern from a waved probe."""

from __future__ import annotations

import time
from datetime import datetime
from pathlib import Path

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from ocmm_cli.calibrate._run import TerminalSite
from ocmm_cli.terminal import DeferredInterrupt, PlainConsole, lead, say
from ocmm_core.acquisition.frames import AcquisitionState, read_status
from ocmm_core.calibration import monitor
from ocmm_core.composition import Feed
from ocmm_core.errors import CalibrationError
from ocmm_core.tracking import ProbeBody, TrackingPipeline

_LOOK_NS = 10_000_000
_BATCH = 800
_IDLE_S = 0.005


def require_usable(site: TerminalSite, now: datetime) -> str:
    """Return the hash of the calibration in force, to which the baseline belongs.

    Raises CalibrationError if it is missing or unusable: a moved camera must not be learned.
    """
    status = site.store.status(now)
    calibration = site.store.active_hash
    if calibration is None or not status.state.usable:
        raise CalibrationError(
            "baseline.standing",
            f"The calibration is {status.state.value}: {status.reason}",
            status.remedy,
        )
    return calibration


def wave(
    site: TerminalSite, body: ProbeBody, feed: Feed, seconds: float, console: PlainConsole
) -> list[monitor.ResidualSample]:
    """Return samples of the probe over ``seconds`` of bus time, or until the source ends."""
    pipeline = TrackingPipeline(site.rig, body)
    collector = monitor.ResidualAccumulator(site.rig, body, _LOOK_NS)
    looks: list[monitor.ResidualSample] = []
    left = round(seconds * 1e9 / feed.description.frame_period_ns)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    console.print(f"{lead('Source   ')}{feed.description.name}", highlight=True)
    interrupt = DeferredInterrupt()
    try:
        with Progress(*columns, console=console, transient=True) as progress:
            task = progress.add_task(say("Wave the probe through the whole volume"), total=left)
            feed.acquisition.start()
            while left > 0 and not interrupt.check():
                stopped = read_status(feed.ring).state is AcquisitionState.STOPPED
                block = feed.ring.read(min(_BATCH, left))
                if block is not None:
                    looks += collector.feed(pipeline.process(block))
                    left -= len(block)
                    progress.advance(task, len(block))
                elif stopped:
                    break
                else:
                    time.sleep(_IDLE_S)
    finally:
        feed.end()
        interrupt.close()
    return looks


def learn(
    site: TerminalSite,
    body: ProbeBody,
    looks: list[monitor.ResidualSample],
    calibration: str,
    console: PlainConsole,
) -> Path:
    """Learn the baseline, store it next to the calibration, and print its quality."""
    baseline: monitor.Baseline = monitor.learn_baseline(looks, site.rig, body)
    path = monitor.save_baseline(site.store.folder, baseline, calibration, body.identity)
    whole = site.rig.noise.pattern_px
    console.say(
        f"Sensors  {baseline.looks} samples; pattern {whole:.4f} px, residual "
        f"{baseline.left_px:.4f} px"
    )
    console.print(f"{lead('Baseline ')}{path}")
    return path
