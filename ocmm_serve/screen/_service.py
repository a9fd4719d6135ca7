"""The second screen next to a job in the window."""

from __future__ import annotations

import secrets
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ocmm_core.composition import stream_options
from ocmm_core.host import is_loopback
from ocmm_core.settings import Settings
from ocmm_core.station import MeasuringStation, ServiceSpec, ServiceState
from ocmm_serve.site import require_package

if TYPE_CHECKING:
    from ocmm_serve.screen._access import ScreenOptions
    from ocmm_serve.screen._server import ScreenServer

_THIS = "127.0.0.1"
_LOCAL = (
    "Only this computer can open the page. State an address of it that the tablet reaches in the "
    "settings."
)


class ScreenService:
    """A running second screen on a station, which belongs to the caller."""

    def __init__(self, server: ScreenServer, options: ScreenOptions) -> None:
        from ocmm_serve.screen._access import code_rows

        self._server = server
        access, (_, port) = options.access, server.start()
        self.page = options.page(port, access.secret if access.may_control else access.read_token)
        self._code = code_rows(self.page)
        self._sentence = _LOCAL if is_loopback(options.address.host) else options.warning

    def state(self) -> ServiceState:
        return ServiceState(
            "OCMM", "{}:{}".format(*self._server.address), sentence=self._sentence,
            page=self.page, open_pages=self._server.readers, code=self._code,
        )  # fmt: skip

    def operate(self, words: str) -> None:
        """Do nothing: the page has no operator."""

    def close(self) -> bool:
        """Disconnect all pages; return whether its thread ended in time."""
        return self._server.close()


def serve_beside(station: MeasuringStation, hand: Any, settings: Settings) -> ScreenService:
    """Start the second screen of a running station.

    The token is that of the live stream, else a new one. OcmmError: it cannot listen, a package is
    missing, or buttons in a network without TLS.
    """
    for package in ("aiohttp", "segno"):
        require_package(package, "screen")
    from ocmm_serve.screen._access import ScreenAccess, ScreenOptions
    from ocmm_serve.screen._server import ScreenServer

    checked = stream_options(
        settings.screen_port, _THIS, settings.stream_token, settings.stream_certificate,
        settings.stream_key,
    )  # fmt: skip
    assert checked is not None  # noqa: S101 - there is a port
    secret = checked.token or secrets.token_urlsafe(24)
    # An empty address would be all of this computer.
    address = replace(checked, host=settings.screen_host.strip() or _THIS, token=secret)
    options = ScreenOptions(address, ScreenAccess(secret, settings.screen_control))

    def note(error: Exception) -> None:
        station.faults.note(error, "The second screen")

    return ScreenService(ScreenServer(station, options, note), options)


SERVICE = ServiceSpec(serve_beside)
