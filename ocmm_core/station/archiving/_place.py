"""Where a station hands its jobs over to, by its settings.

Also commands that measure read this part of the settings: it changes no number (decision 85).
"""

from __future__ import annotations

from pathlib import Path
from urllib.parse import parse_qsl, urlsplit

from ocmm_core.archive.outbox import ArchivePlace, default_outbox
from ocmm_core.archive.stores import check_address
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
    own = _login(settings.archive_address)
    if own is not None and _login(chosen) not in (own, None):
        # It is that of another login: the owner on a station, say, whose own is in PGPASSWORD.
        password = None
    return ArchivePlace(chosen, settings.archive_station, outbox or default_outbox(), password)


def _login(address: str) -> tuple[str, str] | None:
    """Return user and server of an address; None where it names no server."""
    try:
        parts = urlsplit(address.strip())
    except ValueError:
        return None
    if not parts.scheme.startswith("postgres"):
        return None
    options = dict(parse_qsl(parts.query))
    return parts.username or options.get("user", ""), parts.hostname or options.get("host", "")
