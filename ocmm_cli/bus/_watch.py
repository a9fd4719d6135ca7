"""``ocmm bus watch``: the report of a running bus on the terminal."""

from __future__ import annotations

import time

from rich.console import Console

from ocmm_cli.bus._session import BusSession
from ocmm_core.acquisition.frames import AcquisitionState, read_status
from ocmm_core.fieldbus.report import BusPhase
from ocmm_core.station import BusWatch, bus_text

_POLL_S = 0.05


def watch_bus(
    session: BusSession, seconds: float, every: float | None, console: Console
) -> tuple[str, bool]:
    """Print the report of a bus at intervals and at the end.

    ``seconds``: duration; ``every``: interval, s, None prints only at the end. Returns the last
    report, and whether the bus was in operation then. BusError if the bus process ended; its last
    report was printed.
    """
    watch = BusWatch(session.feed.ring)
    begin = printed = time.monotonic()
    stopped = False
    while not stopped and time.monotonic() - begin < seconds:
        time.sleep(_POLL_S)
        watch.report()
        status = read_status(session.feed.ring)
        stopped = status.state is AcquisitionState.STOPPED
        if every is not None and watch.report() and time.monotonic() - printed >= every:
            printed = time.monotonic()
            console.out(bus_text(watch, session.rig.name), highlight=False)
    report = watch.report()
    text = "" if report is None and stopped else bus_text(watch, session.rig.name)
    if text:
        console.out(text, highlight=False, end="")
    if stopped:
        raise status.error("bus.watch", "Correct that and repeat the command.")
    return text, report is not None and report.phase is BusPhase.OPERATION
