"""What the bus process says about the bus: a snapshot, as JSON, for screens and reports.

The process on the wire writes it into the ring a few times a second and at every change of
phase; whoever looks at it disturbs nothing.
"""

from __future__ import annotations

from enum import StrEnum

import msgspec


class BusPhase(StrEnum):
    """Where the bus is on its way to operation, and back."""

    CLOSED = "closed"
    LINK = "waiting for the link"
    SCAN = "looking for cameras"
    IDENTIFY = "checking identities"
    CONFIGURE = "configuring"
    CLOCKS = "setting clocks"
    START = "starting exposures"
    OPERATION = "in operation"
    DISTURBED = "disturbed"
    RECOVERING = "recovering"
    FAILED = "failed"


class CameraReport(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One camera of the rig."""

    name: str
    serial: int
    alias: int
    """`name`, `serial`, `alias`: As the rig document says."""
    position: int = 0
    """Place on the wire, 1 first; 0 while not found."""
    state: str = "-"
    """AL state, ``"INIT"`` to ``"OP"``, or ``"-"`` while it does not answer."""
    al_code: int = 0
    al_text: str = ""
    """`al_code`, `al_text`: AL status code and its meaning; 0 and empty while fine."""
    firmware: str = ""
    """Version as the camera tells it."""
    boot_counter: int = 0
    """How often it was switched on."""
    frames: int = 0
    frames_lost: int = 0
    overruns: int = 0
    """`frames`, `frames_lost`, `overruns`: Frames taken from it, frames that it made and nobody
    got, and how often its buffer ran over."""
    bad_cycles: int = 0
    """Cycles refused because of this camera."""
    clock_offset_ns: int | None = None
    """Its clock against the reference clock; None while not known."""
    temperature_c: float | None = None
    """Of the sensor; None while not known."""
    link_errors: int = 0
    """Errors that its controller counted on the wire."""
    emergencies: int = 0
    """Emergency messages since the start."""


class BusEvent(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Something that happened, newest last."""

    number: int
    """1, 2, 3 ... since the start of the process."""
    utc_ns: int
    """When it began, ns since 1970."""
    cycle: int
    code: str
    """An `Alarm`, or ``"bus.operation"`` for the return to operation."""
    camera: str
    """Whom it concerns; empty for the whole bus."""
    what: str
    remedy: str
    """`what`, `remedy`: For people."""
    cycles: int = 1
    """Over how many cycles it was seen; similar events in a row are one."""


class Histogram(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Counts between edges; one more count than edges, the last one beyond all edges."""

    edges_us: tuple[float, ...]
    """Upper edges, microseconds, rising."""
    counts: tuple[int, ...]
    """How many values are at most at the edge of the same place."""
    worst_us: float = 0.0


class BusReport(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The whole bus."""

    interface: str
    redundant_interface: str = ""
    """`interface`, `redundant_interface`: Network interfaces; the second is empty without a
    redundancy cable."""
    phase: BusPhase
    """Where the bus is."""
    alarm: str = ""
    message: str = ""
    """`alarm`, `message`: Code and sentence of what disturbs it now; both empty in good order."""
    cameras: tuple[CameraReport, ...]
    """In the order of the rig."""
    cycle_period_ns: int
    frame_period_ns: int
    """`cycle_period_ns`, `frame_period_ns`: As configured."""
    elapsed: int = 0
    good: int = 0
    late: int = 0
    lost: int = 0
    bad: int = 0
    """`elapsed`, `good`, `late`, `lost`, `bad`: Cycles; the last four add up to the first."""
    stray_answers: int = 0
    """Answers that nobody waited for any more: late, duplicated or reordered."""
    recoveries: int = 0
    """How often operation was reached again."""
    clock_phase_ns: int = 0
    clock_drift_ppm: float = 0.0
    """`clock_phase_ns`, `clock_drift_ppm`: Of the master's cycle against the bus clock, and how
    fast that clock runs."""
    redundancy_broken: bool = False
    """A redundancy cable is configured and the ring is open somewhere."""
    objects_done: int = 0
    objects_failed: int = 0
    """`objects_done`, `objects_failed`: Transfers of camera objects."""
    lateness: Histogram
    round_trip: Histogram
    """`lateness`, `round_trip`: Of the cycle's start, and from sending to the last answer."""
    events: tuple[BusEvent, ...] = ()
    """The newest, at most `MAX_EVENTS`."""
    events_dropped: int = 0
    """Older ones that are gone."""
    notes: tuple[str, ...] = ()
    """What this computer does not allow the process (priority, memory, processor)."""
    pace: float | None = None
    """Bus time over real time on a virtual bus that waits for a busy computer; None on every other
    one."""


MAX_EVENTS = 100
"""A full report stays below the room that the ring has for it."""
EDGES_US = (5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0, 10000.0)
"""Of both histograms."""


def encode_report(report: BusReport) -> bytes:
    """Return the report as JSON."""
    return msgspec.json.encode(report)


def decode_report(content: bytes) -> BusReport | None:
    """Return the report in ``content``, or None where it is none of this version."""
    try:
        return msgspec.json.decode(content, type=BusReport)
    except (msgspec.DecodeError, UnicodeDecodeError):
        return None
