"""``ocmm serve lines`` and ``ocmm serve keyboard``: entry points of the group `ocmm.commands`."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import typer

from ocmm_cli.terminal import lead, make_console, say, told
from ocmm_core.composition import (
    DEMO_PLAN,
    Errand,
    Origin,
    StationRequest,
    build_station,
    origin_of,
    request_of_settings,
    stream_options,
)
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.failure import contained
from ocmm_core.settings import SettingsStore
from ocmm_core.station import MeasuringStation, drop_job_without_points
from ocmm_core.station.stream import PlainLines, StreamServer
from ocmm_serve.lines._feed import LineFeed, SerialReceiver
from ocmm_serve.lines._keyboard import KeyboardReceiver, find_tool
from ocmm_serve.lines._template import DecimalSign, LengthUnit, LineTemplate, PointKind

PORT = 1390
_POLL_S = 0.05
_ENDS = {"crlf": b"\r\n", "lf": b"\n", "cr": b"\r", "enter": b"\n", "tab": b"\t", "none": b""}

Note = Callable[[str], None]
Face = Callable[[MeasuringStation, PlainLines, Note], AbstractContextManager[object]]
"""Connects the lines of a station to where they go."""

UnitOption = Annotated[
    LengthUnit, typer.Option("--unit", help="Unit of positions and radius in the lines.")
]
KindOption = Annotated[
    PointKind,
    typer.Option(
        "--point",
        help="ball: centre of the probe ball, the program compensates its radius; surface: "
        "compensated along the direction of the touch.",
    ),
]
DecimalOption = Annotated[DecimalSign, typer.Option("--decimal", help="Decimal sign.")]
PlanOption = Annotated[
    Path | None,
    typer.Option(
        "--plan", help="Plan of the touches. Default: any points; of a virtual source, the Demo."
    ),
]
OutOption = Annotated[
    Path | None, typer.Option("--out", help="Folder of the job file. Default: the settings.")
]
SourceOption = Annotated[
    str, typer.Option("--source", help="As of ocmm measure. Default: the settings.")
]


def serve_lines(
    *,
    template: Annotated[
        str,
        typer.Option(
            "--template",
            help="Format of a line: {x} {y} {z} position, {i} {j} {k} direction, {r} radius of the "
            "ball, {n} number of the point; digits as in {x:.4f}; \\t is a tabulator.",
        ),
    ] = "{x:.4f},{y:.4f},{z:.4f}",
    unit: UnitOption = "mm",
    point: KindOption = "ball",
    decimal: DecimalOption = "point",
    end: Annotated[
        Literal["crlf", "lf", "cr"], typer.Option("--end", help="End of a line.")
    ] = "crlf",
    port: Annotated[int, typer.Option("--port", help="TCP port; 0: any free port.")] = PORT,
    host: Annotated[
        str, typer.Option("--host", help="Address to listen on; others than local need --allow.")
    ] = "127.0.0.1",
    allow: Annotated[
        list[str] | None,
        typer.Option("--allow", help="Address or network of a client; can be repeated."),
    ] = None,
    device: Annotated[
        str,
        typer.Option("--device", help="Serial line in place of TCP, such as /dev/ttyUSB0:9600."),
    ] = "",
    plan: PlanOption = None,
    out: OutOption = None,
    source: SourceOption = "",
) -> None:
    """Send each accepted point as a line of text, over TCP or a serial line.

    For programs with a "generic CMM" (PC-DMIS and others). A point is in the job file before its
    line leaves. Each line is sent once, to the programs that are connected. Rig, probe and TLS are
    those of the settings. Ends by Ctrl-C.
    """
    made = LineTemplate.of(template, unit, point, decimal)
    if device and (allow or (host, port) != ("127.0.0.1", PORT)):
        raise InputError(
            "lines.two_ways",
            "--device is a serial line, but --port, --host or --allow ask for TCP.",
            "Give one of both.",
        )
    settings = SettingsStore.of_this_user().load().settings
    options = stream_options(
        port, host, None, settings.stream_certificate, settings.stream_key, tuple(allow or ())
    )
    assert options is not None  # noqa: S101 - there is a port

    def face(station: MeasuringStation, plain: PlainLines, note: Note) -> LineFeed | StreamServer:
        if device:
            return LineFeed(station, plain, SerialReceiver(device), note)

        def tell(error: Exception) -> None:
            fault = contained(error, "The lines of points")
            note(f"{fault.what} {fault.remedy}")

        return StreamServer(station, options, tell, plain)

    _run(_request(plan, out, source), made, _ENDS[end], face)


def serve_keyboard(
    *,
    template: Annotated[
        str, typer.Option("--template", help="As of ocmm serve lines; \\t presses Tab.")
    ] = "{x:.4f}\\t{y:.4f}\\t{z:.4f}",
    unit: UnitOption = "mm",
    point: KindOption = "ball",
    decimal: DecimalOption = "point",
    end: Annotated[
        Literal["enter", "tab", "none"], typer.Option("--end", help="Key behind a line.")
    ] = "enter",
    window: Annotated[
        str,
        typer.Option(
            "--window", help="Type only if the title of the active window has these words (X11)."
        ),
    ] = "",
    plan: PlanOption = None,
    out: OutOption = None,
    source: SourceOption = "",
) -> None:
    """Type each accepted point into the program that has the keyboard focus.

    Needs xdotool (X11), wtype or ydotool (Wayland). A point is in the job file before it is typed,
    and typed once. State the window, so that no other program gets numbers. Rig and probe are those
    of the settings. Ends by Ctrl-C.
    """
    made = LineTemplate.of(template, unit, point, decimal)
    receiver = KeyboardReceiver(find_tool(), window)
    _run(
        _request(plan, out, source), made, _ENDS[end],
        lambda station, plain, note: LineFeed(station, plain, receiver, note),
    )  # fmt: skip


def _request(plan: Path | None, out: Path | None, source: str) -> StationRequest:
    settings = SettingsStore.of_this_user().load().settings
    if source:
        settings = replace(settings, instrument_source=source)
    virtual = origin_of(settings.instrument_source) is Origin.VIRTUAL
    usual = DEMO_PLAN if virtual else resource("plans", "points.toml")
    request = request_of_settings(settings, Errand(plan or usual, stay=False))
    return replace(request, out=out or request.out, stream=None)


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
        if request.plan.name == "points.toml" and not station.job.missing():
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
