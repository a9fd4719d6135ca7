"""``ocmm calibrate tracker`` and ``scale``: noise and scale of an optical tracker."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import typer

from ocmm_cli.calibrate._setup import CameraSetup, ProbeChoice
from ocmm_cli.terminal import error_text, heads, make_console, print_grid, tr

if TYPE_CHECKING:
    from ocmm_core.calibration.records import CameraRecord
    from ocmm_core.camera import TrackerNoise


def tracker(*, valid_days: int, choice: ProbeChoice, setup: CameraSetup) -> None:
    """Measure the noise of an optical tracker: a minute at rest, then places all over its volume.

    The measured noise replaces that of its document, and is SUSPECT until 'verify' has passed.
    """
    from ocmm_cli.calibrate import _run as run
    from ocmm_cli.calibrate import _steps as steps
    from ocmm_cli.calibrate._report import print_status
    from ocmm_core.calibration.cameras import TrackerProcedure, TrackerSetup

    console, site = make_console(), run.open_site(setup.rig, setup.calibrations)
    body = steps.body_in_use_of(setup.source, choice)
    stated = TrackerSetup(who=setup.who, valid_days=valid_days)
    place = site.of_cameras(site.rig, body)
    procedure = run.opened(TrackerProcedure, place, stated, setup, console)
    if steps.is_lacking(procedure):
        steps.collect_from(
            procedure, site, setup, choice.probe,
            lambda sim, at: sim.scenes_of_tracker(at, site.rig, procedure.view), console,
        )  # fmt: skip
    procedure.compute()
    outcome = procedure.view.outcome
    if outcome is not None and site.rig.markers is not None:
        _print_noise(site.rig.markers.document.noise, outcome.record)
        for warning in outcome.warnings:
            console.print(error_text(warning), style="yellow", highlight=True)
    code = steps.decided_code(procedure, setup.decision, "measured", console)
    print_status(console, site.document, site.calibrations, run.now())
    if code:
        raise typer.Exit(code)


def scale(*, rig: Path, calibrations: Path | None, who: str, reason: str) -> None:
    """Correct the scale of an optical tracker by its last verification, if that failed.

    The tracker is then SUSPECT until a verification with another length bar has passed.
    """
    from ocmm_cli.calibrate import _run as run
    from ocmm_cli.calibrate._report import print_status
    from ocmm_core.calibration.cameras import correct_scale

    console, site = make_console(), run.open_site(rig, calibrations)
    before = site.rig.markers
    record = correct_scale(site.store, who, reason, run.now())
    if before is not None:
        _print_noise(before.document.noise, record)
    print_status(console, site.document, site.calibrations, run.now())


def _print_noise(before: TrackerNoise, record: CameraRecord) -> None:
    """Print each value of the noise before and after."""
    from ocmm_core.camera import noise_pairs

    if isinstance(record.tracker, msgspec.UnsetType):
        return
    rows = noise_pairs(before, record.tracker.noise)
    title = tr(f"Noise of tracker {record.rig}")
    print_grid(make_console(), heads("Field", "Stated before", "Now"), rows, title)
