"""A server of I++ DME over the virtual rig, and a plain socket that talks to it."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from ocmm_core.composition import BuiltStation, ClimateRequest, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.inspection.session import CLIENT_EVENT
from ocmm_core.station.stream import StreamOptions
from ocmm_core.storage import JobFile
from ocmm_serve.ippdme import (
    CsyFrames,
    DmeDialect,
    DmeOptions,
    DmeServer,
    DmeService,
    DmeSession,
    DmeState,
    ShiftSign,
    StationMachine,
)
from ocmm_serve.site import close_station
from tests.host import HANG_S
from tests.waiting import wait_until

RATE_HZ = 500


class PlainClient:
    """Lines over a socket; nothing of the product."""

    def __init__(self, address: tuple[str, int]) -> None:
        self.socket = socket.create_connection(address, timeout=HANG_S)
        self._lines = self.socket.makefile("rb")

    def send(self, line: str) -> None:
        self.socket.sendall(line.encode() + b"\r\n")

    def line(self) -> str:
        """Return the next line; empty at the end of the connection."""
        found = self._lines.readline()
        assert not found or found.endswith(b"\r\n"), found
        return found.decode("ascii").removesuffix("\r\n")

    def ask(self, line: str) -> list[str]:
        """Send a command; return the lines up to its end."""
        self.send(line)
        return self.until(f"{line[:5]} %")

    def until(self, last: str) -> list[str]:
        """Return the lines up to one."""
        lines = [self.line()]
        while lines[-1] != last:
            assert lines[-1], lines
            lines.append(self.line())
        return lines

    def close(self) -> None:
        self._lines.close()
        self.socket.close()

    def __enter__(self) -> PlainClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@dataclass
class DmeBench:
    """A running server."""

    built: BuiltStation
    machine: StationMachine
    state: DmeState
    session: DmeSession
    server: DmeServer
    told: list[str] = field(default_factory=list)
    failures: list[Exception] = field(default_factory=list)

    def client(self) -> PlainClient:
        return PlainClient(self.server.address)

    def forget(self) -> None:
        """Wait until no client is connected, and return to the state of a new server."""
        wait_until(lambda: not self.state.in_session and not self.server.makes_room)
        self.state.homed, self.state.tool, self.state.found = False, "NoTool", "UnDefTool"
        self.state.frames = CsyFrames(self.state.frames.sign)
        self.state.acts.clear()


@contextmanager
def dme_bench(
    folder: Path, dialect: DmeDialect = DmeDialect.V14, sign: ShiftSign = ShiftSign.ORIGIN,
    *, tries: int = 3, any_place: bool = False, surface: bool = False,
    probes: Path | None = None, climate: ClimateRequest | None = None,
) -> Iterator[DmeBench]:  # fmt: skip
    request = StationRequest(
        plan=resource("plans", "points.toml"), out=folder, stay=True, idle=True,
        frame_rate_hz=RATE_HZ, probes=probes, climate=climate or ClimateRequest(),
    )  # fmt: skip
    built = build_station(request)
    told: list[str] = []
    failures: list[Exception] = []
    options = DmeOptions(
        StreamOptions(), dialect, sign, surface=surface, any_place=any_place, tries=tries
    )
    header = JobHeader("tester", "PART", "1")
    service = DmeService(built.station, built.hand, header, options, told.append, failures.append)
    try:
        service.machine.start()
        service.start()
        yield DmeBench(
            built, service.machine, service.dme, service.session, service.server, told, failures
        )
    finally:
        ended = service.close()
        close_station(built.station)
    assert ended
    assert not failures


def notes_of(job: Path) -> list[dict[str, object]]:
    """Return the notes of a job on points that were answered."""
    with JobFile.open(job, read_only=True) as file:
        events = [one.text for one in file.events() if one.kind == CLIENT_EVENT]
        notes = [msgspec.json.decode(text, type=dict[str, object]) for text in events]
        return [one for one in notes if "point" in one]


def shape_of(line: str) -> str:
    """Return a data line with its numbers as `n`; errors keep theirs."""
    tag, _, rest = line.partition(" ")
    if not rest.startswith("#"):
        return line
    return f"{tag} {re.sub(r'(?<![A-Za-z0-9.])[+-]?[0-9]+(?:[.][0-9]+)?', 'n', rest)}"
