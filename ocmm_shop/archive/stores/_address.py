"""Address of an archive, a file or a server, and the source of its password.

Passwords are not in the settings: a private file, PGPASSFILE, ~/.pgpass or the environment.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import parse_qsl, unquote, urlsplit

from ocmm_core.errors import InputError, StorageError
from ocmm_core.host import HOST, is_loopback
from ocmm_core.side_files import open_guarded

_SCHEMES = ("postgresql", "postgres")
_OPTIONS = (
    "host", "port", "dbname", "user", "sslmode", "sslrootcert", "sslcert", "sslkey", "sslcrl",
    "ssl_min_protocol_version", "target_session_attrs",
)  # fmt: skip
"""Options of libpq that an address may use; others could name files or programs."""

_MODES = ("verify-full", "verify-ca", "require", "disable")
_LARGEST_PASSWORD = 4096


@dataclass(frozen=True, slots=True)
class PostgresAddress:
    options: dict[str, str]
    password_file: Path | None = None
    """None: libpq searches it."""
    connect_s: int = 5
    limit_ms: int = 30_000
    """`connect_s`, `limit_ms`: Time limits of a connection and of a statement."""
    _password: str = field(default="", repr=False)

    @property
    def shown(self) -> str:
        where = self.options.get("host", "local socket")
        port = f":{self.options['port']}" if "port" in self.options else ""
        return f"postgresql://{where}{port}/{self.options.get('dbname', '')}"

    @property
    def is_network(self) -> bool:
        hosts = filter(None, self.options.get("host", "").split(","))
        return any(not one.startswith(("/", "@")) and not is_loopback(one) for one in hosts)

    @property
    def is_open(self) -> bool:
        """Return whether traffic is explicitly unencrypted."""
        return self.is_network and self.options.get("sslmode") == "disable"

    def parameters(self) -> dict[str, str | int]:
        """Return the parameters for libpq; errors as `read_password`."""
        found: dict[str, str | int] = {**self.options, "connect_timeout": self.connect_s}
        # A silently broken link is detected within half a minute.
        found |= {"keepalives_idle": 10, "keepalives_interval": 5, "keepalives_count": 3}
        found["tcp_user_timeout"] = self.limit_ms
        if self.password_file is not None:
            found["password"] = read_password(self.password_file)
        return found


def is_server(text: str) -> bool:
    return text.split(":", 1)[0] in _SCHEMES and "://" in text


def check_address(text: str) -> None:
    """Raise InputError if an address cannot be used, or contains a password."""
    if is_server(text):
        parse_server(text)
    elif "://" in text:
        raise _wrong(text, "is no address of a server")


def parse_server(text: str, password_file: Path | None = None) -> PostgresAddress:
    """Return the address of a server; InputError: invalid, password, or unencrypted network."""
    try:
        parts = urlsplit(text)
        port = parts.port
        query = parse_qsl(parts.query, strict_parsing=bool(parts.query))
    except ValueError as error:
        raise _wrong(text, f"cannot be read ({error})") from None
    if parts.password is not None or any(name in ("password", "passfile") for name, _ in query):
        raise InputError(
            "archive.password",
            "The address of the archive holds a password, and others can read the settings.",
            "Leave it out. Put it into a file of your own with mode 0600 (setting "
            "archive.password), into PGPASSFILE or PGPASSWORD.",
        )
    options: dict[str, str] = {}
    for name, value in query:
        if name not in _OPTIONS or name in options:
            raise _wrong(
                text, f"has the option {name!r}, which is not one of {', '.join(_OPTIONS)}"
            )
        options[name] = value
    if parts.hostname and "host" in options:
        raise _wrong(text, "names two servers")
    if parts.hostname:
        options["host"] = unquote(parts.hostname)
    if port is not None:
        options["port"] = str(port)
    if parts.username:
        options["user"] = unquote(parts.username)
    database = unquote(parts.path.lstrip("/"))
    if database:
        options["dbname"] = database
    if not options.get("dbname"):
        raise _wrong(text, "names no database")
    if any(not value.isprintable() for value in options.values()):
        raise _wrong(text, "has characters that cannot be shown")
    address = PostgresAddress(options, password_file)
    if address.is_network:
        mode = options.setdefault("sslmode", "verify-full")
        if mode not in _MODES:
            raise _wrong(
                text,
                f"has sslmode={mode}, which may send jobs in the clear without saying so; use one "
                f"of {', '.join(_MODES)}",
            )
        if mode.startswith("verify"):
            options.setdefault("sslrootcert", "system")
    return address


def read_password(path: Path) -> str:
    """Return the password in a private file; StorageError if missing, foreign or open."""
    try:
        descriptor = open_guarded(path, follow=False)
        try:
            state = os.fstat(descriptor)
            if not HOST.is_own(state):
                raise _password(path, "belongs to somebody else", "Name a file of your own.")
            if HOST.is_open_to(state, 0o077):
                raise _password(path, "can be read by others", f"Run: chmod 600 {path}")
            text = os.read(descriptor, _LARGEST_PASSWORD + 1).decode("utf-8")
        finally:
            os.close(descriptor)
    except OSError as error:
        raise _password(
            path, f"cannot be read ({error.strerror})", "Check setting archive.password."
        ) from error
    except UnicodeDecodeError:
        raise _password(path, "is no text", "Write the password alone into it.") from None
    found = text.rstrip("\r\n")
    if not found or len(text) > _LARGEST_PASSWORD or not found.isprintable():
        raise _password(path, "holds no password of one line", "Write the password alone into it.")
    return found


def _wrong(text: str, why: str) -> InputError:
    # The text before an @ may be a password.
    shown = text.rpartition("@")[2][:200]
    return InputError(
        "archive.address",
        f"The address of the archive '{shown}' {why}.",
        "Write it like postgresql://USER@SERVER:5432/ocmm, or the path of a file.",
    )


def _password(path: Path, why: str, remedy: str) -> StorageError:
    return StorageError("archive.password_file", f"{path}: the password file {why}.", remedy)
