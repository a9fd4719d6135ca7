"""Bus report as plain text for mailing, its sentences, and its figures for other programs.

Sentences and shares are those of the screen. Cycle counts and histograms are JSON or CSV.
"""

from __future__ import annotations

import csv
import io
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import Enum
from itertools import pairwise

import msgspec

from ocmm_core.build import build_version
from ocmm_core.fieldbus.report._alarms import alarm_of_code
from ocmm_core.fieldbus.report._report import BusEvent, BusPhase, BusReport, CameraReport, Histogram

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
    return f"{value_us / 1000.0:g} ms" if abs(value_us) >= 1000.0 else f"{value_us:g} µs"


def within_us(histogram: Histogram, share: float) -> float | None:
    """Return the edge, us, below which this share of values lies, or None."""
    needed, reached = share * sum(histogram.counts), 0
    for edge, count in zip(histogram.edges_us, histogram.counts, strict=False):
        reached += count
        if reached and reached >= needed:
            return edge
    return None


_LINKS = {Link.WHOLE: "---", Link.BROKEN: "-X-", Link.UNKNOWN: "-?-"}
_BAR = 40
_COLUMNS = 100
_MEANINGS = (
    "good: all cameras answered in time with new, consistent data",
    "late: this computer was too late or skipped the cycle; the frames come with the next",
    "lost: no answer, or the cameras were not in operation; they resend buffered frames",
    "bad:  an answer was rejected (working counter, state, counters, clock, content)",
)


def report_text(report: BusReport, *, rig: str, written: datetime) -> str:
    """Return the report as text of at most 100 columns, with line ends."""
    lines = [
        "OCMM bus report",
        "===============",
        "",
        f"Written        {written.isoformat(sep=' ', timespec='seconds')} by OCMM "
        f"{build_version()}",
        f"Rig            {rig}",
        f"Interface      {report.interface}",
        f"Redundancy     {report.redundant_interface or 'no second cable'}",
        f"Phase          {report.phase.value}",
    ]
    what, remedy = trouble_words(report)
    if what:
        alarm = f" [{report.alarm}]" if report.alarm else ""
        lines += [*_wrapped("Trouble        ", what + alarm)]
        lines += [*_wrapped("What to do     ", remedy or "Wait.")]
    for part in (_wire, _cycles, _cameras, _clocks):
        lines += ["", *part(report)]
    for title, histogram in (
        ("Delay of the cycle start", report.lateness),
        ("Round trip, from sending to the last answer", report.round_trip),
    ):
        lines += ["", *_histogram(title, histogram)]
    lines += ["", *_events(report), "", "Notes"]
    for note in report.notes or ("none",):
        lines += _wrapped("  ", note)
    return "\n".join(line.rstrip() for line in lines) + "\n"


def _wire(report: BusReport) -> list[str]:
    wire = wire_picture(report)
    drawn = f"[{wire.interface}]"
    for camera, link in zip(wire.cameras, wire.links, strict=True):
        place = f"{camera.position} " if camera.position else ""
        drawn += f" {_LINKS[link]} [{place}{camera.name} {camera.state}]"
    if wire.redundancy is not None:
        drawn += f" {_LINKS[wire.redundancy]} [{wire.redundant_interface}]"
    return ["Wire", f"  {drawn}", f"  {wire.words}"]


def _cycles(report: BusReport) -> list[str]:
    counts = {"good": report.good, "late": report.late, "lost": report.lost, "bad": report.bad}
    cycle = microseconds(report.cycle_period_ns / 1e3)
    frame = microseconds(report.frame_period_ns / 1e3)
    lines = [f"Cycles of {cycle}, frames every {frame}"]
    if report.pace is not None:
        waits = "the time of this virtual bus waits for this computer, so no cycle is late"
        lines += [f"  pace       {report.pace:>12.2f}  of real time", *_wrapped("  ", waits)]
    lines.append(f"  elapsed    {report.elapsed:>12}")
    for (name, count), share in zip(counts.items(), shares(tuple(counts.values())), strict=True):
        lines.append(f"  {name:<10} {count:>12}  {share:8.3f} %")
    gap = unaccounted(report)
    lines.append(
        "  good, late, lost and bad add up to elapsed"
        if gap == 0
        else f"  ATTENTION: {gap} cycles have no verdict"
    )
    lines += [f"  {meaning}" for meaning in _MEANINGS]
    lines += [
        f"  recoveries {report.recoveries:>12}",
        f"  stray      {report.stray_answers:>12}  late or duplicate answers, discarded",
        f"  objects    {report.objects_done:>12}  transfers done, {report.objects_failed} failed",
    ]
    return lines


def _cameras(report: BusReport) -> list[str]:
    lines = ["Cameras"]
    for camera in report.cameras:
        lines += [f"  {line}" for line in _camera(camera)]
    return lines


def _camera(camera: CameraReport) -> Iterable[str]:
    offset = "not known" if camera.clock_offset_ns is None else f"{camera.clock_offset_ns} ns"
    warm = "not known" if camera.temperature_c is None else f"{camera.temperature_c:.1f} C"
    place = str(camera.position) if camera.position else "not found"
    yield f"{camera.name}: serial {camera.serial}, alias {camera.alias}, position {place}"
    yield (
        f"  state {camera.state}, AL code 0x{camera.al_code:04X} {camera.al_text or 'no error'}, "
        f"firmware {camera.firmware or 'not known'}"
    )
    yield (
        f"  frames {camera.frames}, lost {camera.frames_lost}, overruns {camera.overruns}, "
        f"bad cycles {camera.bad_cycles}"
    )
    yield (
        f"  clock offset {offset}, temperature {warm}, link errors {camera.link_errors}, "
        f"switched on {camera.boot_counter} times, emergencies {camera.emergencies}"
    )


def _clocks(report: BusReport) -> list[str]:
    return [
        "Clocks",
        f"  cycle against bus clock  {report.clock_phase_ns} ns",
        f"  drift of the bus clock   {report.clock_drift_ppm:+.2f} ppm",
    ]


def _histogram(title: str, histogram: Histogram) -> list[str]:
    total, most = sum(histogram.counts), max((*histogram.counts, 1))
    lines = [f"{title} ({total} values, worst {histogram.worst_us:.0f} µs)"]
    last = len(histogram.edges_us)
    for index, count in enumerate(histogram.counts):
        edge = histogram.edges_us[min(index, last - 1)]
        label = f"{'<=' if index < last else '> '} {microseconds(edge):>7}"
        bar = "#" * (-(-_BAR * count // most))
        lines.append(f"  {label} {count:>12}  {bar}")
    return lines


def _events(report: BusReport) -> list[str]:
    lines = ["Events, newest first (times in UTC)"]
    if report.events_dropped:
        lines.append(f"  {report.events_dropped} older ones were dropped")
    for event in reversed(report.events):
        lines += [f"  {line}" for line in _event(event)]
    return lines if report.events else [*lines, "  none"]


def _event(event: BusEvent) -> Iterable[str]:
    when = datetime.fromtimestamp(event.utc_ns * 1e-9, UTC)
    stamp = when.strftime("%Y-%m-%d %H:%M:%S.%f")[:-3]
    where = f" {event.camera}" if event.camera else ""
    yield (
        f"{event.number:>4}  {stamp}  {event.code}{where}  "
        f"cycle {event.cycle}, seen in {event.cycles}"
    )
    yield from _wrapped("    ", f"{event.what} {event.remedy}", _COLUMNS - 2)


def _wrapped(head: str, text: str, columns: int = _COLUMNS) -> list[str]:
    """Return `text` after `head`, with hanging indentation."""
    return textwrap.wrap(text, columns, initial_indent=head, subsequent_indent=" " * len(head)) or [
        head
    ]


_FORMAT = "ocmm.bus_statistics/1"
_COUNTS = ("elapsed", "good", "late", "lost", "bad", "stray_answers", "recoveries")
_HISTOGRAMS = ("lateness", "round_trip")


def statistics_json(report: BusReport) -> bytes:
    """Return the figures as JSON: histograms by upper edges, us; the last count is beyond them."""
    content = {
        "format": _FORMAT,
        "interface": report.interface,
        "cycle_period_ns": report.cycle_period_ns,
        "frame_period_ns": report.frame_period_ns,
        "cycles": {name: getattr(report, name) for name in _COUNTS},
        "clock_phase_ns": report.clock_phase_ns,
        "clock_drift_ppm": report.clock_drift_ppm,
        "histograms": {name: getattr(report, name) for name in _HISTOGRAMS},
        "notes": report.notes,
    }
    return msgspec.json.format(msgspec.json.encode(content), indent=1) + b"\n"


def statistics_csv(report: BusReport) -> bytes:
    """Return the figures as CSV: ``kind,from_us,to_us,count``."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(("kind", "from_us", "to_us", "count"))
    for name in _COUNTS:
        writer.writerow((name, "", "", getattr(report, name)))
    for name in _HISTOGRAMS:
        histogram: Histogram = getattr(report, name)
        begins = (0.0, *histogram.edges_us)
        ends = (*histogram.edges_us, "")
        for begin, end, count in zip(begins, ends, histogram.counts, strict=True):
            writer.writerow((name, begin, end, count))
    return text.getvalue().encode("utf-8")
