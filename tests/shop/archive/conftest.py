from __future__ import annotations

import importlib.util
import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from ocmm_core.camera import load_rig
from ocmm_core.inspection.plan import load_plan
from ocmm_core.measuring import Touch
from ocmm_core.tracking import load_probe
from ocmm_shop.archive.stores import open_archive, role_statements
from ocmm_shop.archive.stores._store import Archive
from tests.core.inspection.conftest import PLAN, PROBE, RIG, Bench, quick_touches
from tests.host import HANG_S, needs_package, needs_postgresql, postgresql_tools
from tests.shop.archive.real_jobs import RealJobs, make_real_jobs

TABLES = (
    "migration", "station", "sender", "file", "job", "result", "used", "delivery", "finding",
    "mark", "station_login", "station_key",
)  # fmt: skip
"""Of an archive on a server."""


@dataclass(frozen=True, slots=True)
class Server:
    """A PostgreSQL cluster of the tests, on a private socket."""

    socket: Path
    tools: Path
    owner: str

    def address(self, database: str, user: str = "") -> str:
        return f"postgresql:///{database}?host={self.socket}&user={user or self.owner}"

    def sql(self, database: str, *statements: str) -> None:
        import psycopg

        with psycopg.connect(
            host=str(self.socket), dbname=database, user=self.owner, autocommit=True
        ) as db:
            for statement in statements:
                db.execute(statement.encode())


def as_server(owner: str, *command: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a command as the user that a server may run as; it refuses root."""
    prefix = ["setpriv", "--reuid", owner, "--regid", owner, "--clear-groups"]
    return subprocess.run(
        [*(prefix if os.geteuid() == 0 else []), *map(str, command)], check=True,
        capture_output=True, text=True, timeout=HANG_S, cwd="/",
    )  # fmt: skip


@pytest.fixture(scope="session", autouse=True)
def _cluster() -> Iterator[Server | None]:
    """Start a cluster, once for all tests of this process and before the first of them.

    Within a test it would be something that the test left behind.
    """
    tools = postgresql_tools()
    if isinstance(tools, str) or importlib.util.find_spec("psycopg") is None:
        yield None
        return
    owner = "postgres" if os.geteuid() == 0 else pwd.getpwuid(os.getuid()).pw_name
    # Beside the folders of pytest, which only their owner may enter; a socket has a short path.
    place = Path(tempfile.mkdtemp(prefix="ocmm-pg-"))
    if os.geteuid() == 0:
        shutil.chown(place, owner, owner)
    data = place / "data"
    try:
        as_server(
            owner, tools / "initdb", "-D", data, "-U", owner, "--auth=trust", "--no-sync",
            "--encoding=UTF8", "--locale=C",
        )  # fmt: skip
        settings = f"-k {place} -c listen_addresses= -c fsync=off -c shared_buffers=64MB"
        as_server(
            owner, tools / "pg_ctl", "-D", data, "-l", place / "log", "-w", "-o", settings, "start"
        )
        try:
            yield Server(place, tools, owner)
        finally:
            as_server(owner, tools / "pg_ctl", "-D", data, "-m", "immediate", "-w", "stop")
    finally:
        shutil.rmtree(place, ignore_errors=True)


@pytest.fixture
def server(_cluster: Server | None) -> Server:
    """Return the cluster; NOT RUN if the host has none."""
    needs_postgresql()
    needs_package("psycopg", "extra `shop`")
    assert _cluster is not None
    return _cluster


@dataclass(frozen=True, slots=True)
class Place:
    """An empty archive of one of the two stores."""

    address: str
    store: str
    server: Server | None = None
    database: str = ""

    def open(self, *, read_only: bool = False) -> Archive:
        return open_archive(self.address, read_only=read_only)


def by_hand(archive: Archive, sql: str, content: bytes | None = None) -> None:
    """Execute SQL with the rights of a connection, outside the program."""
    values = None if content is None else {"c": content}
    if sql.startswith("PRAGMA"):
        archive._run(sql)  # noqa: SLF001 - as a person with a tool of the store
        return
    with archive._transaction():  # noqa: SLF001
        archive._run(sql, values)  # noqa: SLF001


@pytest.fixture(params=["sqlite", "postgresql"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Place:
    """Return an empty archive; every test with this fixture runs on both stores."""
    if request.param == "sqlite":
        address = str(tmp_path / "archive.sqlite")
        with open_archive(address):
            return Place(address, "sqlite")
    made: Callable[[], Place] = request.getfixturevalue("new_database")
    return made()


@pytest.fixture
def new_database(server: Server) -> Callable[[], Place]:
    """Return what makes one database after another, each with the three roles."""

    def make() -> Place:
        _DATABASES.append("x")
        name = f"ocmm_{len(_DATABASES)}"
        server.sql("postgres", f"CREATE DATABASE {name}")
        address = server.address(name)
        with open_archive(address, set_up=True):
            pass
        server.sql(
            name,
            *role_statements(),
            *(
                f"DO $$ BEGIN CREATE ROLE {user} LOGIN IN ROLE {role}; "
                "EXCEPTION WHEN duplicate_object THEN NULL; END $$"
                for user, role in LOGINS.items()
            ),
            "INSERT INTO ocmm.station_login (login, station) VALUES ('station1', 'Station 1'),"
            " ('station2', 'Station 2')",
        )
        return Place(address, "postgresql", server, name)

    return make


_DATABASES: list[str] = []
LOGINS = {
    "station1": "ocmm_station",
    "station2": "ocmm_station",
    "looker": "ocmm_reader",
    "anna": "ocmm_quality",
}


__all__ = ["quick_touches"]  # the fixture of the rooms of inspection


@pytest.fixture
def bench(quick_touches: tuple[Touch, ...], tmp_path: Path) -> Bench:
    return Bench(load_plan(PLAN), load_rig(RIG), load_probe(PROBE), quick_touches, tmp_path)


@pytest.fixture(scope="session")
def real_jobs(
    quick_touches: tuple[Touch, ...], tmp_path_factory: pytest.TempPathFactory
) -> RealJobs:
    folder = tmp_path_factory.mktemp("jobs")
    return make_real_jobs(
        Bench(load_plan(PLAN), load_rig(RIG), load_probe(PROBE), quick_touches, folder)
    )
