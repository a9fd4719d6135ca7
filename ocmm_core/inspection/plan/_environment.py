"""Ambient conditions of a job: limits of the plan, noted readings, and violations.

A reading is an event with the number of points so far and of the next point: the start is what was
noted before the first point, the end after the last one. A reading without measurements after it is
superseded by the next one; both stay in the file, and both are reported.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import msgspec

from ocmm_core import ambient
from ocmm_core.errors import InputError
from ocmm_core.storage import JobEvent, JobFile, event_value

ENVIRONMENT_EVENT = "environment"


class EnvironmentLimits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Ambient limits of a plan: least and most, inclusive; None for no limit."""

    temperature_c: tuple[float, float] | None = None
    humidity_percent: tuple[float, float] | None = None
    pressure_hpa: tuple[float, float] | None = None
    """`temperature_c`, `humidity_percent`, `pressure_hpa`: Of the air at the machine."""


_DEMANDS = (
    ("temperature_c", ambient.ROOM, "room temperature"),
    ("humidity_percent", ambient.HUMIDITY, "relative humidity"),
    ("pressure_hpa", ambient.PRESSURE, "air pressure"),
)
"""Fields of `EnvironmentLimits`, their quantities, and their names in sentences."""
_WORDS = {ambient.ROOM: "Room", ambient.HUMIDITY: "Humidity", ambient.PRESSURE: "Air pressure"}


class NotedRoom(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Readings as typed."""

    points: int
    """Points that counted then; zero is the start."""
    next_point: int
    """Number of the next point: all points with a smaller one were recorded before."""
    room: str = ""
    humidity: str = ""
    pressure: str = ""
    """`room`, `humidity`, `pressure`: Readings (`ocmm_core.ambient`); empty if not read."""
    who: str = ""
    """Reader, or logged thermometer; may be empty."""
    doubt: str = ""
    """Why a logged reading was not used, in a sentence."""


@dataclass(frozen=True, slots=True)
class _Reading:
    """A reading of one quantity, and the ones it supersedes: repeated without a point between."""

    noted: NotedRoom
    reading: ambient.Reading
    before: tuple[ambient.Reading, ...]


def environment_fault(limits: EnvironmentLimits) -> tuple[str, str] | None:
    """Return the field of a plan with impossible limits, and why; None if all are possible."""
    demanded = [(name, one, getattr(limits, name)) for name, one, _ in _DEMANDS]
    if all(span is None for _, _, span in demanded):
        return "environment", "demands nothing: give a range, or leave the table out"
    for name, one, span in demanded:
        if span is None:
            continue
        least, most = span
        if least not in one or most not in one:
            ends = f"{one.least:g} to {one.most:g} {one.unit}"
            return f"environment.{name}", f"demands {least:g} to {most:g}; a room has {ends}"
        if not least < most:
            return f"environment.{name}", "has its smaller number last"
    return None


def noted_text(
    points: int, next_point: int, typed: ambient.TypedRoom, who: str, doubt: str = ""
) -> str:
    """Return the text of the event; InputError if empty or a value is implausible."""
    typed.check()
    if typed.empty and not doubt:
        raise InputError(
            "environment.empty",
            "No temperature, humidity or pressure of the room is given.",
            "Read off one of them, and give it.",
        )
    noted = NotedRoom(
        points,
        next_point,
        typed.room.strip(),
        typed.humidity.strip(),
        typed.pressure.strip(),
        who.strip()[:60],
        doubt[:300],
    )
    return msgspec.json.encode(noted).decode()


def note_room_in(job: JobFile, typed: ambient.TypedRoom, who: str = "", doubt: str = "") -> None:
    """Store current ambient readings in an open job.

    Raises
    ------
    InputError
        A value is no ambient reading, or nothing was read.
    StorageError
        It could not be made durable.
    """
    text = noted_text(len(job.points()), job.next_number(), typed, who, doubt)
    job.append_event(ENVIRONMENT_EVENT, text)


def noted_rooms(events: Sequence[JobEvent]) -> tuple[NotedRoom, ...]:
    """Return noted readings, oldest first; StorageError if malformed, InputError if invalid."""
    found = tuple(
        event_value(one.kind, one.text, NotedRoom)
        for one in events
        if one.kind == ENVIRONMENT_EVENT
    )
    for noted in found:
        for one in ambient.QUANTITIES:
            ambient.reading_of(one, getattr(noted, one.field))
    return found


def environment_doubt(
    limits: EnvironmentLimits | None, noted: Sequence[NotedRoom], last_point: int, *, complete: bool
) -> str:
    """Return why ambient conditions invalidate a job, and the remedy; empty if they do not.

    ``last_point``: largest number that counts, or zero; ``complete``: the end must have been noted.
    """
    if limits is None:
        return ""
    return " ".join(_doubts(limits, noted, last_point, complete=complete))


def _doubts(
    limits: EnvironmentLimits, noted: Sequence[NotedRoom], last_point: int, *, complete: bool
) -> Iterator[str]:
    for field, one, name in _DEMANDS:
        span = getattr(limits, field)
        if span is None:
            continue
        asked = f"{span[0]:g} to {span[1]:g} {one.unit}"
        told = _readings_of(one, noted)
        if not any(item.noted.points == 0 for item in told):
            if last_point:
                yield (
                    f"The plan demands a {name} of {asked}; none was noted before the first point. "
                    "Measure again, and note it first."
                )
            else:
                yield (
                    f"The plan demands a {name} of {asked}; none was noted yet. Note it before the "
                    "first point."
                )
        for item in told:
            read = item.reading
            if read.low - read.spread < span[0] or read.high + read.spread > span[1]:
                yield (
                    f"The plan demands a {name} of {asked}; {read.words} was noted. Measure again "
                    "when the room is as the plan wants it."
                )
        if complete and last_point and not any(_at_end(item.noted, last_point) for item in told):
            yield (
                f"The plan demands a {name} of {asked}; none was noted after the last point. Note "
                "it now: ocmm environment JOB."
            )


def environment_words(noted: Sequence[NotedRoom], last_point: int) -> tuple[tuple[str, str], ...]:
    """Return the readings in words, with their times.

    Returns
    -------
    told
        Pairs of field and sentence: ``Room 20.1 °C at the begin.``
    """
    doubts = dict.fromkeys(one.doubt for one in noted if one.doubt)
    return (
        *(
            (one.field, sentence)
            for one in ambient.QUANTITIES
            for item in _readings_of(one, noted)
            for sentence in _sentences(one, item, last_point)
        ),
        *((ambient.ROOM.field, doubt) for doubt in doubts),
    )


def _sentences(one: ambient.Quantity, item: _Reading, last_point: int) -> Iterator[str]:
    word, reading = _WORDS[one], item.reading.words
    if item.noted.points == 0:
        yield f"{word} {reading} at the begin."
    elif _at_end(item.noted, last_point):
        yield f"{word} {reading} at the end."
    else:
        yield f"{word} {reading} after point {item.noted.next_point - 1}."
    for before in item.before:
        yield f"{before.words} was typed before."


def _at_end(noted: NotedRoom, last_point: int) -> bool:
    return noted.points > 0 and noted.next_point > last_point


def _readings_of(one: ambient.Quantity, noted: Sequence[NotedRoom]) -> list[_Reading]:
    """Return the readings of a quantity; a repeated one without a point between includes both."""
    found: list[_Reading] = []
    for item in noted:
        reading = ambient.reading_of(one, getattr(item, one.field))
        if reading is None:
            continue
        before: tuple[ambient.Reading, ...] = ()
        if found and (found[-1].noted.next_point, found[-1].noted.points) == (
            item.next_point,
            item.points,
        ):
            last = found.pop()
            before = (*last.before, *((last.reading,) if last.reading != reading else ()))
        found.append(_Reading(item, reading, before))
    return found
