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


def histories() -> Path:
    """Return the folder of this station's memory of all chains."""
    return Path(os.environ["XDG_STATE_HOME"]) / "ocmm" / "histories"


def forget_histories() -> None:
    """Clear this station's memory of all chains, without a report of missing memory."""
    shutil.rmtree(histories(), ignore_errors=True)
    if KeyFolder().own_public() is not None:
        start_memory(KeyFolder(), "test", "every test starts without memory", _NEVER)


@contextmanager
def other_station(folder: Path) -> Iterator[None]:
    """Let what runs meanwhile be the program of another station, whose user is at home there."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("XDG_DATA_HOME", "XDG_STATE_HOME"):
            patch.setenv(name, str(folder / name.lower()))
        yield
