"""Record folders with their event chain, evidence and status.

Events are appended to a chain (`_event_folder`), the files they name are re-read (`evidence`), and
the status follows from record and events alone. Base of the stores of cameras and probes.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from ocmm_core.calibration.records import _sealed as sealed
from ocmm_core.calibration.records._event_folder import EventFolder, StoredEvent
from ocmm_core.errors import CalibrationError

THIS_COMPUTER = "this computer"
"""Author of the suspicion raised when a history was set back."""
DUE_BEFORE = timedelta(days=14)
"""A calibration that ends within this time is DUE."""
CLOCK_TOLERANCE = timedelta(seconds=60)
"""Largest accepted lag of the computer's clock behind the last event or the latest noted time."""
_NOTED_EVERY = timedelta(minutes=10)


class State(StrEnum):
    """Whether a calibration may be trusted."""

    VALID = "VALID"
    DUE = "DUE"
    EXPIRED = "EXPIRED"
    SUSPECT = "SUSPECT"
    UNUSABLE = "UNUSABLE"
    """A file that it rests on is missing or not as it was written."""

    @property
    def usable(self) -> bool:
        """Return whether points may be taken with it."""
        return self in (State.VALID, State.DUE)


@dataclass(frozen=True, slots=True)
class RecordStatus:
    """The state of the calibration in force."""

    state: State
    reason: str = ""
    """Empty for VALID."""
    remedy: str = ""
    since_utc: str = ""
    """For SUSPECT: points recorded after this time are suspect. Otherwise empty."""


T = TypeVar("T", bound=StoredEvent)
R = TypeVar("R", bound=msgspec.Struct)


class RecordStore(EventFolder[T]):
    """A folder of records; one process writes at a time, any thread may call.

    StorageError if the chain of events is broken, or does not fit its seal.
    """

    _renewals: tuple[str, ...]
    """Actions that make up for lost files, most thorough first; each also covers those after it."""

    def __init__(self, folder: Path, kind: type[T]) -> None:
        self._evidence = sealed.EvidenceCheck(folder)
        self._wanted_by: dict[str | None, tuple[tuple[str, ...], dict[sealed.KeptFile, int]]] = {}
        super().__init__(folder, kind)

    def defect(
        self, about: str | None = None, *, thorough: bool = False
    ) -> CalibrationError | None:
        """Return the first defect of the files that the events name, or None.

        ``about``: one tip (probe stores). ``thorough`` reads all files (some ms), otherwise those
        that appear changed, and one of the others in turn.
        """
        wanted = self._wanted(about)
        found = self._evidence.defect(tuple(wanted), thorough=thorough)
        if found is None:
            return None
        one, what = found
        return CalibrationError(
            "evidence.defect",
            f"{one.summary(self._folder)} {what}.",
            f"Restore the file from a backup. If there is none, {self._renewals[wanted[one]]}; "
            "the file is then no longer needed.",
        )

    def wanted(self, about: str | None = None) -> tuple[sealed.KeptFile, ...]:
        """Return the files that must exist, see `defect`."""
        return tuple(self._wanted(about))

    def _wanted(self, about: str | None) -> dict[sealed.KeptFile, int]:
        """Return the files that must be there, and which of `_renewals` makes up for each."""
        chain = self._chain
        known = self._wanted_by.get(about)
        if known is not None and known[0] is chain.links:
            return known[1]
        wanted: dict[str, tuple[sealed.KeptFile, int]] = {}
        for event in chain.items:
            if not self._is_about(event, about):
                continue
            for name in event.lost:
                wanted.pop(name, None)
            for one in self._files_of(event):
                wanted[one.name] = one, self._renewed_by(event)
        found = dict(wanted.values())
        self._wanted_by[about] = chain.links, found
        return found

    @abstractmethod
    def status_of(self, record: Any, now: datetime, *, thorough: bool) -> RecordStatus:
        """Return the status of a record, including the integrity of its evidence."""

    @abstractmethod
    def _renewed_by(self, event: T) -> int:
        """Return the index of the renewal that makes up for lost files of an event."""

    @abstractmethod
    def _files_of(self, event: T) -> Sequence[sealed.KeptFile]:
        pass

    @abstractmethod
    def _is_about(self, event: T, about: str | None) -> bool:
        pass

    def _lost(self, renewal: int, about: str | None = None) -> tuple[str, ...]:
        wanted = self._wanted(about)
        return self._evidence.lost([one for one, by in wanted.items() if by >= renewal])

    def _loaded(self, names: Iterable[str], kind: type[R]) -> tuple[R, ...]:
        """Return records by hash, without those the history lists as lost."""
        kept = set(self.wanted())
        return tuple(
            sealed.load_named(self._folder, name, kind)
            for name in names
            if sealed.record_file(name) in kept
        )

    def _put(
        self,
        record: msgspec.Struct,
        now: datetime,
        who: str,
        reason: str,
        /,
        *,
        renewal: int,
        about: str | None = None,
        session: Path | None = None,
        **own: Any,
    ) -> None:
        """Store a record and its event, which lists the lost files it replaces (see `_lost`)."""
        lost = self._lost(renewal, about)
        sealed.save(self._folder, record)
        self._happened(now, who, reason, session=session, lost=lost, measured=True, **own)

    def _happened(
        self,
        now: datetime,
        who: str,
        reason: str,
        /,
        *,
        since: datetime | None = None,
        session: Path | None = None,
        lost: tuple[str, ...] = (),
        measured: bool = False,
        **own: Any,
    ) -> None:
        """Append an event; trust the clock if ``measured`` just now."""
        event: Callable[..., T] = self._kind
        utc = now.astimezone(UTC).isoformat(timespec="microseconds")
        self._append_event(
            event(
                utc=utc,
                files=sealed.session_files(self._folder, session),
                lost=lost,
                since_utc="" if since is None else since.astimezone(UTC).isoformat(),
                who=who,
                reason=reason,
                **own,
            ),
            at=utc if measured else "",
        )

    def _doubt(
        self, now: datetime, about: str | None = None, *, thorough: bool
    ) -> RecordStatus | None:
        """Return the status for missing evidence, a foreign history or a slow clock, or None."""
        defect = self.defect(about, thorough=thorough)
        if defect is not None:
            return RecordStatus(State.UNUSABLE, defect.what, defect.remedy)
        exchanged = self.exchanged
        if exchanged is not None:
            since = self.events[-1].utc
            return RecordStatus(State.SUSPECT, exchanged.what, exchanged.remedy, since)
        seen = self.seen_utc
        if seen and now < datetime.fromisoformat(seen) - CLOCK_TOLERANCE:
            return RecordStatus(
                State.EXPIRED,
                f"The clock of this computer was set back: it was {seen[:16]} when somebody looked "
                "at this calibration before.",
                "Set the clock of the computer. If it is right now and was wrong then, verify the "
                "calibration or check the tip again.",
            )
        if not seen or now >= datetime.fromisoformat(seen) + _NOTED_EVERY:
            self._note(now)
        return None

    def _judged(self, now: datetime, judge: Callable[[datetime], RecordStatus]) -> RecordStatus:
        """Return the status; an expired one stays so if the clock is set back within tolerance."""
        seen = self.seen_utc
        at = max(now, datetime.fromisoformat(seen)) if seen else now
        found = judge(at)
        if found.state is State.EXPIRED and at > now - CLOCK_TOLERANCE:
            self._note(at)
        return found

    def _note(self, now: datetime) -> None:
        utc = now.astimezone(UTC).isoformat(timespec="microseconds")
        if utc != self.seen_utc:
            self._looked(utc)


def unsealed(what: str, remedy: str) -> RecordStatus:
    """Return the status if the deciding event has no seal."""
    return RecordStatus(
        State.SUSPECT,
        f"The last {what} was stored by an earlier version of this program, which would not "
        "have noticed the removal of a later event.",
        remedy,
    )


def clock_fault(last_utc: str, now: datetime) -> RecordStatus | None:
    """Return the status if the clock is behind the last event, or None."""
    if now >= datetime.fromisoformat(last_utc) - CLOCK_TOLERANCE:
        return None
    return RecordStatus(
        State.EXPIRED,
        f"The clock of this computer is behind the last event ({last_utc[:16]}).",
        "Set the clock of the computer.",
    )


def within_term(
    what: str, until: datetime, due: timedelta, remedy: str, now: datetime
) -> RecordStatus:
    """Return the status by expiry: DUE from ``due`` before ``until``; remedy without full stop."""
    day = until.date().isoformat()
    if now >= until:
        return RecordStatus(State.EXPIRED, f"The {what} was valid until {day}.", f"{remedy}.")
    if now >= until - due:
        return RecordStatus(
            State.DUE, f"The {what} expires on {day}.", f"{remedy} before that day."
        )
    return RecordStatus(State.VALID)
