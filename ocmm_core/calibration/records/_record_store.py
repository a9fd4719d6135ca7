"""Records in a folder of their own: what happened to them, what they rest on, how they stand.

Records are never changed. What happens to them is appended to a chain of events (`_event_folder`);
the files that the events name are looked at again (`evidence`). How a record stands follows from
it and these events alone. The stores of cameras and of probes are two of this kind.
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

from ocmm_core.calibration.records._event_folder import EventFolder, StoredEvent
from ocmm_core.calibration.records._evidence import (
    EvidenceCheck,
    KeptFile,
    record_file,
    session_files,
)
from ocmm_core.calibration.records._sealed import load_named, save
from ocmm_core.errors import CalibrationError

THIS_COMPUTER = "this computer"
"""Who puts a history in doubt that was set back."""
DUE_BEFORE = timedelta(days=14)
"""A calibration that ends within this time is DUE."""
CLOCK_TOLERANCE = timedelta(seconds=60)
"""The computer's clock may stand so far before the last event, or before the latest moment at which
somebody looked; further back it is not believed."""
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
    """Why it is not VALID; empty where it is."""
    remedy: str = ""
    """What to do about it."""
    since_utc: str = ""
    """For SUSPECT: points taken after this time are in doubt. Empty otherwise."""


T = TypeVar("T", bound=StoredEvent)
R = TypeVar("R", bound=msgspec.Struct)


class RecordStore(EventFolder[T]):
    """A folder of records; one process writes at a time, any thread may call.

    Parameters
    ----------
    folder
        Made at the first write.

    Raises
    ------
    StorageError
        The chain of events is broken, or does not fit its seal.
    """

    _renewals: tuple[str, ...]
    """What makes up for files that are lost, the most thorough first; each stands in for those
    behind it as well."""

    def __init__(self, folder: Path, kind: type[T]) -> None:
        self._evidence = EvidenceCheck(folder)
        self._wanted_by: dict[str | None, tuple[tuple[str, ...], dict[KeptFile, int]]] = {}
        super().__init__(folder, kind)

    def defect(
        self, about: str | None = None, *, thorough: bool = False
    ) -> CalibrationError | None:
        """Return what is wrong with the files that the events name; None where nothing is.

        Parameters
        ----------
        about
            Only those of a tip, where the folder is that of a probe.
        thorough
            Read all of them: some milliseconds. Otherwise only those that look changed, and one
            of the others now and then.
        """
        wanted = self._wanted(about)
        found = self._evidence.defect(tuple(wanted), thorough=thorough)
        if found is None:
            return None
        one, what = found
        return CalibrationError(
            "evidence.defect",
            f"{one.words(self._folder)} {what}.",
            f"Restore the file from a backup. If there is none, {self._renewals[wanted[one]]}; "
            "the file is then no longer needed.",
        )

    def wanted(self, about: str | None = None) -> tuple[KeptFile, ...]:
        """Return the files that must be there, see `defect`."""
        return tuple(self._wanted(about))

    def _wanted(self, about: str | None) -> dict[KeptFile, int]:
        """Return the files that must be there, and which of `_renewals` makes up for each."""
        chain = self._chain
        known = self._wanted_by.get(about)
        if known is not None and known[0] is chain.links:
            return known[1]
        wanted: dict[str, tuple[KeptFile, int]] = {}
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
    def _renewed_by(self, event: T) -> int:
        """Return the index of the renewal that makes up for lost files of an event."""

    @abstractmethod
    def _files_of(self, event: T) -> Sequence[KeptFile]:
        """Return the files that an event names."""

    @abstractmethod
    def _is_about(self, event: T, about: str | None) -> bool:
        """Return whether an event belongs to what is asked for."""

    def _lost(self, renewal: int, about: str | None = None) -> tuple[str, ...]:
        """Return the files that are lost and that a renewal makes up for."""
        wanted = self._wanted(about)
        return self._evidence.lost([one for one, by in wanted.items() if by >= renewal])

    def _loaded(self, names: Iterable[str], kind: type[R]) -> tuple[R, ...]:
        """Return records by their hashes; those that were lost, which the history says, not."""
        kept = set(self.wanted())
        return tuple(
            load_named(self._folder, name, kind) for name in names if record_file(name) in kept
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
        """Store a record and say so.

        Parameters
        ----------
        renewal, about
            Files that are lost and that this makes up for are not asked for any more; the event
            says which. See `_lost`.
        session
            The file of the session that it comes from.
        own
            What only this kind of event has.
        """
        lost = self._lost(renewal, about)
        save(self._folder, record)
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
        """Say what happened; see `_put`.

        Parameters
        ----------
        measured
            It was measured just now, so that the clock is believed that it was measured by.
        """
        event: Callable[..., T] = self._kind
        utc = now.astimezone(UTC).isoformat(timespec="microseconds")
        self._append_event(
            event(
                utc=utc,
                files=session_files(self._folder, session),
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
        """Return what is said where not all that a standing rests on is there; None where it is.

        Parameters
        ----------
        now
            By the clock of this computer.
        """
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
        """Return what is said by a clock that a correction within the tolerance does not set back.

        What has expired once does not hold again for the seconds that a clock is corrected by.

        Parameters
        ----------
        judge
            From a moment to what is said then.
        """
        seen = self.seen_utc
        at = max(now, datetime.fromisoformat(seen)) if seen else now
        found = judge(at)
        if found.state is State.EXPIRED and at > now - CLOCK_TOLERANCE:
            self._note(at)
        return found

    def _note(self, now: datetime) -> None:
        """Keep that somebody looked at a moment."""
        utc = now.astimezone(UTC).isoformat(timespec="microseconds")
        if utc != self.seen_utc:
            self._looked(utc)


def unsealed(what: str, remedy: str) -> RecordStatus:
    """Return what is said where the event that counts has no seal."""
    return RecordStatus(
        State.SUSPECT,
        f"The last {what} was stored by an earlier version of this program, which would not "
        "have noticed the removal of a later event.",
        remedy,
    )


def clock_fault(last_utc: str, now: datetime) -> RecordStatus | None:
    """Return what is said where the clock stands before the last event; None where it does not."""
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
    """Return how something stands that nothing speaks against but the calendar.

    Parameters
    ----------
    what, remedy
        What ends, and what makes it anew, without a full stop.
    until, due
        When it ends, and how long before that it is DUE.
    """
    day = until.date().isoformat()
    if now >= until:
        return RecordStatus(State.EXPIRED, f"The {what} was valid until {day}.", f"{remedy}.")
    if now >= until - due:
        return RecordStatus(
            State.DUE, f"The {what} expires on {day}.", f"{remedy} before that day."
        )
    return RecordStatus(State.VALID)
