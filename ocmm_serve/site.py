"""Served stations: their options, each group as one parameter of a command, and their end."""

from __future__ import annotations

import importlib.util
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ocmm_cli.terminal import tr
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.options import DEMO_PLAN
from ocmm_core.plugins import install_line

if TYPE_CHECKING:
    from ocmm_cli.terminal import PlainConsole
    from ocmm_core.composition import BuiltStation, StationRequest
    from ocmm_core.station import MeasuringStation
    from ocmm_core.station.stream import StreamOptions

POINTS = "points.toml"
"""Plan of single points, which never ends."""
_POLL_S = 0.05


@dataclass(frozen=True, slots=True)
class ServedAddress:
    """Address of a server, and its permitted clients."""

    host: str
    port: int | None
    allow: list[str] | None
    certificate: Path | None
    private_key: Path | None

    def options(self, port: int, token: Path | None = None) -> StreamOptions:
        """Return the options of the server; ``port`` if none is given; InputError if unusable.

        `token`: file with the token, for clients that send one.
        """
        from ocmm_core.composition import stream_options

        allow = tuple(self.allow or ())
        chosen = port if self.port is None else self.port
        found = stream_options(chosen, self.host, token, self.certificate, self.private_key, allow)
        assert found is not None  # noqa: S101 - there is a port
        return found


@dataclass(frozen=True, slots=True)
class PublishedPlaces:
    """Where the facts of a station are that another process measures with."""

    out: Path
    """Folder of its jobs."""
    stream: int | None
    """Port of its live stream on this computer; None: its state is unknown."""
    probes: Path | None
    calibrations: Path | None
    """`probes`, `calibrations`: folders of records; None for those of this user."""
    corrections: Path | None
    """Document of a machine tool; None: no corrections are published."""
    records: Path | None
    """Folder of the registers of corrections; None for that of this user."""


def require_package(name: str, extra: str) -> None:
    """Raise InputError, with the command that installs it, unless a package is there."""
    if importlib.util.find_spec(name) is None:
        raise InputError(
            "serve.package",
            f"This server needs the package {name}, which is not installed.",
            f"Install it: {install_line(extra)}.",
        )


def stop_event() -> threading.Event:
    """Return an event that Ctrl-C and the end of a service set."""
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    return ended


def plan_for(plan: Path | None, source: str) -> Path:
    """Return the plan, else the demonstration of a virtual source, else a list of points."""
    from ocmm_core.composition import Origin, origin_of

    if plan is not None:
        return plan
    return DEMO_PLAN if origin_of(source) is Origin.VIRTUAL else resource("plans", POINTS)


@contextmanager
def serving(request: StationRequest, console: PlainConsole) -> Iterator[BuiltStation]:
    """Build a station, print its refusals and faults, and close it at the end.

    Plans of single points stay open.
    """
    from ocmm_cli.terminal import error_text, lead
    from ocmm_core.composition import build_station

    built = build_station(request)
    station = built.station
    try:
        if request.plan.name == POINTS:
            station.events.point_taken.connect(keep_open(station))
        station.events.point_refused.connect(
            lambda refusal: console.print(
                f"{tr('Point refused:')} {error_text(refusal)}", style="yellow"
            )
        )
        station.faults.failed.connect(
            lambda error: console.print(error_text(error), style="yellow")
        )
        console.print(f"{lead('Source  ')}{built.description.name}")
        console.print(f"{lead('Job     ')}{built.job_path}")
        yield built
    finally:
        close_station(station)


def measure_until(
    station: MeasuringStation, ended: threading.Event, *, lasting: bool = False
) -> None:
    """Measure until an event or, unless ``lasting``, the end of the source; OcmmError: failed."""
    station.start()
    while not ended.wait(_POLL_S) and (lasting or not station.wait_finished(0.0)):
        failure = station.faults.why_failed()
        if failure is not None:
            raise failure


def keep_open(station: MeasuringStation) -> Callable[[object], None]:
    """Return a slot that opens the only feature of a plan of single points again after a point."""
    plan = station.job.plan

    def reopen(_: object) -> None:
        if station.job.plan is plan and not station.job.missing():
            station.job.change(lambda session: session.steps.reopen(plan.features[0].name))

    return reopen


def close_station(station: MeasuringStation) -> None:
    """Close a station, raise the loss of its job, and remove a job without points."""
    from ocmm_core.station import drop_job_without_points

    path = station.job.path
    station.close()
    if station.job.lost is not None:
        raise station.job.lost
    drop_job_without_points(path)
