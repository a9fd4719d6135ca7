"""Paths of the memory of the station; quick to import, for a first look."""

from __future__ import annotations

import hashlib
from pathlib import Path

import platformdirs


def memory_folder() -> Path:
    return platformdirs.user_state_path("ocmm") / "histories"


def memory_file(name: str) -> Path:
    """Return the path of the memory of a thing, by its identity."""
    digest = hashlib.sha256(name.encode("utf-8", "surrogateescape")).hexdigest()[:32]
    return memory_folder() / f"{digest}.json"
