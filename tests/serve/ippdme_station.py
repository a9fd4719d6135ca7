"""The server of the product within the test: a station of the virtual rig, and its socket."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.composition import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.station.stream import StreamOptions
from ocmm_serve.ippdme import DmeDialect, DmeOptions, DmeService, DmeSession
from ocmm_serve.site import close_station
from ocmm_sim.scene import WorldOptions
from tests.serve.ippdme_grammar import Dialect

RATE_HZ = 500
"""Frames per second; a quarter of the rig's, where speed does not matter."""


@dataclass(frozen=True, slots=True)
class ServedStation:
    built: BuiltStation
    session: DmeSession
    """The thread of the server; see `pure_session`."""
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
    built, service = _service(
        out, dialect, told, world=world, speed=speed, patience_s=patience_s, tries=tries,
        failed=failures.append,
    )  # fmt: skip
    try:
        service.machine.start()
        service.start()
        try:
            address = service.server.address
            yield ServedStation(built, service.session, address, told, failures)
        finally:
            assert service.close()
    finally:
        close_station(built.station)
    assert failures == []


@contextmanager
def pure_session(out: Path, dialect: Dialect = "1.4") -> Iterator[DmeSession]:
    """Yield a session without a socket, on a station whose touches it does not get."""
    built, service = _service(out, dialect, [])
    try:
        service.machine.start()
        yield service.session
    finally:
        close_station(built.station)


def _service(
    out: Path,
    dialect: Dialect,
    told: list[str],
    *,
    world: WorldOptions | None = None,
    speed: float = 0.0,
    patience_s: float = 600.0,
    tries: int = 3,
    failed: Callable[[Exception], None] = lambda error: None,
) -> tuple[BuiltStation, DmeService]:
    request = StationRequest(
        plan=resource("plans", "points.toml"), out=out, stay=True, idle=True, world=world,
        frame_rate_hz=RATE_HZ, speed=speed,
    )  # fmt: skip
    built = build_station(request)
    header = JobHeader("judge", built.station.job.plan.part, "1")
    edition = DmeDialect.V14 if dialect == "1.4" else DmeDialect.V25
    options = DmeOptions(StreamOptions(), edition, patience_s=patience_s, tries=tries)
    return built, DmeService(built.station, built.hand, header, options, told.append, failed)
