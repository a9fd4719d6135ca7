"""``ocmm serve ippdme``: an entry point of the group `ocmm.commands`."""

from __future__ import annotations

import sys
import threading
from dataclasses import replace
from typing import TYPE_CHECKING

import typer

from ocmm_cli.terminal import lead, make_console, say, shown
from ocmm_core.documents import resource
from ocmm_serve.site import POINTS, ServedAddress, ServedStation, stop_event

if TYPE_CHECKING:
    from rich.console import Console

    from ocmm_serve.ippdme._machine import StationMachine
    from ocmm_serve.ippdme._server import DmeServer

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
    any_place: bool,
    patience: float,
    tries: int,
    site: ServedStation,
) -> None:
    """Let a measuring program measure with this machine, by I++ DME (VDMA 8722).

    The program is the client, this machine the server; see docs/integrator/ippdme.md. Every session
    writes a job file with all points, their raw spots, and the nominals of the program. Ends by
    Ctrl-C.
    """
    from ocmm_core.composition import build_station
    from ocmm_core.inspection.evaluation import JobHeader
    from ocmm_serve.ippdme._dialect import DmeDialect
    from ocmm_serve.ippdme._frames import CsyFrames, ShiftSign
    from ocmm_serve.ippdme._machine import StationMachine
    from ocmm_serve.ippdme._server import DmeServer
    from ocmm_serve.ippdme._session import OPERATOR, DmeSession
    from ocmm_serve.ippdme._state import DmeState

    console = make_console()
    options = address.options(0)
    ended = stop_event()
    failures: list[Exception] = []

    def tell(words: str) -> None:
        console.print(say(words), highlight=False, markup=False)

    def fail(error: Exception) -> None:
        failures.append(error)
        tell(str(error))

    request = site.request(resource("plans", POINTS))
    built = build_station(replace(request, stay=True, idle=True))
    header = JobHeader(site.operator, built.station.job.plan.part, site.serial)
    machine = StationMachine(built, header, tell)
    try:
        edition, frames = DmeDialect(dialect), CsyFrames(ShiftSign(shift_sign))
        state = DmeState(machine, edition, frames, any_place=any_place)
        server = DmeServer(DmeSession(state, patience, tries), options, fail)
        machine.start(server.touched, server.refused)
        console.print(f"{lead('Source  ')}{built.description.name}")
        place, version = "{}:{}".format(*server.start()), edition.version
        tell(f"I++ DME {version} on {place}. Ctrl-C ends.")
        if sys.stdin is not None and sys.stdin.isatty():
            tell(f"Type {OPERATOR}.")
            threading.Thread(target=_read_keys, args=(server,), name="keys", daemon=True).start()
        _show_way(console, machine, server, ended)
        server.close()
    finally:
        machine.close()
    if failures and not ended.is_set():
        raise failures[-1]


def _show_way(
    console: Console, machine: StationMachine, server: DmeServer, ended: threading.Event
) -> None:
    """Show the way to the target until the end; on a terminal only, other outputs are files."""
    if not console.is_terminal:
        while server.is_running and not ended.wait(_LOOK_S):
            pass
        return
    with console.status("") as line:
        while server.is_running and not ended.wait(_LOOK_S):
            line.update(shown(machine.way_words()))


def _read_keys(server: DmeServer) -> None:
    for line in sys.stdin:
        server.operate(line)
