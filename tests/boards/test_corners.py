"""Tables of corners: each picture to its camera and view, or a sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ocmm_boards import load_board, read_corners
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from tests.boards.board_scene import board_in, scene, table_of

PATTERNS = ("*-cam0.png", "*-cam1.png")
CAMERAS = load_rig(resource("rigs", "recommended.toml")).cameras
NINE = "\n".join(f"a-cam0.png {x} {y} 0" for y in (1, 2, 3) for x in (1, 2, 3))


def test_a_table_is_read_as_it_was_written(tmp_path: Path) -> None:
    views = scene(tmp_path, 1, views=10).views
    path = tmp_path / "corners.vnl"
    path.write_text(table_of(views), encoding="utf-8")
    read = read_corners(path, PATTERNS, CAMERAS, views.uv.shape[2])
    assert read.names == views.names
    np.testing.assert_allclose(read.uv, views.uv, atol=6e-5)


def test_levels_and_missing_corners(tmp_path: Path) -> None:
    path = tmp_path / "corners.vnl"
    lines = NINE.splitlines()
    lines[1], lines[2] = "a-cam0.png 2 1 2", "a-cam0.png - - -"
    lines[3] = "a-cam0.png 1 2 -1"
    content = ["## made by hand", "# filename x y level", *lines, "a-cam1.png - - -", "b.png 1 1 0"]
    path.write_text("\n".join(content), encoding="utf-8")
    read = read_corners(path, PATTERNS, CAMERAS, 9)
    assert read.levels[0, 0].tolist() == [0, 2, 0, 0, 0, 0, 0, 0, 0]
    assert read.seen[0, 0].tolist() == [True, True, False, False, *[True] * 5]
    assert not read.seen[0, 1].any()
    (said,) = read.left_out
    assert "1 picture of no camera" in said
    assert "b.png" in said


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("", "there are no corners"),
        ("# name x y level\n" + NINE, "line 2: the columns 'name x y level'"),
        (NINE, "line 1: the columns ''"),
        ("# filename x y level\n" + NINE.replace("3 3 0", "3 0"), "line 10: 2 numbers where 3"),
        ("# filename x y level\n" + NINE.replace("2 2 0", "2 nan 0"), "line 6: '2 nan 0' is no"),
        ("# filename x y level\n" + NINE.replace("2 2 0", "2 2,5 0"), "line 6: '2 2,5 0' is no"),
        ("# filename x y level\n" + NINE.replace("2 2 0", "2 2 99"), "line 6: '2 2 99' is no"),
        ("# filename x y level\n" + NINE.replace("3 3 0", "3 9999 0"), "outside the 2048 x 2048"),
        ("# filename x y level\n" + NINE + "\na-cam0.png 1 1 0", "has 10 corners, and the board"),
        ("# filename x y level\n" + NINE.replace("cam0", "eye"), "none of its 1 pictures"),
    ],
)
def test_a_wrong_table_gets_a_sentence(tmp_path: Path, text: str, what: str) -> None:
    path = tmp_path / "corners.vnl"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_corners(path, PATTERNS, CAMERAS, 9)
    assert str(path) in refused.value.what
    assert what in refused.value.what
    assert refused.value.remedy


@pytest.mark.parametrize("patterns", [("*-cam0.png",), ("cam0.png", "*1.png"), ("**0", "*1")])
def test_patterns_tell_the_cameras(tmp_path: Path, patterns: tuple[str, ...]) -> None:
    path = tmp_path / "corners.vnl"
    path.write_text("# filename x y level\n" + NINE, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_corners(path, patterns, CAMERAS, 9)
    assert refused.value.code == "boards.patterns"


def test_a_picture_of_two_cameras_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "corners.vnl"
    path.write_text("# filename x y level\n" + NINE, encoding="utf-8")
    with pytest.raises(InputError, match="matches the patterns of two cameras"):
        read_corners(path, ("*.png", "a-*.png"), CAMERAS, 9)


def test_a_board_grows_with_the_temperature(tmp_path: Path) -> None:
    path = board_in(tmp_path)
    cold, warm = load_board(path), load_board(path, Temperature(30.0, 0.05, "stated"))
    length = np.linalg.norm(np.ptp(warm.corners, axis=0)) / np.linalg.norm(
        np.ptp(cold.corners, axis=0)
    )
    assert length - 1.0 == pytest.approx(8.5e-5, rel=1e-6)
    # An unknown temperature widens U.
    assert cold.scale_sigma > warm.scale_sigma


def test_the_template_is_a_board_without_traceable_scale() -> None:
    board = load_board(resource("artefacts", "board.toml"))
    assert board.corners.shape == (88, 3)
    assert not board.traceable


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("columns = 11", "columns = 2", "columns"),
        ("rows = 8", "rows = 61", "rows"),
        ("rows = 8", "rows = 50", "rows"),
        ("pitch = 30.0", "pitch = 0.0", "pitch"),
        ("pitch = 30.0", "pitch = -30.0", "pitch"),
        ("corner_sigma = 0.005", "corner_sigma = 0.0", "corner_sigma"),
        ("flatness = 0.2", "flatness = 900.0", "flatness"),
        ('pattern = "chessboard"', 'pattern = "charuco"', "marker"),
        ("expanded = 0.002", "expanded = -0.002", "expanded"),
    ],
)
def test_a_wrong_document_names_its_field(tmp_path: Path, old: str, new: str, field: str) -> None:
    path = board_in(tmp_path)
    path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        load_board(path)
    assert f"'{field}'" in refused.value.what
    assert str(path) in refused.value.what
