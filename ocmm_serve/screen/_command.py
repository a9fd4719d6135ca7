"""``ocmm serve screen``: an entry point of the group `ocmm.commands`."""

from __future__ import annotations

import secrets
from dataclasses import replace
from pathlib import Path

from rich.style import Style

from ocmm_cli.options import StationChoice
from ocmm_cli.terminal import lead, make_console
from ocmm_serve.site import (
    ServedAddress,
    measure_until,
    plan_for,
    require_package,
    serving,
    stop_event,
)

PORT = 1391


def serve_screen(
    *,
    address: ServedAddress,
    token: Path | None,
    control: bool,
    plan: Path | None,
    site: StationChoice,
) -> None:
    """Show a job on a tablet or phone at the part: digits, next point, plan and results.

    Prints the address of the page, on a terminal also as QR code. The page reads only, unless
    --control is given. Ends by Ctrl-C.
    """
    require_package("aiohttp", "screen")
    from ocmm_serve.screen import _access
    from ocmm_serve.screen._server import ScreenServer

    stream = address.options(PORT, token)
    options = _access.ScreenOptions(
        stream, _access.ScreenAccess(stream.token or secrets.token_urlsafe(24), control)
    )
    console = make_console(soft_wrap=True)
    ended = stop_event()
    with serving(replace(site.request(plan_for(plan, site.source)), stay=True), console) as built:
        station = built.station
        server = ScreenServer(
            station, options, lambda error: station.faults.note(error, "The second screen")
        )
        _, port = server.start()
        try:
            if options.warning:
                console.show(options.warning, style="yellow")
            access = options.access
            pages = [(lead("Page    "), access.read_token)]
            if access.may_control:
                pages.append((lead("Buttons "), access.secret))
            for label, secret in pages:
                page = options.page(port, secret)
                console.print(f"{label}{page}")
                if console.is_terminal:
                    console.print(
                        "\n".join(_access.code_lines(page)),
                        style=Style(color="white", bgcolor="black"),
                    )
            measure_until(station, ended, lasting=True)
        finally:
            server.close()
