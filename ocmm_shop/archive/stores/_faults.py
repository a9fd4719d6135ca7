"""Errors of stores and servers, as sentences for the person at the machine."""

from __future__ import annotations

import sqlite3
from enum import Enum

from ocmm_core.errors import InputError, OcmmError, StorageError


class Remedy(Enum):
    """Reaction of a sender to an error."""

    RETRY = "later"
    """The archive is unavailable: retry with growing pauses."""
    ASIDE = "aside"
    """This one job is refused: keep and name it, and send the next."""


_ASIDE = ("archive.row", "archive.sequence")


def remedy_of(error: OcmmError) -> Remedy:
    own = error.code.startswith("archive.")
    return Remedy.ASIDE if error.code in _ASIDE or not own else Remedy.RETRY


def newer(place: str, found: int, known: int) -> StorageError:
    return StorageError(
        "archive.newer",
        f"{place}: the archive has version {found}, this program knows {known}.",
        "Install the newer program on this station; jobs wait in its outbox meanwhile.",
    )


def older(place: str, found: int, known: int) -> StorageError:
    """Return the error for an archive that its owner must update."""
    return StorageError(
        "archive.older",
        f"{place}: the archive has version {found}, this program needs {known}.",
        "Whoever owns the database brings it up to date: ocmm archive set-up.",
    )


def foreign(place: str) -> StorageError:
    return StorageError(
        "archive.foreign",
        f"{place}: this is no archive of this program.",
        "Choose the file of an archive, or a file that is not there yet.",
    )


def sqlite_fault(place: str, error: sqlite3.Error) -> OcmmError:
    """Return the error of an archive for an error of SQLite."""
    code = int(getattr(error, "sqlite_errorcode", 0)) & 0xFF
    if code in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
        return StorageError(
            "archive.slow", f"{place}: another program is writing to it.", "It is tried again."
        )
    if code == sqlite3.SQLITE_FULL:
        return _full(place)
    if code in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM):
        return _rights(place, str(error))
    if code in (sqlite3.SQLITE_NOTADB,):
        return foreign(place)
    if code == sqlite3.SQLITE_CONSTRAINT:
        return _refused(str(error))
    return StorageError(
        "archive.failed",
        f"{place}: {_short(error)}.",
        "Check the disk; make the archive again from the job files: ocmm archive rebuild.",
    )


def postgresql_fault(place: str, error: Exception) -> OcmmError:
    """Return the error for one of psycopg by SQLSTATE (PostgreSQL, appendix A)."""
    state = getattr(error, "sqlstate", None) or ""
    said = _short(error)
    for prefix, make in _BY_STATE:
        if state.startswith(prefix):
            return make(place, said)
    if isinstance(error, UnicodeEncodeError) or state.startswith(("22", "23")) or "NUL" in said:
        return _refused(said)
    # A malformed response is no fault of the sent job, which waits.
    if not state and not isinstance(error, OSError) and not _is_of_connection(error):
        return not_understood(place, said or type(error).__name__)
    if any(word in said for word in ("not yet valid", "has expired")):
        return StorageError(
            "archive.tls",
            f"{place}: no trusted connection ({said}).",
            "Check the clock of this computer first, then the certificate of the server.",
        )
    if any(word in said for word in _NO_PROTOCOL):
        return not_understood(place, said)
    if "certificate" in said or "SSL" in said:
        return StorageError(
            "archive.tls",
            f"{place}: no trusted connection ({said}).",
            "Check the certificate of the server and sslrootcert; see docs/integrator/shop.md.",
        )
    # libpq gives no SQLSTATE for a refused connection, only the server's words.
    if any(word in said for word in ("fe_sendauth", "authentication", "no pg_hba.conf entry")):
        return _login(place, said)
    if "role " in said and "does not exist" in said:
        return _login(place, said)
    if "database " in said and "does not exist" in said:
        return _no_database(place, said)
    return StorageError(
        "archive.unreachable",
        f"{place}: the server is not reached ({said or 'no answer'}).",
        "Check network and server; jobs wait here and are sent by themselves.",
    )


def endless_answer(place: str, limit: int) -> OcmmError:
    """Return the error for an endless or too large answer."""
    return StorageError(
        "archive.too_large",
        f"{place}: the server answers with more than {limit / 1e9:.0f} GB at once.",
        "Ask for fewer rows. Where nothing was asked, check that this is the server of the "
        "archive.",
    )


def not_understood(place: str, why: str) -> StorageError:
    return StorageError(
        "archive.not_understood",
        f"{place}: the answer is none of an archive ({_short(why)}).",
        "Nothing of it is used. Check the address, then run ocmm archive verify.",
    )


def not_kept(place: str, job: str) -> StorageError:
    """Return the error for an acknowledged job that is missing."""
    return StorageError(
        "archive.not_kept",
        f"{place}: the server acknowledged job {job[:8]} and does not have it.",
        "Whoever owns the database looks for a trigger or rule that drops rows; the job waits.",
    )


def altered_rows(place: str, job: str, where: str) -> StorageError:
    """Return the error for an archive that stores altered rows."""
    return StorageError(
        "archive.changes",
        f"{place}: the server would store other values of job {job[:8]} than were sent ({where}).",
        "Whoever owns the database looks for a trigger or rule that changes rows; nothing of it "
        "was stored, and the job waits here.",
    )


def _short(text: object) -> str:
    """Return the beginning of a foreign text, in one line."""
    words = " ".join(str(text)[:2000].split())[:300]
    return "".join(c if c.isprintable() else "?" for c in words)


def _full(place: str, said: str = "") -> StorageError:
    return StorageError(
        "archive.full",
        f"{place}: the disk of the archive is full.",
        "Free disk space there; jobs wait here and are sent by themselves.",
    )


def slow(place: str, said: str) -> StorageError:
    return StorageError(
        "archive.slow",
        f"{place}: the server does not answer in time ({said}).",
        "It is tried again; if it stays so, look at the load of the server.",
    )


def _rights(place: str, said: str) -> StorageError:
    # A finding is no row of a station: that policy is about kinds.
    if "row-level security" in said and '"finding"' not in said:
        return StorageError(
            "archive.admitted",
            f"{place}: this login is not admitted as this station.",
            "Quality or the owner admits it: ocmm archive admit LOGIN STATION. The job waits here.",
        )
    return StorageError(
        "archive.rights",
        f"{place}: this user may not do that there ({said}).",
        "Use a login of the right role: ocmm archive roles.",
    )


def _login(place: str, said: str) -> StorageError:
    return StorageError(
        "archive.login",
        f"{place}: the server does not accept this login ({said}).",
        "Check user and password: setting archive.password, PGPASSFILE or PGPASSWORD.",
    )


def _no_database(place: str, said: str) -> StorageError:
    return StorageError(
        "archive.database", f"{place}: {said}.", "Check the name of the database in the address."
    )


def _read_only(place: str, said: str) -> StorageError:
    return StorageError(
        "archive.read_only",
        f"{place}: the server takes no writing now ({said}).",
        "It may be a standby: check the address.",
    )


def _other_version(place: str, said: str) -> StorageError:
    return StorageError(
        "archive.version",
        f"{place}: the tables are not those of this program ({said}).",
        "Whoever owns the database brings it up to date: ocmm archive set-up.",
    )


def _is_of_connection(error: Exception) -> bool:
    """Return whether psycopg reports a connection error, not one of the data."""
    return any(one.__name__ == "OperationalError" for one in type(error).__mro__)


_NO_PROTOCOL = (
    "synchronization", "unexpected response", "unexpected field", "invalid message",
    "insufficient data", "message contents", "extraneous data", "unknown oid", "DateStyle", "codec",
)  # fmt: skip
"""Words of libpq and psycopg for responses that no PostgreSQL server gives."""

_BY_STATE = (
    ("53100", _full),
    ("53", slow),
    ("57014", slow),
    ("55P03", slow),
    ("40", slow),
    ("42501", _rights),
    ("28", _login),
    ("3D000", _no_database),
    ("25006", _read_only),
    ("42", _other_version),
)


def _refused(said: str) -> InputError:
    return InputError(
        "archive.row",
        f"The archive cannot keep this: {said}.",
        "Keep the job file, and ask whoever looks after the archive.",
    )
