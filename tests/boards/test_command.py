"""`ocmm calibrate boards` from a table of corners to a calibration in force, as a user runs it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from ocmm_core.calibration.records import CalibrationStore
from tests.boards.board_scene import board_in, scene, table_of

CERTIFICATE = """
[certificate]
number = "B-2026-7"
sha256 = ""
due_utc = "2099-12-31T00:00:00+00:00"
"""


def _run(folder: Path, *more: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [
            sys.executable, "-m", "ocmm_cli", "calibrate", "boards", "*-cam0.png", "*-cam1.png",
            "--board", str(folder / "board.toml"), "--corners", str(folder / "corners.vnl"),
            "--calibrations", str(folder / "calibrations"), "--who", "tester", *more,
        ],
        capture_output=True, text=True, cwd=folder, check=False, timeout=240,
    )  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("boards")
    one = scene(made, 7)
    (made / "corners.vnl").write_text(table_of(one.views), encoding="utf-8")
    return made


def test_a_calibration_is_in_force_and_suspect(folder: Path) -> None:
    done = _run(folder, "--accept")
    assert done.returncode == 0, done.stderr
    assert "The scale is not traceable" in done.stdout
    assert "SUSPECT" in done.stdout
    store = CalibrationStore(folder / "calibrations" / "recommended")
    record = store.active()
    assert record is not None
    assert record.method == "boards"
    assert record.artefacts == ()
    (kept,) = (folder / "calibrations" / "recommended" / "sessions").glob("boards-*.json")
    views = json.loads(kept.read_text(encoding="utf-8"))
    assert len(views["views"]) == 40
    assert views["who"] == "tester"


def test_a_certificate_makes_it_traceable(folder: Path, tmp_path: Path) -> None:
    board = board_in(tmp_path)
    board.write_text(board.read_text(encoding="utf-8") + CERTIFICATE, encoding="utf-8")
    (tmp_path / "corners.vnl").write_bytes((folder / "corners.vnl").read_bytes())
    done = _run(tmp_path, "--accept")
    assert done.returncode == 0, done.stderr
    assert "not traceable" not in done.stdout
    record = CalibrationStore(tmp_path / "calibrations" / "recommended").active()
    assert record is not None
    assert [one.certificate for one in record.artefacts] == ["B-2026-7"]


def test_an_expired_certificate_is_refused(folder: Path, tmp_path: Path) -> None:
    board = board_in(tmp_path)
    expired = CERTIFICATE.replace("2099", "2020")
    board.write_text(board.read_text(encoding="utf-8") + expired, encoding="utf-8")
    (tmp_path / "corners.vnl").write_bytes((folder / "corners.vnl").read_bytes())
    done = _run(tmp_path, "--accept")
    assert done.returncode == 2
    assert "expired on 2020-12-31" in done.stderr
    assert CalibrationStore(tmp_path / "calibrations" / "recommended").active() is None


def test_without_a_decision_nothing_changes(folder: Path, tmp_path: Path) -> None:
    board_in(tmp_path)
    (tmp_path / "corners.vnl").write_bytes((folder / "corners.vnl").read_bytes())
    done = _run(tmp_path)
    assert done.returncode == 1
    assert "give --accept" in done.stdout
    assert CalibrationStore(tmp_path / "calibrations" / "recommended").active() is None


def test_neither_corners_nor_pictures(folder: Path) -> None:
    done = _run(folder, "--pictures", str(folder))
    assert done.returncode == 2
    assert "Neither or both" in done.stderr
    assert "Traceback" not in done.stderr
