"""A station that runs until Ctrl-C while its points leave as text."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

from ocmm_cli.terminal import lead, make_console, say, told
from ocmm_core.composition import Origin, StationRequest, build_station, origin_of
from ocmm_core.documents import resource
from ocmm_core.options import DEMO_PLAN
from ocmm_core.station import MeasuringStation
from ocmm_core.station.stream import PlainLines
from ocmm_serve.lines._template import LineTemplate
from ocmm_serve.site import POINTS, close_station, keep_open, stop_event

_POLL_S = 0.05

Note = Callable[[str], None]
Face = Callable[[MeasuringStation, PlainLines, Note], AbstractContextManager[object]]
"""Connects the lines of a station to their destination; its text names that."""


def plan_for(plan: Path | None, source: str) -> Path:
    """Return the plan, else the demonstration of a virtual source, else a list of points."""
    if plan is not None:
        return plan
    virtual = origin_of(source) is Origin.VIRTUAL
    return DEMO_PLAN if virtual else resource("plans", POINTS)


def run(request: StationRequest, template: LineTemplate, end: bytes, face: Face) -> None:
    """Measure until Ctrl-C or the end of the source; OcmmError if the station fails."""
    console = make_console(soft_wrap=True)
    ended = stop_event()

    def note(words: str) -> None:
        console.print(say(words), style="yellow", highlight=False)

    built = build_station(request)
    station = built.station
    try:
        plain = PlainLines(lambda one: template.line(one).encode("ascii") + end, note)
        if request.plan.name == POINTS:
            station.events.point_taken.connect(keep_open(station))
        station.events.point_refused.connect(
            lambda refusal: note(f"{say('Point refused:')} {told(refusal)}")
        )
        station.faults.failed.connect(lambda error: note(str(error)))
        with face(station, plain, note) as made:
            console.print(f"{lead('Source  ')}{built.description.name}", highlight=False)
            console.print(f"{lead('Job     ')}{built.job_path}", highlight=False)
            console.print(say(template.words), highlight=False)
            console.print(f"{lead('Lines   ')}{made}", highlight=False)
            station.start()
            while not ended.is_set() and not station.wait_finished(_POLL_S):
                failure = station.faults.why_failed()
                if failure is not None:
                    raise failure
    finally:
        close_station(station)
