"""Acceptance tests on the terminal: a point is recorded once the ball rests at its place."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ocmm_cli.calibrate import record_observations
from ocmm_cli.terminal import DeferredInterrupt, PlainConsole, lead, tr, tr_later, tr_word
from ocmm_core import acceptance, composition
from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.acquisition.recording import FrameRecorder
from ocmm_core.calibration import guided
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.documents import files_of_folder
from ocmm_core.errors import CalibrationError, InputError, OcmmError

if TYPE_CHECKING:
    from ocmm_cli.acceptance._acceptance import RunSetup

_AGAIN = tr_later(
    "Start the command again: it continues this test. A recording is replayed from its beginning, "
    "in a new test."
)


def run_test(
    site: composition.AcceptanceSite,
    base: Path,
    console: PlainConsole,
    given: composition.StatedConditions,
    setup: RunSetup,
    *,
    retest: bool = False,
    new: bool = True,
    record: Path | None = None,
) -> acceptance.AcceptanceRecord:
    """Run a test and return the record; CalibrationError if it may not start, or data end early."""
    composition.require_scenes(site.source)
    is_recorded = composition.origin_of(site.source) is composition.Origin.RECORDING
    if is_recorded:
        # Check the recording before a test starts with it.
        feed = _recorded(site, setup.force)
        feed.ring.close()
        instrument = composition.require_recorded(
            site.cameras, site.probe, site.stage.instrument, feed.recorded
        )
        site = replace(site, stage=replace(site.stage, instrument=instrument))
    # A recording starts with the first touch: a resumed test would measure some twice.
    session = None if new or is_recorded else _unfinished(site, base, console)
    if session is None:
        session = composition.start_test(
            base, site.stage, site.procedure_sha256, given, datetime.now(UTC),
            composition.earlier_use(site.cameras, site.probe, spots=True),
        )  # fmt: skip
    console.print(f"{lead('Test     ')}{tr_word(session.stage.procedure.title)}")
    console.print(f"{lead('Session  ')}{session.path}")
    for note in session.notes:
        console.print(f"{lead('Note     ')}{tr(note)}")
    thermometer = partial(room_temperature, site, setup)
    procedure = acceptance.AcceptanceProcedure(
        session, site.cameras.rig, site.probe.body, base / acceptance.RECORDS, given.temperature,
        thermometer=thermometer,
    )  # fmt: skip
    with (
        contextlib.closing(DeferredInterrupt("" if new else tr(_AGAIN))) as interrupt,
        _Source(procedure, site, console, setup, record, interrupt) as source,
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
                positions = procedure.retest(datetime.now(UTC))
            except CalibrationError as error:
                console.print(f"{lead('Retest   ')}{tr(error.what)}")
                break
            console.print(f"{lead('Retest   ')}{', '.join(tr(one.name) for one in positions)}")
        return session.finish(datetime.now(UTC), thermometer())


def room_temperature(site: composition.AcceptanceSite, setup: RunSetup) -> Temperature:
    """Return the temperature of the room, read again if its thermometer has a source.

    A virtual room has 20 degrees unless one is typed.

    Raises InputError if a real room has none, or it lacks the uncertainty of its thermometer.
    """
    read = acceptance.read_temperature(setup.temperature, setup.temperature_u, datetime.now(UTC))
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
    site: composition.AcceptanceSite, base: Path, console: PlainConsole
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
            console.print(f"{lead('Left out ')}{tr(error.what)}", style="dim")
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
        procedure: acceptance.AcceptanceProcedure,
        site: composition.AcceptanceSite,
        console: PlainConsole,
        setup: RunSetup,
        record: Path | None,
        interrupt: DeferredInterrupt,
    ) -> None:
        self._procedure, self._site, self._console = procedure, site, console
        self._setup, self._record, self._interrupt = setup, record, interrupt
        self._feed: composition.Feed | None = None
        self._recorder: FrameRecorder | None = None
        self._shown = 0

    def __enter__(self) -> _Source:
        return self

    def __exit__(self, *_why: object) -> None:
        self._end()

    def collect(self) -> None:
        """Record the required points; CalibrationError if the source ends before."""
        session, site = self._procedure.session, self._site
        if (
            session.view.current >= 0
            and composition.origin_of(site.source) is composition.Origin.VIRTUAL
        ):
            self._show()
        elif session.view.current >= 0:
            if self._feed is None:
                self._start(_recorded(site, self._setup.force))
            self._receive()
        if session.view.current >= 0:
            view = self._procedure.base
            instruction, hint = view.step.instruction, view.live.hint
            raise CalibrationError(
                "acceptance.source_ended",
                f"The source ended before the last point. {instruction} {hint}".strip(),
                _AGAIN,
            )

    def _show(self) -> None:
        """Show required points until all are recorded, or no progress is made."""
        from ocmm_sim.sources import VirtualSite, acceptance_feed

        session, site = self._procedure.session, self._site
        virtual = VirtualSite(site.rig, site.probe_document, site.seed, None)
        taken = -1
        while session.view.current >= 0 and sum(session.view.done) > taken:
            taken = sum(session.view.done)
            feed, frames = acceptance_feed(
                virtual, site.source, session.view, session.stage, self._setup.speed
            )
            self._start(feed)
            self._receive(frames)
            self._end()

    def _receive(self, frames: int | None = None) -> None:
        def line(view: guided.ProcedureView) -> str:
            return f"{tr(view.step.instruction)} {tr(view.live.hint)}".strip()

        assert self._feed is not None  # noqa: S101 - started before
        record_observations(
            self._procedure, self._feed, frames, self._console, self._interrupt, self._keep, line
        )

    def _start(self, feed: composition.Feed) -> None:
        self._feed = feed
        self._console.print(f"{lead('Source   ')}{feed.description.name}")
        if self._record is not None:
            # The virtual rig restarts for a retest with its own time base: another file.
            self._shown += 1
            more = f"-{self._shown}" if self._shown > 1 else ""
            path = self._record.with_name(f"{self._record.stem}{more}{self._record.suffix}")
            self._recorder = FrameRecorder(path, feed.description, self._site.cameras.rig)
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
        ),
        site.cameras.rig,
    )
