"""What this station remembers of chains, apart from the files that hold them.

A chain that is cut at its end, or replaced as a whole by an older copy of itself, is whole: nothing
in it says that something is missing, and its signature is a good one. So how far each chain went,
and when it was last looked at, is kept among the state of this user. It only ever goes on: an
older state is recognised by it. Another computer or user has no such memory, and where it is lost
nothing is known; a line on paper with the head of a chain (`Head`) does the same for anybody.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from pathlib import Path

import msgspec
import platformdirs

from ocmm_core.leftovers import temporary_file
from ocmm_core.side_files import SIDE_FILES, Trusted, read_guarded

_LARGEST = SIDE_FILES[Trusted.MEMORY][0].most


class Seen(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How far a chain went when this station saw it last."""

    name: str
    """Which chain: its folder, or an identity of its own."""
    count: int
    link: str
    """`count`, `link`: Lines, and the hash of the last one."""
    utc: str = ""
    """The latest moment at which somebody looked at it, ISO 8601 text; empty where none is known.
    """
    place: str = ""
    """Where it was last."""


def recall(name: str) -> Seen | None:
    """Return how far a chain went; None where nobody knows."""
    try:
        seen = msgspec.json.decode(read_guarded(_path(name), _LARGEST, follow=False), type=Seen)
    except (OSError, msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return None
    return seen if seen.name == name else None


def remember(seen: Seen) -> None:
    """Keep how far a chain goes; where it cannot be kept it is not known later.

    It is not waited for on the disk: after a power cut the memory may be some lines behind, never
    ahead, because the chain is on the disk before.
    """
    if recall(seen.name) == seen:
        return
    path = _path(seen.name)
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor, temporary = temporary_file(path)
        try:
            os.write(descriptor, msgspec.json.encode(seen))
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
            os.close(descriptor)


def memory_folder() -> Path:
    """Return where it is kept."""
    return platformdirs.user_state_path("ocmm") / "histories"


def _path(name: str) -> Path:
    digest = hashlib.sha256(name.encode("utf-8", "surrogateescape")).hexdigest()[:32]
    return memory_folder() / f"{digest}.json"
