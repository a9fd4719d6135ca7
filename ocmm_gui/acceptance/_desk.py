"""View of the window with acceptance tests: choose or resume, then run."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from PySide6.QtCore import Qt, Signal

from ocmm_core import acceptance
from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.composition import VIRTUAL_ROOM, AcceptanceBench, StatedConditions
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.failure import contained
from ocmm_core.geometry import unit
from ocmm_gui.acceptance._measure_pages import AcceptanceVerdictPage, MeasurePage
from ocmm_gui.acceptance._start_page import AcceptanceStart, limits_text
from ocmm_gui.acceptance._touch_picture import position_contents
from ocmm_gui.kit import later, localised, said, tr
from ocmm_gui.wizards import GuidedStack, Runner, WizardDriver, temperature
from ocmm_gui.wizards.pages import (
    VERDICT_ENDS,
    PreparePage,
    StepPage,
    StepPlan,
    StepSnapshot,
    Tap,
    WizardTexts,
)
from ocmm_gui.work import Worker

INTERIM = "INTERIM"
_TEXTS = WizardTexts(
    title=later("Acceptance test"),
    purpose=later("A standard test of the instrument against its limits, with a verdict."),
    ends=VERDICT_ENDS,
    accepted=later("Verdict stored. P writes the certificate."),
)


class AcceptanceDesk(GuidedStack):
    """One test at a time; while ``tap`` has a watcher, measuring is suspended."""

    paper_wanted = Signal(object)
    """Emits the `Path` of the record for a certificate."""
    _hand_failed = Signal(object)

    def __init__(
        self,
        bench: AcceptanceBench,
        tap: Tap,
        who: Callable[[], str],
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        super().__init__()
        self.setAccessibleName(tr("Acceptance test"))
        self.bench = bench
        self._tap, self._who, self._clock = tap, who, clock
        self.procedures: tuple[acceptance.ProcedureOffer, ...] = ()
        # Reading verifies all hashes, and the disk may be slow.
        self._lists = Worker("ocmm-tests-open", self)
        self._asked = self._chosen = 0
        self._making = False
        self.start = AcceptanceStart()
        self.addWidget(self.start)
        self.start.chosen.connect(self._choose)
        self.start.begun.connect(self._start)
        self.start.resumed.connect(self._resume)
        self.start.left.connect(self.leave)
        self._hand_failed.connect(self.failed, Qt.ConnectionType.QueuedConnection)

    def open(self, first: str = "") -> None:
        """Show the procedures; ``first`` is the id of the proposed one."""
        self.close_runner()
        self.setCurrentWidget(self.start)
        now = self._clock()
        self._asked += 1
        asked = self._asked
        self.procedures = ()
        self.start.show_waiting()

        def done(found: tuple[acceptance.ProcedureOffer, ...]) -> None:
            # Opened again meanwhile: a later answer follows.
            if asked == self._asked:
                self.procedures = found
                self.start.ask(found, self._proposals(), first)
                self._read_unfinished(now, asked)

        def failed(error: Exception) -> None:
            if asked == self._asked:
                self.start.ask((), self._proposals(), first)
                self._tell_failure(error, "Reading the procedures")
                self._read_unfinished(now, asked)

        self._lists.do(lambda: self.bench.procedures(now), done, failed)

    def _proposals(self) -> dict[str, str]:
        proposals = {"who": self._who()}
        if self.bench.is_virtual:
            proposals["temperature"] = localised(f"{VIRTUAL_ROOM.celsius:g}")
            proposals["thermometer"] = localised(f"{2.0 * VIRTUAL_ROOM.sigma_k:g}")
        return proposals

    def _tell_failure(self, error: Exception, reading: str) -> None:
        told = contained(error, reading, "Nothing was changed.")
        self.start.show_trouble(said(f"{told.what} {told.remedy}"))

    def _read_unfinished(self, now: datetime, asked: int) -> None:
        def done(found: tuple[acceptance.OpenTest, ...]) -> None:
            if asked == self._asked:
                self.start.show_unfinished(found)

        def failed(error: Exception) -> None:
            if asked == self._asked:
                self.start.show_unfinished(())
                self._tell_failure(error, "Reading unfinished tests")

        self._lists.do(lambda: self.bench.unfinished(now), done, failed)

    def leave(self) -> None:
        """Stop the test, or its preparation, and leave; it can be resumed."""
        self._asked += 1
        super().leave()

    def close_work(self) -> None:
        self.close_runner()
        self._lists.close(0.0)

    def _choose(self, row: int) -> None:
        offer = self.procedures[row]
        # The artefacts are those of the register, whatever was typed; Start refuses it.
        try:
            warm = self._typed()
        except OcmmError:
            warm = None
        self._chosen += 1
        chosen, now = self._chosen, self._clock()
        self.start.show_reading(limits_text(offer))

        def read() -> tuple[acceptance.ArtefactOffer, ...]:
            # Only the last selection counts.
            if chosen != self._chosen:
                return ()
            return self.bench.offers(offer, now, VIRTUAL_ROOM if warm is None else warm)

        def done(found: tuple[acceptance.ArtefactOffer, ...]) -> None:
            if chosen == self._chosen:
                self.start.show_artefacts(found, limits_text(offer))

        def failed(error: Exception) -> None:
            if chosen == self._chosen:
                self.start.show_artefacts((), limits_text(offer))
                self._tell_failure(error, "Reading the artefacts")

        self._lists.do(read, done, failed)

    def _start(self) -> None:
        self._make(self._wanted_test)

    def _wanted_test(self) -> Callable[[], acceptance.AcceptanceProcedure]:
        """Return the function that starts the filled-in test."""
        start = self.start
        if not 0 <= start.row() < len(self.procedures):
            raise InputError("acceptance.none", "No procedure chosen.", "Choose one.")
        offer, chosen = self.procedures[start.row()], start.artefact()
        if chosen is not None and chosen.refusal:
            raise InputError("acceptance.artefact", chosen.refusal, "")
        warm = self._temperature()
        used, now = start.used(offer.roles), self._clock()
        air = acceptance.RoomAir.read(start.value("humidity"), start.value("pressure"))
        who, place, customer = (start.value(key) for key in ("who", "place", "customer"))
        condition = start.chosen_condition()

        def start_test() -> acceptance.AcceptanceProcedure:
            given = StatedConditions(
                who=who, place=place, customer=customer, condition=condition, temperature=warm(),
                air=air,
            )  # fmt: skip
            return self.bench.start(offer, used, given, now)

        return start_test

    def _typed(self) -> Temperature | None:
        keys = ("temperature", "thermometer")
        if not self.start.value("temperature").strip():
            return None
        return temperature({key: self.start.value(key) for key in keys}, self._clock())

    def _temperature(self) -> Callable[[], Temperature]:
        """Return what gives the temperature: a thermometer may take seconds to read."""
        typed, stated, now = self._typed(), self.start.value("thermometer"), self._clock()

        def read() -> Temperature:
            found = typed or temperature({"thermometer": stated}, now)
            if found is None:
                raise InputError(
                    "acceptance.temperature", "No temperature given.",
                    "Measure the room and enter it in 'Room, °C'.",
                )  # fmt: skip
            return found

        return read if stated.strip() and typed is None else _constant(read())

    def _resume(self, path: Path) -> None:
        def wanted() -> Callable[[], acceptance.AcceptanceProcedure]:
            warm = self._temperature()
            return lambda: self.bench.resume(path, warm())

        self._make(wanted)

    def _make(self, wanted: Callable[[], Callable[[], acceptance.AcceptanceProcedure]]) -> None:
        """Prepare a test in the background: it reads records, spots and documents."""
        if self._making:
            # Pressed twice: one test suffices.
            return
        try:
            make = wanted()
        except OcmmError as error:
            self.start.show_trouble(said(f"{error.what} {error.remedy}".strip()))
            return
        self.start.show_trouble("")
        self.start.show_starting(tr("Preparing the test"))
        self._making = True
        asked = self._asked

        def done(procedure: acceptance.AcceptanceProcedure) -> None:
            self._making = False
            self.start.show_starting("")
            # After leaving, it is among the unfinished tests.
            if asked == self._asked and self.currentWidget() is self.start:
                self._run(procedure)

        def failed(error: Exception) -> None:
            self._making = False
            self.start.show_starting("")
            told = contained(error, "The test", "Nothing was changed.")
            self.start.show_trouble(said(f"{told.what} {told.remedy}".strip()))

        self._lists.do(make, done, failed)

    def _run(self, procedure: acceptance.AcceptanceProcedure) -> None:
        driver = WizardDriver(procedure, self._tap_of(procedure), clock=self._clock)
        runner = Runner(
            driver, _TEXTS, self._pages(procedure),
            {"repeat": lambda: driver.do(procedure.retest)},
        )  # fmt: skip
        # The procedure defines what is repeated; only one repeats a line.
        runner.actions_by_key["repeat"].setText(tr("Retest"))
        runner.buttons["repeat"].setText(tr("Retest\n[N]"))
        self._show_runner(runner, driver, procedure.base.torn)

    def _tap_of(self, procedure: acceptance.AcceptanceProcedure) -> Tap:
        """Return the frame source: the station, or the hand at the virtual rig."""
        hand = self.bench.hand(procedure, self._hand_failed.emit)
        if hand is None:
            return self._tap

        def tap(watcher: Callable[[FrameBlock], None] | None) -> None:
            # The virtual rig's operator is idle meanwhile.
            self._tap(None if watcher is None else _look_away)
            hand(watcher)

        return tap

    def _pages(self, procedure: acceptance.AcceptanceProcedure) -> dict[str, StepPage]:
        rig = self.bench.cameras().rig
        away = unit(np.array(procedure.session.stage.instrument.away))
        measure = MeasurePage(rig, away, procedure)
        measure.misread.connect(self.failed)
        verdict = AcceptanceVerdictPage()
        verdict.paper_wanted.connect(self.paper_wanted)
        return {"prepare": PreparePage(rig, _planned), "measure": measure, "result": verdict}


def _planned(seen: StepSnapshot) -> StepPlan:
    view = seen.view_as(acceptance.GuidedAcceptanceView)
    words = tr("%n positions", "1 position", len(view.test.positions))
    return StepPlan(position_contents(view.test), words, view.notes)


def _look_away(_block: FrameBlock) -> None:
    """Watch nothing."""


def _constant(given: Temperature) -> Callable[[], Temperature]:
    return lambda: given
