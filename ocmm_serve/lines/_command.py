"""``ocmm serve lines`` and ``ocmm serve keyboard``: entry points of the group `ocmm.commands`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ocmm_cli.options import StationChoice
from ocmm_core.errors import InputError
from ocmm_serve.lines._template import DecimalSign, LengthUnit, LineTemplate, PointKind
from ocmm_serve.site import ServedAddress, plan_for

if TYPE_CHECKING:
    from ocmm_core.station import MeasuringStation
    from ocmm_core.station.stream import PlainLines, StreamServer
    from ocmm_serve.lines._feed import LineFeed, Note

_ENDS = {"crlf": b"\r\n", "lf": b"\n", "cr": b"\r", "enter": b"\n", "tab": b"\t", "none": b""}


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
    site: StationChoice,
) -> None:
    """Send each accepted point as a line of text, over TCP or a serial line.

    For programs with a "generic CMM" (PC-DMIS and others). A point is in the job file before its
    line leaves. Each line is sent once, to the programs that are connected. Ends by Ctrl-C.
    """
    from ocmm_core.failure import contained
    from ocmm_core.station.stream import StreamServer
    from ocmm_serve.lines._feed import LineFeed, SerialReceiver, run

    made = LineTemplate.parse(template, unit, point, decimal)
    if device and (address.port is not None or address.allow or address.host != "127.0.0.1"):
        raise InputError(
            "lines.two_ways",
            "--device is a serial line, but --port, --host or --allow ask for TCP.",
            "Give one of both.",
        )
    options = address.options(1390)

    def face(station: MeasuringStation, plain: PlainLines, note: Note) -> LineFeed | StreamServer:
        if device:
            return LineFeed(station, plain, SerialReceiver(device, baud), note)

        def tell(error: Exception) -> None:
            note(str(contained(error, "The lines of points")))

        return StreamServer(station, options, tell, plain)

    run(site.request(plan_for(plan, site.source)), made, _ENDS[end], face)


def serve_keyboard(
    *,
    template: str,
    unit: LengthUnit,
    point: PointKind,
    decimal: DecimalSign,
    end: str,
    window: str,
    plan: Path | None,
    site: StationChoice,
) -> None:
    """Type each accepted point into the program that has the keyboard focus.

    Needs xdotool (X11), wtype or ydotool (Wayland). A point is in the job file before it is typed,
    and typed once. State the window, so that no other program gets numbers. Ends by Ctrl-C.
    """
    from ocmm_serve.lines._feed import KeyboardReceiver, LineFeed, find_tool, run

    made = LineTemplate.parse(template, unit, point, decimal)
    receiver = KeyboardReceiver(find_tool(), window)

    run(
        site.request(plan_for(plan, site.source)), made, _ENDS[end],
        lambda station, plain, note: LineFeed(station, plain, receiver, note),
    )  # fmt: skip
