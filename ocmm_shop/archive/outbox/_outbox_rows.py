"""Tables of an outbox, its jobs, and the state of the connection."""

from __future__ import annotations

import contextlib
import hashlib
import uuid
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

APPLICATION_ID = 0x4F434F42  # "OCOB"
VERSION = 1

TABLES = (
    """CREATE TABLE box (id INTEGER PRIMARY KEY CHECK (id = 1), outbox TEXT NOT NULL,
        machine TEXT NOT NULL, made_utc TEXT NOT NULL)""",
    # AUTOINCREMENT: numbers are never reused, even if rows were removed.
    """CREATE TABLE item (sequence INTEGER PRIMARY KEY AUTOINCREMENT, sha256 TEXT NOT NULL,
        name TEXT NOT NULL, path TEXT NOT NULL, put_utc TEXT NOT NULL,
        state TEXT NOT NULL CHECK (state IN ('waiting', 'sent', 'aside')),
        said TEXT NOT NULL DEFAULT '', sent_utc TEXT NOT NULL DEFAULT '')""",
    "CREATE INDEX item_by_state ON item (state, sequence)",
    "CREATE INDEX item_by_path ON item (path, sequence)",
    """CREATE TABLE contact (id INTEGER PRIMARY KEY CHECK (id = 1), code TEXT NOT NULL,
        said TEXT NOT NULL, since_utc TEXT NOT NULL, good_utc TEXT NOT NULL,
        clock_off_s REAL NOT NULL)""",
    "INSERT INTO contact VALUES (1, '', '', '', '', 0.0)",
)


class ItemState(Enum):
    WAITING = "waiting"
    SENT = "sent"
    ASIDE = "aside"
    """Refused by the archive; kept and named."""


@dataclass(frozen=True, slots=True)
class Item:
    """A queued job."""

    sequence: int
    """From 1."""
    sha256: str
    name: str
    path: str
    """`sha256`, `name`, `path`: Of the file as queued; display name; place of the job file then."""
    put_utc: str
    state: ItemState
    said: str
    """`state`, `said`: State; why it was set aside."""


@dataclass(frozen=True, slots=True)
class ConnectionState:
    """State of the connection."""

    code: str = ""
    said: str = ""
    """`code`, `said`: Error of the last try; empty if it succeeded."""
    since_utc: str = ""
    """Start of the failures; empty if none."""
    good_utc: str = ""
    """Last success; empty if none."""
    clock_off_s: float = 0.0
    """Lead of the local clock over the archive's."""


def machine_identity() -> str:
    """Return the hashed identity of this computer's installation."""
    for place in ("/etc/machine-id", "/var/lib/dbus/machine-id"):
        with contextlib.suppress(OSError):
            text = Path(place).read_text("ascii", "replace").strip()
            if text:
                # The machine id itself must stay confidential (machine-id(5)).
                return hashlib.sha256(f"ocmm archive {text}".encode()).hexdigest()[:32]
    return hashlib.sha256(f"ocmm archive node {uuid.getnode()}".encode()).hexdigest()[:32]
