"""Service channel: all acyclic requests, in one frame per cycle without waiting.

Datagrams for states, clocks, error counters, mailboxes and EEPROM words follow the process data
directly, and their answers are collected in the same wait. An unanswered request is given up after
a few cycles and reported to its requester, so a dead camera delays nothing. EEPROMs are read word
by word (ETG.1000.4, 6.4).
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.wire._datagrams import (
    DATAGRAM_OVERHEAD,
    FRAME_BYTES,
    Command,
    Datagram,
    FrameForm,
    answers_like,
    frame_index,
)

FIRST_INDEX = 0x80
"""First index of this channel; the master library ignores indices from 16 on."""
_N_INDICES = 0x80
_GIVE_UP_CYCLES = 6
_ROOM = FRAME_BYTES - 16
_FORMS = 32
"""Cached frame forms; mailboxes with unique contents evict the oldest."""


class Job(NamedTuple):
    """A request to the wire."""

    datagram: Datagram
    answered: Callable[[Datagram | None], None]
    """Called once with the returned datagram, or None without answer in time."""


class ServiceChannel:
    """Composes the service frames and dispatches their answers.

    Counts frames ``answered``, ``given_up``, and ``stray`` answers.
    """

    def __init__(self) -> None:
        self.answered = self.given_up = self.stray = 0
        self._number = 0
        self._waiting: dict[int, tuple[int, list[Job], FrameForm]] = {}
        self._newest = -1
        # By identity: most cycles repeat earlier requests with the same datagrams.
        self._forms: dict[tuple[int, ...], tuple[FrameForm, list[Datagram]]] = {}

    @property
    def waits(self) -> bool:
        """Return whether the newest frame is unanswered."""
        return self._newest in self._waiting

    def compose(self, jobs: Iterable[Job]) -> bytes | None:
        """Return this cycle's frame, or None; excess jobs are answered at once as unprocessed."""
        self._number += 1
        self._give_up()
        chosen = list(jobs)
        if not chosen:
            return None
        known = self._forms.get(tuple([id(job.datagram) for job in chosen]))
        if known is None:
            chosen = _fitting(chosen)
            if not chosen:
                return None
            known = self._learn([job.datagram for job in chosen])
        form = known[0]
        self._newest = FIRST_INDEX + self._number % _N_INDICES
        self._waiting[self._newest] = (self._number, chosen, form)
        return form.encode(self._newest)

    def receive(self, frame: bytes) -> bool:
        """Process an answer of this channel; return whether it was expected."""
        index = frame_index(frame)
        asked = None if index is None else self._waiting.get(index)
        if index is None or asked is None:
            self.stray += 1
            return False
        _number, jobs, form = asked
        datagrams = form.answers(frame) or answers_like(frame, [job.datagram for job in jobs])
        if datagrams is None:
            self.stray += 1
            return False
        del self._waiting[index]
        self.answered += 1
        for job, answer in zip(jobs, datagrams, strict=True):
            job.answered(answer)
        return True

    def abandon(self) -> None:
        """Give up all requests before a new bring-up."""
        waiting, self._waiting = self._waiting, {}
        for _number, jobs, _form in waiting.values():
            for job in jobs:
                job.answered(None)

    def _give_up(self) -> None:
        if not self._waiting:
            return
        for index, (number, jobs, _form) in list(self._waiting.items()):
            if self._number - number > _GIVE_UP_CYCLES:
                del self._waiting[index]
                self.given_up += 1
                for job in jobs:
                    job.answered(None)

    def _learn(self, datagrams: list[Datagram]) -> tuple[FrameForm, list[Datagram]]:
        """Cache the form of a frame, with its datagrams so that their ids are not reused."""
        if len(self._forms) >= _FORMS:
            del self._forms[next(iter(self._forms))]
        known = (FrameForm(datagrams), datagrams)
        self._forms[tuple([id(datagram) for datagram in datagrams])] = known
        return known


def _fitting(jobs: Iterable[Job]) -> list[Job]:
    """Return the jobs that fit into one frame; answer the others as unprocessed."""
    room = _ROOM
    chosen: list[Job] = []
    refused: list[Job] = []
    for job in jobs:
        size = len(job.datagram.data) + DATAGRAM_OVERHEAD
        (chosen if size <= room else refused).append(job)
        room -= size if size <= room else 0
    for job in refused:
        job.answered(job.datagram)
    return chosen


_OWNER, _CONTROL = 0x0500, 0x0502
_TO_MASTER, _TO_CAMERA = b"\x00", b"\x01"
_READ = 0x0100
_BUSY = 0x8000
_ERRORS = 0x7800
_EIGHT_BYTES = 0x0040
_REQUEST = struct.Struct("<HI")
_ANSWER = struct.Struct("<HI8s")


class EepromRead:
    """Read EEPROM words of one camera; a state machine without a clock."""

    def __init__(self, station: int, word: int, words: int) -> None:
        self._station = station
        self._word = word
        self._wanted = 2 * words
        self._value = bytearray()
        self._mine = self._asked = self._waiting = self._returned = False
        self._error: BusError | None = None

    @property
    def done(self) -> bool:
        """Return whether all words are read and EEPROM access is returned to the camera."""
        return self._returned

    @property
    def error(self) -> BusError | None:
        return self._error

    @property
    def result(self) -> bytes:
        return bytes(self._value[: self._wanted])

    @property
    def progress(self) -> tuple[int, int]:
        return len(self.result), self._wanted

    def jobs(self) -> Iterator[Job]:
        """Yield the request of this cycle, if due."""
        if self._waiting or self._returned or self._error is not None:
            return
        self._waiting = True
        if not self._mine:
            yield self._write(_OWNER, _TO_MASTER, "_mine")
        elif len(self._value) >= self._wanted:
            yield self._write(_OWNER, _TO_CAMERA, "_returned")
        elif not self._asked:
            place = self._word + len(self._value) // 2
            yield self._write(_CONTROL, _REQUEST.pack(_READ, place), "_asked")
        else:
            question = Datagram(Command.FPRD, self._station, _CONTROL, bytes(_ANSWER.size))
            yield Job(question, self._check)

    def _write(self, register: int, content: bytes, step: str) -> Job:
        def written(answer: Datagram | None) -> None:
            self._waiting = False
            if answer is not None and answer.working_counter == 1:
                setattr(self, step, True)

        return Job(Datagram(Command.FPWR, self._station, register, content), written)

    def _check(self, answer: Datagram | None) -> None:
        self._waiting = False
        if answer is None or answer.working_counter != 1:
            return
        status, place, data = _ANSWER.unpack(answer.data)
        if status & _BUSY:
            return
        if status & _ERRORS:
            self._error = BusError(
                "bus.eeprom",
                f"The EEPROM of the camera cannot be read at word {place} (status {status:#06x}).",
                "Repeat the request; if it happens again, have the camera repaired.",
            )
            return
        self._asked = False
        if place == self._word + len(self._value) // 2:
            self._value += data if status & _EIGHT_BYTES else data[:4]
