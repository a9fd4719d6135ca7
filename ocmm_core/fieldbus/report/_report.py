"""Snapshot of the bus as JSON, written into the ring several times a second and per phase."""

from __future__ import annotations

from enum import StrEnum

import msgspec


class BusPhase(StrEnum):
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
    """`name`, `serial`, `alias`: from the rig document."""
    position: int = 0
    """Position on the wire, 1 first; 0 if not found."""
    state: str = "-"
    """AL state, ``"INIT"`` to ``"OP"``, or ``"-"`` without answer."""
    al_code: int = 0
    al_text: str = ""
    """`al_code`, `al_text`: AL status code and meaning; 0 and empty if good."""
    firmware: str = ""
    boot_counter: int = 0
    frames: int = 0
    frames_lost: int = 0
    overruns: int = 0
    """`frames`, `frames_lost`, `overruns`: frames received, frames lost, and buffer overruns."""
    bad_cycles: int = 0
    """Cycles refused because of this camera."""
    clock_offset_ns: int | None = None
    """Offset from the reference clock; None if unknown."""
    temperature_c: float | None = None
    """Sensor temperature; None if unknown."""
    link_errors: int = 0
    emergencies: int = 0


class BusEvent(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    number: int
    """1, 2, 3 ... since the start of the process."""
    utc_ns: int
    """Start, ns since 1970."""
    cycle: int
    code: str
    """An `Alarm`, or ``"bus.operation"`` for the return to operation."""
    camera: str
    """Camera concerned; empty for the whole bus."""
    what: str
    remedy: str
    cycles: int = 1
    """Number of cycles; consecutive similar events are merged."""


class Histogram(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Counts between edges; one more count than edges, the last one beyond all edges."""

    edges_us: tuple[float, ...]
    """Upper edges, microseconds, ascending."""
    counts: tuple[int, ...]
    """Values up to the edge with the same index; the last one beyond all edges."""
    worst_us: float = 0.0


class BusReport(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    interface: str
    redundant_interface: str = ""
    """`interface`, `redundant_interface`: the second is empty without redundancy."""
    phase: BusPhase
    alarm: str = ""
    message: str = ""
    """`alarm`, `message`: code and sentence of the current fault; empty in good order."""
    cameras: tuple[CameraReport, ...]
    cycle_period_ns: int
    frame_period_ns: int
    elapsed: int = 0
    good: int = 0
    late: int = 0
    lost: int = 0
    bad: int = 0
    """`elapsed`, `good`, `late`, `lost`, `bad`: cycles; the last four sum up to the first."""
    stray_answers: int = 0
    """Unexpected answers: late, duplicated or reordered."""
    recoveries: int = 0
    clock_phase_ns: int = 0
    clock_drift_ppm: float = 0.0
    redundancy_broken: bool = False
    """Redundancy is configured and the ring is open."""
    objects_done: int = 0
    objects_failed: int = 0
    lateness: Histogram
    round_trip: Histogram
    """`lateness`, `round_trip`: of the cycle's start, and from sending to the last answer."""
    events: tuple[BusEvent, ...] = ()
    """Newest events, at most `MAX_EVENTS`."""
    events_dropped: int = 0
    notes: tuple[str, ...] = ()
    """What this computer does not allow the process (priority, memory, processor)."""
    pace: float | None = None
    """Bus time over real time on a virtual bus that waits for a busy computer; otherwise None."""


MAX_EVENTS = 100
"""Keeps a full report within its space in the ring."""
EDGES_US = (5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0, 10000.0)


def encode_report(report: BusReport) -> bytes:
    """Return the report as JSON."""
    return msgspec.json.encode(report)


def decode_report(content: bytes) -> BusReport | None:
    """Return the report in `content`, or None if it is of another version."""
    try:
        return msgspec.json.decode(content, type=BusReport)
    except (msgspec.DecodeError, UnicodeDecodeError):
        return None
