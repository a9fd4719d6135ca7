"""``ocmm serve lines`` and ``ocmm serve keyboard``: entry points of the group `ocmm.commands`."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

from ocmm_cli.terminal import lead, make_console, say, told
from ocmm_core.composition import Origin, StationRequest, build_station, origin_of, stream_options
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.failure import contained
from ocmm_core.options import DEMO_PLAN
from ocmm_core.station import MeasuringStation, drop_job_without_points
from ocmm_core.station.stream import PlainLines, StreamServer
from ocmm_serve.lines._feed import LineFeed, SerialReceiver
from ocmm_serve.lines._keyboard import KeyboardReceiver, find_tool
from ocmm_serve.lines._template import DecimalSign, LengthUnit, LineTemplate, PointKind
from ocmm_serve.site import ServedAddress, ServedStation

POINTS = "points.toml"
"""List of points, without end."""
_POLL_S = 0.05
_ENDS = {"crlf": b"\r\n", "lf": b"\n", "cr": b"\r", "enter": b"\n", "tab": b"\t", "none": b""}

Note = Callable[[str], None]
Face = Callable[[MeasuringStation, PlainLines, Note], AbstractContextManager[object]]
"""Connects the lines of a station to their destination; its text names that."""


def serve_lines(
    *,
    template: str,
    unit: LengthUnit,
    point: PointKind,
    decimal: DecimalSign,
    end: str,
    address: ServedAddress,
    device: str,
    baud: int,
    plan: Path | None,
    site: ServedStation,
) -> None:
    """Send each accepted point as a line of text, over TCP or a serial line.

    For programs with a "generic CMM" (PC-DMIS and others). A point is in the job file before its
    line leaves. Each line is sent once, to the programs that are connected. Ends by Ctrl-C.
    """
    made = LineTemplate.of(template, unit, point, decimal)
    port, allow = address.port, tuple(address.allow or ())
    if device and (port is not None or allow or address.host != "127.0.0.1"):
        raise InputError(
            "lines.two_ways",
            "--device is a serial line, but --port, --host or --allow ask for TCP.",
            "Give one of both.",
        )
    options = stream_options(
        1390 if port is None else port, address.host, None, address.certificate,
        address.private_key, allow,
    )  # fmt: skip
    assert options is not None  # noqa: S101 - there is a port

    def face(station: MeasuringStation, plain: PlainLines, note: Note) -> LineFeed | StreamServer:
        if device:
            return LineFeed(station, plain, SerialReceiver(device, baud), note)

        def tell(error: Exception) -> None:
            fault = contained(error, "The lines of points")
            note(f"{fault.what} {fault.remedy}")

        return StreamServer(station, options, tell, plain)

    request = site.request(_plan_for(plan, site.source))
    _run(request, made, _ENDS[end], face)


def serve_keyboard(
    *,
    template: str,
    unit: LengthUnit,
    point: PointKind,
    decimal: DecimalSign,
    end: str,
    window: str,
    plan: Path | None,
    site: ServedStation,
) -> None:
    """Type each accepted point into the program that has the keyboard focus.

    Needs xdotool (X11), wtype or ydotool (Wayland). A point is in the job file before it is typed,
    and typed once. State the window, so that no other program gets numbers. Ends by Ctrl-C.
    """
    made = LineTemplate.of(template, unit, point, decimal)
    receiver = KeyboardReceiver(find_tool(), window)

    request = site.request(_plan_for(plan, site.source))
    _run(
        request, made, _ENDS[end],
        lambda station, plain, note: LineFeed(station, plain, receiver, note),
    )  # fmt: skip


def _plan_for(plan: Path | None, source: str) -> Path:
    if plan is not None:
        return plan
    virtual = origin_of(source) is Origin.VIRTUAL
    return DEMO_PLAN if virtual else resource("plans", POINTS)


def _run(request: StationRequest, template: LineTemplate, end: bytes, face: Face) -> None:
    """Measure until Ctrl-C or the end of the source; OcmmError if the station fails."""
    console = make_console(soft_wrap=True)
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())

    def note(words: str) -> None:
        console.print(say(words), style="yellow", highlight=False)

    built = build_station(request)
    station, path = built.station, built.job_path
    first = station.job.plan.features[0].name

    def reopen(_: object) -> None:
        if request.plan.name == POINTS and not station.job.missing():
            station.job.change(lambda session: session.steps.reopen(first))

    try:
        plain = PlainLines(lambda one: template.line(one).encode("ascii") + end, note)
        station.events.point_taken.connect(reopen)
        station.events.point_refused.connect(
            lambda refusal: note(f"{say('Point refused:')} {told(refusal)}")
        )
        station.faults.failed.connect(lambda error: note(f"{error.what} {error.remedy}"))
        with face(station, plain, note) as made:
            console.print(f"{lead('Source  ')}{built.description.name}", highlight=False)
            console.print(f"{lead('Job     ')}{path}", highlight=False)
            console.print(say(template.words), highlight=False)
            console.print(f"{lead('Lines   ')}{made}", highlight=False)
            station.start()
            while not ended.is_set() and not station.wait_finished(_POLL_S):
                failure = station.faults.why_failed()
                if failure is not None:
                    raise failure
    finally:
        station.close()
        if station.job.lost is not None:
            raise station.job.lost
        drop_job_without_points(path)
