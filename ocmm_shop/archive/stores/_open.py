"""Open an archive by its address: a server, or a file."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs

from ocmm_core.errors import StorageError
from ocmm_core.seals import KnownEnd, recall, remember
from ocmm_shop.archive.stores._address import check_address, is_server, parse_server
from ocmm_shop.archive.stores._postgresql import PostgresArchive
from ocmm_shop.archive.stores._sqlite import SqliteArchive
from ocmm_shop.archive.stores._store import SqlArchive


def default_archive() -> Path:
    return platformdirs.user_data_path("ocmm") / "archive.sqlite"


def open_archive(
    address: str = "",
    *,
    password: Path | None = None,
    set_up: bool = False,
    read_only: bool = False,
) -> SqlArchive:
    """Return an open archive, a context manager.

    `address`: ``postgresql://USER@SERVER/DATABASE``, a file, or empty for that of this user.
    `password`: file with that of a server; None: by libpq. `set_up`: create or update the tables of
    a server, or replace a lost file. `read_only`: nothing can be added. InputError: unusable
    address, or the extra `shop` is missing; StorageError: unreachable, lost, or of a later version.
    """
    check_address(address)
    if is_server(address):
        return PostgresArchive(parse_server(address, password), set_up=set_up, read_only=read_only)
    path = Path(address).expanduser() if address else default_archive()
    memory = KnownEnd(name=f"archive {path.absolute()}", count=1, link="")
    if not os.path.lexists(path) and not set_up and recall(memory.name) is not None:
        raise StorageError(
            "archive.lost",
            f"{path}: the archive that this station has used is missing.",
            "Put the file back, or restore it from a backup. If there is none, start a new one, "
            "which gets the jobs in the outbox again: ocmm archive set-up.",
        )
    if read_only and not path.exists():
        raise StorageError(
            "archive.missing",
            f"{path}: there is no archive yet.",
            "Hand over the first job: ocmm archive send.",
        )
    opened = SqliteArchive(path, read_only=read_only)
    remember(memory, sync=False)
    return opened
