"""``ocmm serve ippdme``: an entry point of the group `ocmm.commands`."""

from __future__ import annotations

import sys
import threading
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

import typer

from ocmm_cli.options import StationChoice
from ocmm_cli.terminal import lead, make_console, shown
from ocmm_core.documents import resource
from ocmm_serve.site import POINTS, ServedAddress, close_station, stop_event

if TYPE_CHECKING:
    from ocmm_cli.terminal import PlainConsole
    from ocmm_serve.ippdme._server import DmeService

serve_app = typer.Typer(
    no_args_is_help=True, help="Serve points to measuring programs of other makers."
)
_LOOK_S = 0.2


@serve_app.command("ippdme")
def serve_ippdme(
    *,
    address: ServedAddress,
    dialect: str,
    shift_sign: str,
    point: str,
    any_place: bool,
    patience: float,
    tries: int,
    site: StationChoice,
) -> None:
    """Let a measuring program measure with this machine, by I++ DME (VDMA 8722).

    The program is the client, this machine the server; see docs/integrator/ippdme.md. Every session
    writes a job file with all points, their raw spots, and the nominals of the program. Ends by
    Ctrl-C.
    """
    from ocmm_core.composition import build_station
    from ocmm_core.inspection.evaluation import JobHeader
    from ocmm_serve.ippdme._frames import ShiftSign
    from ocmm_serve.ippdme._grammar import DmeDialect
    from ocmm_serve.ippdme._server import DmeOptions, DmeService
    from ocmm_serve.ippdme._session import OPERATOR

    console = make_console()
    options = DmeOptions(
        address.options(0), DmeDialect(dialect), ShiftSign(shift_sign), point == "surface",
        any_place, patience, tries,
    )  # fmt: skip
    ended = stop_event()
    failures: list[Exception] = []

    def fail(error: Exception) -> None:
        failures.append(error)
        console.show(str(error))

    built = build_station(replace(site.request(resource("plans", POINTS)), stay=True, idle=True))
    header = JobHeader(site.operator, built.station.job.plan.part, site.serial)
    try:
        service = DmeService(built.station, built.hand, header, options, console.show, fail)
        service.machine.start()
        console.print(f"{lead('Source  ')}{built.description.name}", highlight=True)
        service.start()
        state = service.state()
        console.show(f"{state.title} on {state.address}. Ctrl-C ends.")
        if sys.stdin is not None and sys.stdin.isatty():
            console.show(f"Type {OPERATOR}.")
            threading.Thread(target=_read_keys, args=(service,), name="keys", daemon=True).start()
        _show_way(console, service, ended)
        service.close()
    finally:
        close_station(built.station)
    if failures and not ended.is_set():
        raise failures[-1]


def _show_way(console: PlainConsole, service: DmeService, ended: threading.Event) -> None:
    """Show the way to the target until the end; on a terminal only, other outputs are files."""
    with console.status("") if console.is_terminal else nullcontext() as line:
        while service.server.is_running and not ended.wait(_LOOK_S):
            if line is not None:
                line.update(shown(service.machine.way_words()))


def _read_keys(service: DmeService) -> None:
    for line in sys.stdin:
        service.operate(line)
