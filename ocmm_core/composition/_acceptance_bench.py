"""Acceptance tests in a running station: available procedures, start and resume.

Calibration and tip are those in force at each call, the station's those at its start.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path

import numpy as np

from ocmm_core import acceptance
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import CalibrationInUse, CalibrationStore, ProbeInUse
from ocmm_core.composition import _acceptance_site as acceptance_site
from ocmm_core.composition._calibration_choice import choose_calibration, choose_probe
from ocmm_core.composition._feeds import StationRequest
from ocmm_core.composition._sources import Origin, origin_of, source_of
from ocmm_core.composition.hands import Hand, RecordedHand
from ocmm_core.documents import resource
from ocmm_core.errors import InputError, OcmmError

VIRTUAL_ROOM = Temperature(20.0, 0.1, "")
"""Room of the virtual rig, as its thermometer (U 0.2 K, k = 2) shows it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedConditions:
    """Conditions entered before a test."""

    who: str
    place: str = ""
    customer: str = ""
    condition: str = "as found"
    """`who`, `place`, `customer`, `condition`: see `AcceptanceRecord`."""
    temperature: Temperature = VIRTUAL_ROOM
    air: acceptance.RoomAir = field(default_factory=acceptance.RoomAir)


def start_test(
    tests: Path,
    stage: acceptance.Stage,
    procedure_sha256: str,
    given: StatedConditions,
    now: datetime,
    earlier: acceptance.EarlierUse,
) -> acceptance.AcceptanceSession:
    """Start a test in a folder of tests; raise OcmmError as `AcceptanceSession.start`."""
    name = f"{stage.procedure.id}-{now.strftime('%Y%m%dT%H%M%S.%f')}.chain"
    return acceptance.AcceptanceSession.start(
        tests / acceptance.SESSIONS / name, stage, procedure_sha256, now,
        temperature=given.temperature, who=given.who.strip(), place=given.place.strip(),
        customer=given.customer.strip(), condition=given.condition, earlier=earlier, air=given.air,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class TestsMade:
    """Contents of a test folder."""

    __test__ = False

    finished: tuple[acceptance.FinishedTest, ...]
    unread: tuple[str, ...]
    """`finished`, `unread`: see `finished_tests`."""
    unfinished: tuple[acceptance.OpenTest, ...]
    chart: acceptance.InterimChart | None
    """Chart of the artefact of the last interim check; None without checks."""


@dataclass(frozen=True, slots=True)
class AcceptanceBench:
    """Acceptance tests of a station."""

    request: StationRequest
    recorded: str = ""
    """Source name in the replayed recording; empty without replay."""
    folder: Path | None = None
    """Folder of sessions, records and checks; None: this user's (virtual rigs have their own)."""
    register: Path | None = None
    """Artefact register; None for this user's."""
    shipped: dict[str, acceptance.UsedArtefact] = field(default_factory=dict)

    @property
    def is_virtual(self) -> bool:
        return origin_of(self.request.source) is Origin.VIRTUAL

    def cameras(self) -> CalibrationInUse:
        """Return the calibration in force; InputError as `choose_calibration`."""
        one = self.request
        return choose_calibration(one.source, one.rig, one.calibrations, uncalibrated=False)

    def probe(self) -> ProbeInUse:
        """Return probe and tip in force; InputError as `choose_probe`."""
        one = self.request
        return choose_probe(one.source, one.probe, one.probes, one.tip, uncalibrated=False)

    def instrument(self, now: datetime) -> acceptance.InstrumentState:
        """Return the instrument in force; raise OcmmError if it cannot be tested."""
        cameras, probe = self.cameras(), self.probe()
        found = acceptance_site.instrument_of(cameras, probe, self.request.source, now)
        return acceptance_site.require_recorded(cameras, probe, found, self.recorded)

    def tests(self) -> Path:
        """Return the test folder; virtual tests are kept apart from real ones."""
        if self.folder is not None:
            return self.folder
        base = acceptance_site.default_test_folder()
        return base.with_name("virtual-acceptance") if self.is_virtual else base

    def artefacts(self) -> acceptance.ArtefactRegister:
        """Return the register; StorageError if a line was altered."""
        return acceptance.ArtefactRegister(self.register)

    def procedures(self, now: datetime) -> tuple[acceptance.ProcedureOffer, ...]:
        return acceptance.offered_procedures(self.instrument(now), self.request.seed)

    def stage(
        self,
        offer: acceptance.ProcedureOffer,
        artefacts: tuple[acceptance.UsedArtefact, ...],
        now: datetime,
    ) -> acceptance.Stage:
        return acceptance.Stage(offer.procedure, self.instrument(now), artefacts, self.request.seed)

    def offers(
        self, offer: acceptance.ProcedureOffer, now: datetime, temperature: Temperature
    ) -> tuple[acceptance.ArtefactOffer, ...]:
        """Return artefacts with reasons of refusal; on the virtual rig its own come first."""
        register = self.artefacts()
        faults = register.faults()
        candidates = [(one.id, one.used()) for one in register.entries.values()]
        if self.is_virtual:
            candidates = [*self._shipped().items(), *candidates]
        earlier = acceptance_site.earlier_use(self.cameras(), self.probe())
        stage = self.stage(offer, (), now)
        offers = acceptance.offered_artefacts(stage, candidates, now, temperature, earlier)
        return tuple(
            replace(one, refusal=f"{faults[one.name]} {acceptance.NOT_SIGNED_REMEDY}")
            if one.name in faults
            else one
            for one in offers
        )

    def refused_for(
        self, entry: acceptance.ArtefactEntry, now: datetime
    ) -> tuple[tuple[str, str], ...]:
        """Return the procedures for a register entry's kind, each with the refusal if any."""
        earlier = acceptance_site.earlier_use(self.cameras(), self.probe())
        found = []
        for offer in self.procedures(now):
            if entry.kind in offer.roles:
                stage = self.stage(offer, (), now)
                (one,) = acceptance.offered_artefacts(
                    stage, [(entry.id, entry.used())], now, VIRTUAL_ROOM, earlier
                )
                found.append((offer.procedure.id, one.refusal))
        return tuple(found)

    def start(
        self,
        offer: acceptance.ProcedureOffer,
        artefacts: tuple[acceptance.UsedArtefact, ...],
        given: StatedConditions,
        now: datetime,
        seed: int | None = None,
    ) -> acceptance.AcceptanceProcedure:
        """Start a test; raise OcmmError if it cannot be started."""
        if not given.who.strip():
            raise InputError("wizard.who", "No name given.", "Enter your name in 'Done by'.")
        acceptance_site.require_scenes(self.request.source)
        earlier = acceptance_site.earlier_use(self.cameras(), self.probe(), spots=True)
        stage = self.stage(offer, artefacts, now)
        if seed is not None:
            stage = acceptance.Stage(stage.procedure, stage.instrument, stage.artefacts, seed)
        session = start_test(self.tests(), stage, offer.sha256, given, now, earlier)
        return self._procedure(session, given.temperature)

    def resume(self, path: Path, temperature: Temperature) -> acceptance.AcceptanceProcedure:
        """Resume a test; raise OcmmError if its file was altered or frames are recorded."""
        if origin_of(self.request.source) is Origin.RECORDING:
            raise InputError(
                "acceptance.recording",
                "A test of a recording does not go on: its touches would be measured twice.",
                "Begin it again; a recording is replayed from its first frame.",
            )
        return self._procedure(acceptance.AcceptanceSession.resume(path), temperature)

    def unfinished(self, now: datetime) -> tuple[acceptance.OpenTest, ...]:
        """Return the started tests without a stored verdict."""
        return acceptance.open_tests(self.tests(), self.instrument(now))

    def made(self, now: datetime) -> TestsMade:
        """Return all tests, in seconds; OcmmError as `instrument` or for altered checks."""
        finished, unread = acceptance.finished_tests(self.tests())
        checked = [
            one.record.artefacts[0]
            for one in finished
            if "Interim_L" in one.record.procedure.limits and one.record.artefacts
        ]
        chart = self.chart(checked[0], now) if checked else None
        return TestsMade(finished, unread, self.unfinished(now), chart)

    def hand(
        self, procedure: acceptance.AcceptanceProcedure, failed: Callable[[OcmmError], None]
    ) -> Hand | None:
        """Return the hand of a virtual rig or recording; None for real cameras."""
        one = self.request
        if origin_of(one.source) is Origin.RECORDING:
            rig = self.cameras().rig
            return RecordedHand(
                lambda: (acceptance_site.recorded_feed(one, rig), np.inf), procedure, failed
            )
        make = source_of(one.source).spec.hand
        return None if make is None else make(one, procedure, failed)

    def interim(self) -> acceptance.InterimHistory:
        """Return the interim checks; StorageError if a line was altered."""
        return acceptance.InterimHistory(self.tests())

    def chart(self, artefact: acceptance.UsedArtefact, now: datetime) -> acceptance.InterimChart:
        """Return the chart of an artefact with the calibration and the tip in force."""
        tested = self.instrument(now)
        return self.interim().chart(tested.calibration, artefact.use.serial, tested.tip)

    def store(self) -> CalibrationStore | None:
        """Return the calibration store of the rig; None if none is kept."""
        return self.cameras().store

    def _procedure(
        self, session: acceptance.AcceptanceSession, temperature: Temperature
    ) -> acceptance.AcceptanceProcedure:
        checks = isinstance(session.stage.procedure.test, acceptance.InterimTest)
        return acceptance.AcceptanceProcedure(
            session, self.cameras().rig, self.probe().body, self.tests() / acceptance.RECORDS,
            temperature, self._charted if checks else None,
        )  # fmt: skip

    def _charted(
        self, record: acceptance.AcceptanceRecord, now: datetime
    ) -> acceptance.InterimChart:
        return acceptance.note_check(self.interim(), record, self.store(), now)

    def _shipped(self) -> dict[str, acceptance.UsedArtefact]:
        if not self.shipped:
            for role, parts in acceptance_site.SHIPPED.items():
                self.shipped[role] = acceptance_site.named_artefact(str(resource(*parts)))
        return self.shipped
