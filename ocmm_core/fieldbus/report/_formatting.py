"""Bus report as plain text, for mailing."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from datetime import UTC, datetime

from ocmm_core import __version__
from ocmm_core.fieldbus.report._messages import (
    Link,
    microseconds,
    shares,
    trouble_words,
    unaccounted,
    wire_picture,
)
from ocmm_core.fieldbus.report._report import BusEvent, BusReport, CameraReport, Histogram

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
        f"Written        {written.isoformat(sep=' ', timespec='seconds')} by OCMM {__version__}",
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
