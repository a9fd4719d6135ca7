"""Running a test on the terminal: frames in, points taken, retests, the verdict."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from ocmm_core.acceptance import (
    AcceptanceRecord,
    AcceptanceSession,
    AcceptanceView,
    Verdict,
    reserved_spots,
)
from ocmm_core.acquisition.recording import FrameRecorder
from ocmm_core.camera import load_rig
from ocmm_core.composition import (
    DEMO_PLAN,
    AcceptanceSite,
    Feed,
    Origin,
    StationRequest,
    VirtualSite,
    acceptance_feed,
    artefacts_used_before,
    collect_acceptance,
    make_feed,
    origin_of,
    require_recorded,
    scenes_of_acceptance,
)
from ocmm_core.errors import CalibrationError, OcmmError
from ocmm_core.inspection.plan import load_plan


def run_test(
    site: AcceptanceSite,
    base: Path,
    console: Console,
    *,
    temperature_c: float,
    who: str,
    place: str,
    customer: str,
    condition: str,
    retest: bool,
    new: bool,
    speed: float,
    record: Path | None,
    force: bool,
) -> AcceptanceRecord:
    """Run a test to its verdict, and return the record.

    Raises
    ------
    CalibrationError
        The test may not begin, or the source ended before the last point.
    """
    if origin_of(site.source) is Origin.RECORDING:
        # What was recorded is known before a test begins with it.
        feed = _recorded(site, force)
        feed.ring.close()
        instrument = require_recorded(
            site.cameras, site.probe, site.stage.instrument, feed.recorded
        )
        stage = replace(site.stage, instrument=instrument)
        site = replace(site, stage=stage)
    session = None if new else _unfinished(site, base, console)
    if session is None:
        of_cameras, of_tip = artefacts_used_before(site.cameras, site.probe)
        stores = (site.cameras.store, site.probe.store)
        folders = [one.folder / "sessions" for one in stores if one is not None]
        now = datetime.now(UTC)
        stage = site.stage
        name = f"{stage.procedure.id}-{now.strftime('%Y%m%dT%H%M%S.%f')}.chain"
        session = AcceptanceSession.begin(
            base / "sessions" / name, stage, site.procedure_sha256, now,
            temperature_c=temperature_c, who=who, place=place, customer=customer,
            condition=condition, calibration_artefacts=of_cameras,
            qualification_artefacts=of_tip, reserved=reserved_spots(folders),
        )  # fmt: skip
    console.print(f"Test     {session.stage.procedure.title}", highlight=False)
    console.print(f"Session  {session.path}", highlight=False)
    for note in session.notes:
        console.print(f"Note     {note}", highlight=False)
    while True:
        if session.current >= 0:
            _collect(session, site, console, temperature_c, speed, record, force)
        view = session.view
        if not retest or view.verdict in (Verdict.PASS, Verdict.VOID) or not view.retests_left:
            break
        try:
            positions = session.retest(datetime.now(UTC))
        except CalibrationError as error:
            console.print(f"Retest   {error.what}", highlight=False)
            break
        console.print(f"Retest   {', '.join(one.name for one in positions)}", highlight=False)
    return session.finish(datetime.now(UTC), temperature_c)


def _unfinished(site: AcceptanceSite, base: Path, console: Console) -> AcceptanceSession | None:
    """Return the newest test of a procedure that can go on; None where there is none."""
    folder = base / "sessions"
    paths = sorted(folder.glob(f"{site.stage.procedure.id}-*.chain"), reverse=True)
    for path in paths:
        try:
            session = AcceptanceSession.resume(path)
        except OcmmError as error:
            console.print(f"Left out {error.what}", style="dim", highlight=False, markup=False)
            continue
        same = session.stage.instrument == site.stage.instrument and (
            session.stage.procedure == site.stage.procedure
        )
        if same and not (session.view.finished or session.view.abandoned):
            console.print(f"Continue {path}", highlight=False)
            return session
    return None


def _collect(
    session: AcceptanceSession,
    site: AcceptanceSite,
    console: Console,
    temperature_c: float,
    speed: float,
    record: Path | None,
    force: bool,
) -> None:
    feed, frames = _feed(session, site, speed, force)
    recorder = None
    if record is not None:
        recorder = FrameRecorder(record, feed.description, load_rig(site.rig))
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    console.print(f"Source   {feed.description.name}", highlight=False)
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("", total=None)

        def told(view: AcceptanceView, hint: str) -> None:
            total = sum(len(one.points_world) * one.repeats for one in view.positions)
            progress.update(
                task, description=hint or view.instruction, completed=sum(view.done), total=total
            )

        collect_acceptance(
            session, feed, site.cameras.rig, site.probe.body, frames,
            temperature=lambda: temperature_c, told=told, recorder=recorder,
        )  # fmt: skip


def _feed(
    session: AcceptanceSession, site: AcceptanceSite, speed: float, force: bool
) -> tuple[Feed, int | None]:
    """Return the source of a test, and how many frames it has."""
    if origin_of(site.source) is Origin.VIRTUAL:
        virtual = VirtualSite(site.rig, site.probe_document, site.seed, None)
        away = np.array(session.stage.instrument.away)
        scenes = scenes_of_acceptance(virtual, session.view, session.stage.artefacts, away)
        return acceptance_feed(virtual, site.source, scenes, speed)
    return _recorded(site, force), None


def _recorded(site: AcceptanceSite, force: bool) -> Feed:
    """Return cameras or a recording as a source."""
    request = StationRequest(
        plan=DEMO_PLAN, out=Path(), rig=site.rig, source=site.source, force=force
    )
    return make_feed(request, load_plan(DEMO_PLAN), load_rig(site.rig))
