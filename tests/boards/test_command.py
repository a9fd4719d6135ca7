"""`ocmm calibrate boards` and `bundle`, from corners and recordings to a calibration in force."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.calibration.guided import random_lines
from ocmm_core.calibration.records import CalibrationStore
from ocmm_core.documents import resource
from tests.boards.board_scene import (
    board_in,
    recorded,
    scene,
    seen_by,
    table_of,
    truth,
    write_recording,
)  # fmt: skip

CERTIFICATE = """
[certificate]
number = "B-2026-7"
sha256 = ""
due_utc = "2099-12-31T00:00:00+00:00"
"""


def _run(folder: Path, *more: str) -> subprocess.CompletedProcess[str]:
    corners = ("--corners", str(folder / "corners.vnl"))
    return _calibrate(folder, "boards", "*-cam0.png", "*-cam1.png", *corners, *more)


def _calibrate(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [
            sys.executable, "-m", "ocmm_cli", "calibrate", *words,
            "--board", str(folder / "board.toml"),
            "--calibrations", str(folder / "calibrations"), "--who", "tester",
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


def test_a_bar_makes_it_traceable_without_new_pictures(tmp_path: Path) -> None:
    """Corners that were kept, raw frames of the waved probe, and of the bar at rest."""
    one = scene(tmp_path, 7, expanded=0.05, small=True)
    (tmp_path / "corners.vnl").write_text(table_of(one.views), encoding="utf-8")
    board = _run(tmp_path, "--keep", "--overrule", "few corners are enough to label LEDs")
    assert "The scale is not traceable" in board.stdout
    (kept,) = (tmp_path / "calibrations" / "recommended" / "sessions").glob("boards-*.json")

    spots = recorded(one, 7, poses=40, true=truth(7), placements=0)
    write_recording(tmp_path / "sweep.rec", one.true, spots.observed.frames.uv, 64, 7)
    ends = random_lines(one.true.volume_world, 400.0, 6, 7)
    shown = seen_by(one.true.cameras, ends, np.random.default_rng(7))
    write_recording(tmp_path / "bar.rec", one.true, shown, 320, 8)
    bar = resource("artefacts", "bar.toml")
    recordings = ("--sweep", "sweep.rec", "--placements", "bar.rec", "--bar", str(bar))
    done = _calibrate(
        tmp_path, "bundle", str(kept), *recordings, "--temperature", "20", "--temperature-u", "0.2",
        "--accept", "--overrule", "few corners are enough to label LEDs",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "not traceable" not in done.stdout
    record = CalibrationStore(tmp_path / "calibrations" / "recommended").active()
    assert record is not None
    assert [artefact.serial for artefact in record.artefacts] == ["B-400-1"]
    *_, session = sorted((tmp_path / "calibrations" / "recommended" / "sessions").glob("boards-*"))
    written = json.loads(session.read_text(encoding="utf-8"))["recorded"]
    assert len(written["frames"]["uv"]) == 40
    assert len(written["shown_bars"][0]["uv"]) == 6


def test_a_bundle_of_another_file_is_refused(folder: Path) -> None:
    done = _calibrate(folder, "bundle", "corners.vnl", "--sweep", "nothing.rec")
    assert done.returncode == 2
    assert "does not contain corners of this board" in done.stderr
    assert "Traceback" not in done.stderr
