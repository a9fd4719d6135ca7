"""Open an archive by its address: a server, or a file."""

from __future__ import annotations

from pathlib import Path

import platformdirs

from ocmm_core.errors import StorageError
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

    Parameters
    ----------
    address
        ``postgresql://USER@SERVER/DATABASE``, or the path of a file; empty is the file in the data
        folder of this user.
    password
        File with the password of a server; None: libpq searches it.
    set_up
        Create or update the tables of a server; those of a file always are.
    read_only
        Nothing can be added.

    Raises
    ------
    InputError
        The address cannot be used, or the extra `shop` is not installed.
    StorageError
        The archive cannot be reached or opened, or is of a later version.
    """
    check_address(address)
    if is_server(address):
        return PostgresArchive(parse_server(address, password), set_up=set_up, read_only=read_only)
    path = Path(address).expanduser() if address else default_archive()
    if read_only and not path.exists():
        raise StorageError(
            "archive.missing",
            f"{path}: there is no archive yet.",
            "Hand over the first job: ocmm archive send.",
        )
    return SqliteArchive(path, read_only=read_only)
