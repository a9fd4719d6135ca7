"""Where a station hands its jobs over to, by its settings.

Also commands that measure read this part of the settings: it changes no number (decision 85).
"""

from __future__ import annotations

from pathlib import Path

from ocmm_core.archive.outbox import ArchivePlace, default_outbox
from ocmm_core.archive.stores import check_address, is_server, parse_server
from ocmm_core.errors import InputError
from ocmm_core.settings import Settings, SettingsStore

LOCAL, OFF = "local", "off"


def is_off(address: str) -> bool:
    """Return whether nothing is archived."""
    return address.strip().lower() == OFF


def archive_place(
    address: str | None = None, settings: Settings | None = None, outbox: Path | None = None
) -> ArchivePlace | None:
    """Return where jobs are handed over to; None where the archive is off.

    Parameters
    ----------
    address
        Wins over the settings; None is theirs.
    settings
        None are those of this user.
    outbox
        Folder of the outbox; None is that of this user.

    Raises
    ------
    InputError
        The address cannot be used.
    """
    settings = settings or SettingsStore.of_this_user().load().settings
    chosen = (address if address is not None else settings.archive_address).strip()
    if is_off(chosen):
        return None
    if chosen.lower() == LOCAL:
        chosen = ""
    check_address(chosen)
    password = settings.archive_password
    login = _login(chosen)
    if login is not None and login != _login(settings.archive_address):
        # It is that of another login: the owner on a station, say, whose own is in PGPASSWORD.
        password = None
    return ArchivePlace(chosen, settings.archive_station, outbox or default_outbox(), password)


def _login(address: str) -> tuple[str, str, str] | None:
    """Return user, server and port of an address; None where it names no server."""
    address = address.strip()
    if not is_server(address):
        return None
    try:
        options = parse_server(address).options
    except InputError:
        return None
    host = options.get("host", "")
    # A name of a server is the same in small letters; a folder with a socket is not.
    host = host if host.startswith("/") else host.lower()
    return options.get("user", ""), host, options.get("port", "5432")
