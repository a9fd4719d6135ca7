"""Archive and outbox of a station by its settings; changes no number (decision 85)."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.errors import InputError
from ocmm_core.settings import Settings, SettingsStore
from ocmm_shop.archive.outbox import ArchivePlace, default_outbox
from ocmm_shop.archive.stores import check_address, is_server, parse_server

LOCAL, OFF = "local", "off"


def is_off(address: str) -> bool:
    return address.strip().lower() == OFF


def archive_place(
    address: str | None = None, settings: Settings | None = None, outbox: Path | None = None
) -> ArchivePlace | None:
    """Return the places of archive and outbox; None if the archive is off.

    `address` overrides `settings`; these and `outbox` (a folder) default to this user's.
    InputError: the address cannot be used.
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
        # The password is of another login, e.g. the owner's, whose own is in PGPASSWORD.
        password = None
    return ArchivePlace(chosen, settings.archive_station, outbox or default_outbox(), password)


def _login(address: str) -> tuple[str, str, str] | None:
    """Return user, server and port of an address; None without a server."""
    address = address.strip()
    if not is_server(address):
        return None
    try:
        options = parse_server(address).options
    except InputError:
        return None
    host = options.get("host", "")
    # Server names are case-insensitive; a folder with a socket is not.
    host = host if host.startswith("/") else host.lower()
    return options.get("user", ""), host, options.get("port", "5432")
