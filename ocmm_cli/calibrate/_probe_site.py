"""Cameras, records and frames for probe calibration on the command line."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Protocol, TypeVar

from rich.console import Console

from ocmm_cli.calibrate._run import SESSIONS, TerminalSite, collect, make_recorder
from ocmm_cli.terminal import lead, say_word, told
from ocmm_core.calibration.guided import Procedure
from ocmm_core.calibration.records import (
    CalibrationInUse,
    CalibrationStatus,
    CalibrationStore,
    ProbeStore,
    default_folder,
    default_probe_folder,
    judge,
    probe_store_folder,
    store_folder,
)
from ocmm_core.camera import load_rig
from ocmm_core.composition import Feed, Origin, checked_for_replay, choose_calibration, origin_of
from ocmm_core.errors import CalibrationError
from ocmm_core.tracking import ProbeBody, load_probe


class AboutTip(Protocol):
    tip: str


P = TypeVar("P", bound=AboutTip)


@dataclass(frozen=True, slots=True)
class TerminalProbeSite:
    """Resources of a session about a probe."""

    site: TerminalSite
    """Cameras, with the folder of sessions about the probe."""
    cameras: CalibrationInUse
    """State of their calibration."""
    body: ProbeBody
    store: ProbeStore


def open_probe_site(
    rig: Path,
    probe: Path,
    source: str,
    calibrations: Path | None,
    probes: Path | None,
    console: Console,
    *,
    uncalibrated: bool,
) -> TerminalProbeSite:
    """Return cameras and records of a probe.

    InputError for a wrong document, CalibrationError without usable calibration of the cameras.
    """
    body, design = load_probe(probe), load_rig(rig)
    cameras = choose_calibration(source, rig, calibrations, uncalibrated=uncalibrated)
    require_cameras(cameras, console)
    store = ProbeStore(probe_store_folder(probes or own_folder(source), body.name))
    root = calibrations or default_folder()
    of_cameras = CalibrationStore(store_folder(root, design.name))
    site = TerminalSite(design, cameras.rig, rig, root, of_cameras, store.folder / SESSIONS)
    return TerminalProbeSite(site, cameras, body, store)


def about_tip(procedure: P, tip: str) -> P:
    """Return a resumed procedure; CalibrationError if it is about another tip."""
    if procedure.tip != tip:
        raise CalibrationError(
            "calibrate.tip",
            f"The session is for tip '{procedure.tip}'.",
            "Give that tip, or start a new session with --new.",
        )
    return procedure


def own_folder(source: str) -> Path:
    """Return the default folder of records; virtual probes have their own."""
    folder = default_probe_folder()
    return folder.with_name("virtual-probes") if origin_of(source) is Origin.VIRTUAL else folder


def require_cameras(cameras: CalibrationInUse, console: Console) -> None:
    """Refuse cameras without a usable calibration, and print warnings."""
    view = judge(cameras, datetime.now(UTC))
    unusable = cameras.fault is not None or view.word is CalibrationStatus.UNUSABLE
    if unusable and view.blocking_reason is not None:
        raise CalibrationError(
            "calibrate.cameras",
            f"The cameras cannot be used: {view.blocking_reason.what}",
            view.blocking_reason.remedy,
        )
    if view.blocker is not None:
        console.print(
            f"{lead('Cameras  ')}{say_word(view.word.value)}: {told(view.blocker)}", style="yellow"
        )


def collect_from(
    procedure: Procedure,
    probe: TerminalProbeSite,
    feed: Feed,
    frames: int | None,
    record: Path | None,
    console: Console,
) -> None:
    """Record from a source until done, optionally keeping its frames in a file.

    ``frames``: length of a script, None without end. CalibrationError if a recording of real
    cameras has no known calibration, or the source ended before the last step.
    """
    try:
        require_cameras(checked_for_replay(probe.cameras, feed.recorded), console)
    except BaseException:
        feed.ring.close()
        raise
    collect(procedure, feed, frames, console, make_recorder(feed, record, probe.site.design))
