"""Sentences and shares of a bus report, for screen and text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

from ocmm_core.fieldbus.report._alarms import alarm_of_code
from ocmm_core.fieldbus.report._report import BusPhase, BusReport, CameraReport, Histogram

_BEFORE_CAMERAS = (BusPhase.CLOSED, BusPhase.LINK, BusPhase.SCAN)


_SLOW = 0.95
"""A virtual bus at this pace or faster counts as real time."""


def pace_words(pace: float | None) -> str:
    """Return a warning if the pace (bus over real time) of a virtual bus is slow."""
    if pace is None or pace >= _SLOW:
        return ""
    return f"Virtual bus at {pace:.2f} of real time: this computer is too slow for 1.0."


class Link(Enum):
    """Cable between two neighbours on the wire."""

    WHOLE = "whole"
    BROKEN = "broken"
    UNKNOWN = "not known"


@dataclass(frozen=True, slots=True)
class WirePicture:
    """The wire from the host's interface to the last camera."""

    interface: str
    redundant_interface: str
    """`interface`, `redundant_interface`: of the host; the second is empty without redundancy."""
    cameras: tuple[CameraReport, ...]
    """In wire order; missing ones last."""
    links: tuple[Link, ...]
    """links[i] leads to cameras[i], from the host or from the camera before it."""
    redundancy: Link | None
    """Cable back from the last camera; None without one."""
    words: str


def is_present(camera: CameraReport) -> bool:
    """Return whether a camera answers."""
    return camera.position > 0 and camera.state != "-"


def wire_picture(report: BusReport) -> WirePicture:
    """Return the wire as inferred from the cameras' answers."""
    cameras = tuple(
        sorted(report.cameras, key=lambda camera: (camera.position == 0, camera.position))
    )
    present = [True, *map(is_present, cameras)]
    links = tuple(
        Link.WHOLE if before and after else Link.BROKEN if before or after else Link.UNKNOWN
        for before, after in pairwise(present)
    )
    if report.phase in _BEFORE_CAMERAS and not any(present[1:]) and not report.alarm:
        links = (Link.UNKNOWN,) * len(cameras)
    redundancy = None
    if report.redundant_interface:
        redundancy = Link.BROKEN if report.redundancy_broken else Link.WHOLE
    return WirePicture(
        report.interface,
        report.redundant_interface,
        cameras,
        links,
        redundancy,
        _wire_words(report, cameras, links),
    )


def _wire_words(report: BusReport, cameras: Sequence[CameraReport], links: Sequence[Link]) -> str:
    absent = [f"'{camera.name}'" for camera in cameras if not is_present(camera)]
    if Link.UNKNOWN in links and Link.BROKEN not in links:
        words = f"The cameras are not known yet: the bus is {report.phase.value}."
    elif not absent:
        words = f"{len(cameras)} of {len(cameras)} cameras answer."
    elif len(absent) == len(cameras):
        words = f"Broken behind {report.interface}: no camera answers."
    else:
        first = links.index(Link.BROKEN)
        before = f"'{cameras[first - 1].name}'" if first else report.interface
        verb = "does" if len(absent) == 1 else "do"
        words = f"Broken behind {before}: {' and '.join(absent)} {verb} not answer."
    if not report.redundant_interface:
        return words
    if report.redundancy_broken:
        return f"{words} The ring to {report.redundant_interface} is open: a cable is broken."
    return f"{words} The ring to {report.redundant_interface} is closed."


def trouble_words(report: BusReport) -> tuple[str, str]:
    """Return the current fault and its remedy; empty in good order."""
    if report.phase is BusPhase.OPERATION and not (report.alarm or report.message):
        return "", ""
    what = report.message or f"Bus: {report.phase.value}."
    for event in reversed(report.events):
        if event.code == report.alarm and event.remedy:
            return what, event.remedy
    alarm = alarm_of_code(report.alarm)
    return what, "" if alarm is None else alarm.spec.remedy


def shares(counts: Sequence[int], decimals: int = 3) -> tuple[float, ...]:
    """Return the shares of `counts`, %, rounded by largest remainder to 100; zeros if all are."""
    total, scale = sum(counts), 100 * 10**decimals
    if total <= 0:
        return (0.0,) * len(counts)
    whole = [count * scale // total for count in counts]
    order = sorted(range(len(counts)), key=lambda i: -(counts[i] * scale % total))
    for index in order[: scale - sum(whole)]:
        whole[index] += 1
    return tuple(round(value / 10**decimals, decimals) for value in whole)


def unaccounted(report: BusReport) -> int:
    """Return the cycles without verdict; nonzero is a program error."""
    return report.elapsed - (report.good + report.late + report.lost + report.bad)


def microseconds(value_us: float) -> str:
    if abs(value_us) >= 1000.0:
        return f"{value_us / 1000.0:g} ms"
    return f"{value_us:g} µs"


def within_us(histogram: Histogram, share: float) -> float | None:
    """Return the edge, us, below which this share of values lies, or None."""
    needed, reached = share * sum(histogram.counts), 0
    for edge, count in zip(histogram.edges_us, histogram.counts, strict=False):
        reached += count
        if reached and reached >= needed:
            return edge
    return None
