"""Acceptance tests on the terminal: a point is recorded once the ball rests at its place."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from ocmm_cli.terminal import DeferredInterrupt, lead, say, say_later, say_word
from ocmm_core import acceptance, composition
from ocmm_core.acquisition.frames import AcquisitionState, FrameBlock, read_status
from ocmm_core.acquisition.recording import FrameRecorder
from ocmm_core.calibration.guided import STILL_FRAMES, ProbeSpotAverager, handle_axis, to_spots
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.camera import Rig, load_rig
from ocmm_core.documents import files_of_folder
from ocmm_core.errors import CalibrationError, InputError, OcmmError
from ocmm_core.geometry import unit
from ocmm_core.tracking import ProbeBody, solve

_BATCH = 80
_IDLE_S = 0.002
_APART_MM, _TURN_RAD = 1.5, 0.15
_AGAIN = say_later(
    "Start the command again: it continues this test. A recording is replayed from its beginning, "
    "in a new test."
)


class PointCollector:
    """Record every point of a test whose ball rests at the required place.

    Keeps the last point across sources and retests: a ball still at rest there gives no second
    point. ``rig``, ``body``: tracked cameras and probe; ``temperature`` returns that of the room;
    ``told`` gets the view and a hint; ``stop`` is polled between batches; ``keep`` also receives
    all frames, before they are evaluated.
    """

    def __init__(
        self,
        session: acceptance.AcceptanceSession,
        rig: Rig,
        body: ProbeBody,
        *,
        temperature: Callable[[], Temperature],
        told: Callable[[acceptance.AcceptanceView, str], None],
        stop: Callable[[], bool] = lambda: False,
        keep: Callable[[FrameBlock], None] = lambda block: None,
    ) -> None:
        self._session, self._rig, self._body = session, rig, body
        self._temperature, self._told, self._stop = temperature, told, stop
        self._keep = keep
        self._hint = ""
        self._axis = handle_axis(body)
        self._probe = ProbeSpotAverager(
            rig, body, STILL_FRAMES, resting=True, distance_mm=_APART_MM, turn_rad=_TURN_RAD
        )

    def collect(self, feed: composition.Feed, frames: int | None = None) -> bool:
        """Record points of a started source; return whether all are; ``frames`` None: endless."""
        session, seen = self._session, 0
        while session.current >= 0 and not self._stop():
            stopped = read_status(feed.ring).state is AcquisitionState.STOPPED
            block = feed.ring.read(_BATCH)
            if block is None:
                if stopped or (frames is not None and seen >= frames):
                    break
                time.sleep(_IDLE_S)
                continue
            self._keep(block)
            seen += len(block)
            self._probe.feed(block)
            if self._probe.live().ready:
                self._take()
        return session.current < 0

    def require_complete(self) -> None:
        """Raise CalibrationError if the source ended before the last point; all are stored."""
        if self._session.current >= 0 and not self._stop():
            instruction = self._session.view.instruction
            raise CalibrationError(
                "acceptance.source_ended",
                f"The source ended before the last point. {instruction} {self._hint}".strip(),
                _AGAIN,
            )

    def _take(self) -> None:
        session, average = self._session, self._probe.average()
        pose = solve(average.uv[None], self._rig, self._body, average.sigma_px)
        tip = pose.tip_world[0]
        self._hint = session.hint(tip)
        if not self._hint:
            now = datetime.now(UTC)
            if session.needs_temperature():
                session.note_temperature(self._temperature(), now)
            handle = unit(pose.rotation_world_from_probe[0] @ self._axis)
            self._hint = session.take(
                tip, now, handle=handle, uv=to_spots(average.uv), sigma_px=average.sigma_px
            )
            self._probe.taken(average)
        self._told(session.view, self._hint)


def run_test(
    site: composition.AcceptanceSite,
    base: Path,
    console: Console,
    *,
    temperature: Callable[[], Temperature],
    who: str,
    place: str,
    customer: str,
    condition: str,
    air: acceptance.RoomAir,
    retest: bool,
    new: bool,
    speed: float,
    record: Path | None,
    force: bool,
) -> acceptance.AcceptanceRecord:
    """Run a test and return the record; CalibrationError if it may not start, or data end early."""
    composition.require_scenes(site.source)
    is_recorded = composition.origin_of(site.source) is composition.Origin.RECORDING
    if is_recorded:
        # Check the recording before a test starts with it.
        feed = _recorded(site, force)
        feed.ring.close()
        instrument = composition.require_recorded(
            site.cameras, site.probe, site.stage.instrument, feed.recorded
        )
        stage = replace(site.stage, instrument=instrument)
        site = replace(site, stage=stage)
    # A recording starts with the first touch: a resumed test would measure some twice.
    session = None if new or is_recorded else _unfinished(site, base, console)
    if session is None:
        now = datetime.now(UTC)
        stage = site.stage
        name = f"{stage.procedure.id}-{now.strftime('%Y%m%dT%H%M%S.%f')}.chain"
        session = acceptance.AcceptanceSession.begin(
            base / "sessions" / name, stage, site.procedure_sha256, now,
            temperature=temperature(), who=who, place=place, customer=customer,
            condition=condition, air=air,
            earlier=composition.earlier_use(site.cameras, site.probe, spots=True),
        )  # fmt: skip
    console.print(f"{lead('Test     ')}{say_word(session.stage.procedure.title)}")
    console.print(f"{lead('Session  ')}{session.path}")
    for note in session.notes:
        console.print(f"{lead('Note     ')}{say(note)}")
    words = "" if new else say(_AGAIN)
    with (
        contextlib.closing(DeferredInterrupt(words)) as interrupt,
        _Source(session, site, console, temperature, speed, record, force, interrupt) as source,
    ):
        while True:
            source.collect()
            view = session.view
            if (
                not retest
                or view.verdict
                in (acceptance.AcceptanceVerdict.PASS, acceptance.AcceptanceVerdict.VOID)
                or not view.retests_left
            ):
                break
            try:
                positions = session.retest(datetime.now(UTC))
            except CalibrationError as error:
                console.print(f"{lead('Retest   ')}{say(error.what)}")
                break
            console.print(f"{lead('Retest   ')}{', '.join(say(one.name) for one in positions)}")
        return session.finish(datetime.now(UTC), temperature())


def room_temperature(
    site: composition.AcceptanceSite, celsius: float | None, stated: str
) -> Temperature:
    """Return the temperature of the room, read again if its thermometer has a source.

    A virtual room has 20 degrees unless one is typed.

    Raises InputError if a real room has none, or it lacks the uncertainty of its thermometer.
    """
    read = acceptance.read_temperature(celsius, stated, datetime.now(UTC))
    if read is not None:
        return read
    if composition.origin_of(site.source) is composition.Origin.VIRTUAL:
        return composition.VIRTUAL_ROOM
    raise InputError(
        "acceptance.temperature",
        "No temperature of the room is given.",
        "Measure it, and give --temperature and --temperature-u.",
    )


def _unfinished(
    site: composition.AcceptanceSite, base: Path, console: Console
) -> acceptance.AcceptanceSession | None:
    """Return the newest unfinished test of a procedure; None without one."""
    folder = base / "sessions"
    begin = f"{site.stage.procedure.id}-"
    for path in reversed(files_of_folder(folder, ".chain")):
        if not path.name.startswith(begin):
            continue
        try:
            session = acceptance.AcceptanceSession.resume(path)
        except OcmmError as error:
            console.print(f"{lead('Left out ')}{say(error.what)}", style="dim")
            continue
        same = session.stage.instrument == site.stage.instrument and (
            session.stage.procedure == site.stage.procedure
        )
        if same and not (session.view.finished or session.view.abandoned):
            console.print(f"{lead('Continue ')}{path}")
            return session
    return None


class _Source:
    """Frames of a test: one source for cameras and recordings, to their end.

    A retest continues at the end of the first run, so that no frame is used twice. The virtual rig
    shows missing points, and missed ones again, because a wire does not wait.
    """

    def __init__(
        self,
        session: acceptance.AcceptanceSession,
        site: composition.AcceptanceSite,
        console: Console,
        temperature: Callable[[], Temperature],
        speed: float,
        record: Path | None,
        force: bool,
        interrupt: DeferredInterrupt,
    ) -> None:
        self._session, self._site, self._console = session, site, console
        self._interrupt = interrupt
        self._temperature, self._speed = temperature, speed
        self._record, self._force = record, force
        self._feed: composition.Feed | None = None
        self._recorder: FrameRecorder | None = None
        self._shown = 0

    def __enter__(self) -> _Source:
        return self

    def __exit__(self, *_why: object) -> None:
        self._end()

    def collect(self) -> None:
        """Record the required points; CalibrationError if the source ends before."""
        session, site = self._session, self._site
        if session.current < 0:
            return
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
        )
        with Progress(*columns, console=self._console, transient=True) as progress:
            task = progress.add_task("", total=None)

            def told(view: acceptance.AcceptanceView, hint: str) -> None:
                total = sum(len(one.points_world) * one.repeats for one in view.positions)
                progress.update(
                    task, description=say(hint or view.instruction), completed=sum(view.done),
                    total=total,
                )  # fmt: skip

            collector = PointCollector(
                session, site.cameras.rig, site.probe.body,
                temperature=self._temperature, told=told,
                stop=self._interrupt.check, keep=self._keep,
            )  # fmt: skip
            if composition.origin_of(site.source) is composition.Origin.VIRTUAL:
                self._show(collector)
            else:
                if self._feed is None:
                    self._start(_recorded(site, self._force))
                assert self._feed is not None  # noqa: S101 - started above
                collector.collect(self._feed)
            collector.require_complete()

    def _show(self, collector: PointCollector) -> None:
        """Show required points until all are recorded, or no progress is made."""
        from ocmm_sim.sources import VirtualSite, acceptance_feed

        session, site = self._session, self._site
        virtual = VirtualSite(site.rig, site.probe_document, site.seed, None)
        taken, complete = -1, False
        while not complete and sum(session.view.done) > taken:
            taken = sum(session.view.done)
            feed, frames = acceptance_feed(
                virtual, site.source, session.view, session.stage, self._speed
            )
            self._start(feed)
            complete = collector.collect(feed, frames)
            self._end()

    def _start(self, feed: composition.Feed) -> None:
        self._feed = feed
        self._console.print(f"{lead('Source   ')}{feed.description.name}")
        if self._record is not None:
            # The virtual rig restarts for a retest with its own time base: another file.
            self._shown += 1
            more = f"-{self._shown}" if self._shown > 1 else ""
            path = self._record.with_name(f"{self._record.stem}{more}{self._record.suffix}")
            self._recorder = FrameRecorder(path, feed.description, load_rig(self._site.rig))
        feed.acquisition.start()

    def _keep(self, block: FrameBlock) -> None:
        if self._recorder is not None:
            self._recorder.append(block)

    def _end(self) -> None:
        if self._feed is not None:
            self._feed.end()
            self._feed = None
        if self._recorder is not None:
            self._recorder.close()
            self._recorder = None


def _recorded(site: composition.AcceptanceSite, force: bool) -> composition.Feed:
    return composition.recorded_feed(
        composition.StationRequest(
            plan=composition.DEMO_PLAN, out=Path(), rig=site.rig, source=site.source, force=force
        )
    )
