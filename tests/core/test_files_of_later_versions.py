"""Files of later versions are refused with a sentence, and stay as they are."""

from __future__ import annotations

import hashlib
import re
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from tests.commands import Ocmm
from tests.core.golden_station import RELEASES, copied_station


@pytest.fixture
def station(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    return copied_station(RELEASES[-1], tmp_path, monkeypatch)


def _newer_database(path: Path) -> None:
    with closing(sqlite3.connect(path)) as db:
        (version,) = db.execute("PRAGMA user_version").fetchone()
        db.execute(f"PRAGMA user_version = {version + 1}")


def _newer_document(path: Path) -> None:
    text = path.read_text("utf-8")
    later = re.sub(r"\bocmm\.([a-z-]+)/(\d+)", lambda one: f"ocmm.{one[1]}/{int(one[2]) + 1}", text)
    assert later != text
    path.write_text(later, "utf-8")


@pytest.mark.parametrize(
    ("file", "change", "words", "told"),
    [
        ("jobs/BALL-001.ocmm", _newer_database, "report jobs/BALL-001.ocmm --out r", "update this"),
        ("open/BALL-001.ocmm", _newer_database, "measure --continue open/BALL-001.ocmm",
         "update this"),
        ("archive.sqlite", _newer_database, "archive verify --archive archive.sqlite",
         "Install the newer program"),
        ("home/xdg_config_home/ocmm/settings.toml", _newer_document,
         "settings set window.theme dark", "Update OCMM"),
        ("ball.toml", _newer_document, "plan check ball.toml", "schema"),
        ("study.toml", _newer_document, "msa status study.toml jobs", "schema"),
    ],
    ids=lambda one: one if isinstance(one, str) else "",
)  # fmt: skip
def test_refuses_a_file_of_a_later_version(
    station: Path, ocmm_here: Ocmm, file: str, change: Callable[[Path], None], words: str, told: str
) -> None:
    change(station / file)
    before = hashlib.sha256((station / file).read_bytes()).digest()
    done = ocmm_here(*words.split())
    assert done.returncode == 2, (done.stdout, done.stderr)
    assert told in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
    assert hashlib.sha256((station / file).read_bytes()).digest() == before
