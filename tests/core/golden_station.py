"""Golden files, written by a station of each release (tests/golden)."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

GOLDEN = Path(__file__).parents[1] / "golden"
RELEASES = sorted(
    (one.name for one in GOLDEN.iterdir() if (one / "station").is_dir()),
    key=lambda name: tuple(map(int, name.split("."))),
)


def copied_station(
    release: str, folder: Path, monkeypatch: pytest.MonkeyPatch, station: str = "station"
) -> Path:
    """Return a copy of the station's files; its key, memory and settings are in force."""
    shutil.copytree(GOLDEN / release / station, folder, dirs_exist_ok=True)
    for home in (folder / "home").iterdir():
        monkeypatch.setenv(home.name.upper(), str(home))
    # Version control keeps no permissions; other users' keys are refused.
    (folder / "home/xdg_data_home/ocmm/keys/station.key").chmod(0o600)
    return folder
