"""The server on a measuring station: for its command, and next to a job in the window."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ocmm_core.composition import stream_options
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.settings import Settings
from ocmm_core.station import MeasuringStation, ServiceSpec, ServiceState
from ocmm_core.station.stream import StreamOptions
from ocmm_serve.ippdme._frames import CsyFrames, ShiftSign
from ocmm_serve.ippdme._grammar import DmeDialect
from ocmm_serve.ippdme._machine import StationMachine
from ocmm_serve.ippdme._server import DmeServer
from ocmm_serve.ippdme._session import DmeSession
from ocmm_serve.ippdme._state import DmeState
from ocmm_serve.site import POINTS


@dataclass(frozen=True, slots=True)
class DmeOptions:
    """Options of a server; those of points are in `ocmm_core.options`."""

    address: StreamOptions
    dialect: DmeDialect = DmeDialect.V14
    sign: ShiftSign = ShiftSign.ORIGIN
    surface: bool = False
    any_place: bool = False
    patience_s: float = 600.0
    tries: int = 3


class DmeService:
    """A server on a station, which belongs to the caller.

    `hand`: virtual hand; None for real probes. `tell`: receives sentences for the operator, on any
    thread. `failed`: receives unexpected errors. InputError as `DmeServer`.
    """

    def __init__(
        self,
        station: MeasuringStation,
        hand: Any,
        header: JobHeader,
        options: DmeOptions,
        tell: Callable[[str], None] = lambda words: None,
        failed: Callable[[Exception], None] = lambda error: None,
    ) -> None:
        self._tell, self._sentence = tell, ""
        self.machine = StationMachine(station, hand, header, self._report)
        self.dme = DmeState(
            self.machine, options.dialect, CsyFrames(options.sign), options.any_place,
            options.surface,
        )  # fmt: skip
        self.session = DmeSession(self.dme, options.patience_s, options.tries)
        self.server = DmeServer(self.session, options.address, failed)

    def start(self) -> None:
        """Listen; MeasuringError if the address is unavailable."""
        self.machine.attach(self.server.touched, self.server.refused)
        try:
            self.server.start()
        except BaseException:
            self.machine.detach()
            raise

    def state(self) -> ServiceState:
        server, sentence = self.server, self._sentence
        if sentence == self.machine.asked:
            # The guidance shows it.
            sentence = ""
        return ServiceState(
            f"I++ DME {self.dme.dialect.version}", "{}:{}".format(*server.address), server.client,
            server.last_command, server.last_answer, sentence,
        )  # fmt: skip

    def operate(self, words: str) -> None:
        self.server.operate(words)

    def close(self) -> bool:
        """End; return whether its thread ended in time."""
        ended = self.server.close()
        self.machine.detach()
        return ended

    def _report(self, words: str) -> None:
        self._sentence = words
        self._tell(words)


def serve_beside(station: MeasuringStation, hand: Any, settings: Settings) -> DmeService:
    """Start a server on a running station, with a job of single points; OcmmError: neither is."""
    address = stream_options(
        settings.serve_port, settings.serve_host, None, allow=settings.serve_allow
    )
    assert address is not None  # noqa: S101 - there is a port
    header = station.job.view().header
    options = DmeOptions(
        address, DmeDialect(settings.serve_dialect), ShiftSign(settings.serve_shift_sign),
        settings.serve_point == "surface",
    )  # fmt: skip
    left = station.jobs.change_plan(resource("plans", POINTS), header)
    if hand is not None:
        hand.stop()
    header = replace(header, part=station.job.plan.part)

    def note(error: Exception) -> None:
        if isinstance(error, OcmmError):
            station.faults.tell(error)

    made = DmeService(station, hand, header, options, failed=note)
    made.start()
    made.machine.tell(left or "The measuring program can connect now.")
    return made


SERVICE = ServiceSpec(serve_beside)
