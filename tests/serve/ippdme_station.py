"""The server of the product within the test: a station of the virtual rig, and its socket."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.composition import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.station.stream import StreamOptions
from ocmm_serve.ippdme import (
    CsyFrames,
    DmeDialect,
    DmeServer,
    DmeSession,
    DmeState,
    ShiftSign,
    StationMachine,
)
from ocmm_sim.scene import WorldOptions
from tests.serve.ippdme_grammar import Dialect

RATE_HZ = 500
"""Frames per second; a quarter of the rig's, where speed does not matter."""


@dataclass(frozen=True, slots=True)
class ServedStation:
    built: BuiltStation
    session: DmeSession
    """Of the thread of the server; see `pure_session`."""
    address: tuple[str, int]
    told: list[str]
    """Sentences for the operator."""
    failures: list[Exception]


@contextmanager
def served_station(
    out: Path,
    dialect: Dialect = "1.4",
    *,
    world: WorldOptions | None = None,
    patience_s: float = 600.0,
    tries: int = 3,
    speed: float = 0.0,
) -> Iterator[ServedStation]:
    """Serve a station, at full speed unless another is given; it must not fail."""
    told: list[str] = []
    failures: list[Exception] = []
    built, machine = _machine(out, told, world, speed)
    try:
        session = _session(machine, dialect, patience_s, tries)
        server = DmeServer(session, StreamOptions(), failures.append)
        machine.start(server.touched, server.refused)
        try:
            yield ServedStation(built, session, server.start(), told, failures)
        finally:
            assert server.close()
    finally:
        machine.close()
    assert failures == []


@contextmanager
def pure_session(out: Path, dialect: Dialect = "1.4") -> Iterator[DmeSession]:
    """Yield a session without a socket, on a station whose touches it does not get."""
    _, machine = _machine(out, [], None, 0.0)
    try:
        machine.start(lambda point: None, lambda refusal: None)
        yield _session(machine, dialect, 600.0, 3)
    finally:
        machine.close()


def _machine(
    out: Path, told: list[str], world: WorldOptions | None, speed: float
) -> tuple[BuiltStation, StationMachine]:
    request = StationRequest(
        plan=resource("plans", "points.toml"), out=out, stay=True, idle=True, world=world,
        frame_rate_hz=RATE_HZ, speed=speed,
    )  # fmt: skip
    built = build_station(request)
    header = JobHeader("judge", built.station.job.plan.part, "1")
    return built, StationMachine(built, header, told.append)


def _session(
    machine: StationMachine, dialect: Dialect, patience_s: float, tries: int
) -> DmeSession:
    edition = DmeDialect.V14 if dialect == "1.4" else DmeDialect.V25
    state = DmeState(machine, edition, CsyFrames(ShiftSign.ORIGIN), any_place=False)
    return DmeSession(state, patience_s, tries)
