"""What stands in an outbox: its tables, a job in it, and what the last tries came to."""

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
    # AUTOINCREMENT: a number is never used twice, also when rows were removed.
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
    """Where a job in the outbox stands."""

    WAITING = "waiting"
    SENT = "sent"
    ASIDE = "aside"
    """The archive cannot take it; it is kept and named."""


@dataclass(frozen=True, slots=True)
class Item:
    """One job in the outbox."""

    sequence: int
    """Its number, from 1."""
    sha256: str
    name: str
    path: str
    """`sha256`, `name`, `path`: Of its file as it was put in; its name for people; where the job
    file was then."""
    put_utc: str
    """When."""
    state: ItemState
    said: str
    """`state`, `said`: Where it stands; why it is set aside."""


@dataclass(frozen=True, slots=True)
class Contact:
    """What the last tries came to."""

    code: str = ""
    said: str = ""
    """`code`, `said`: The error of the last one; empty where it was good."""
    since_utc: str = ""
    """Since when there is no good one; empty where there is."""
    good_utc: str = ""
    """The last good one; empty for none."""
    clock_off_s: float = 0.0
    """How far the clock here is ahead of that of the archive."""


def machine_identity() -> str:
    """Return what tells this computer from others: that of its installation, as a hash."""
    for place in ("/etc/machine-id", "/var/lib/dbus/machine-id"):
        with contextlib.suppress(OSError):
            text = Path(place).read_text("ascii", "replace").strip()
            if text:
                # The number itself is not handed out (machine-id(5)).
                return hashlib.sha256(f"ocmm archive {text}".encode()).hexdigest()[:32]
    return hashlib.sha256(f"ocmm archive node {uuid.getnode()}".encode()).hexdigest()[:32]
