"""Another station on this computer: a separate key and memory."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

import pytest

from ocmm_core.seals import KeyFolder, start_memory

_NEVER = datetime(9999, 1, 1, tzinfo=UTC)
_forgotten: list[tuple[str, int, int, int]] = []
"""Key and memory as `forget_histories` left them."""


def histories() -> Path:
    """Return the folder of this station's memory of all chains."""
    return Path(os.environ["XDG_STATE_HOME"]) / "ocmm" / "histories"


def forget_histories() -> None:
    """Clear this station's memory of all chains, without a report of missing memory."""
    # Signing takes most of a millisecond; most tests change neither.
    if _forgotten and _key_and_memory() == _forgotten:
        return
    shutil.rmtree(histories(), ignore_errors=True)
    if KeyFolder().own_public() is not None:
        start_memory(KeyFolder(), "test", "every test starts without memory", _NEVER)
    _forgotten[:] = _key_and_memory()


def _key_and_memory() -> list[tuple[str, int, int, int]]:
    """Return each file of key and memory, with inode, size and time of its last change."""
    found = []
    for top in (KeyFolder().folder, histories()):
        for folder, _, names in os.walk(top):
            for path in (folder, *(f"{folder}/{name}" for name in names)):
                state = os.lstat(path)
                found.append((path, state.st_ino, state.st_size, state.st_ctime_ns))
    return found


@contextmanager
def other_station(folder: Path) -> Iterator[None]:
    """Let what runs meanwhile be the program of another station, whose user is at home there."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("XDG_DATA_HOME", "XDG_STATE_HOME"):
            patch.setenv(name, str(folder / name.lower()))
        yield
