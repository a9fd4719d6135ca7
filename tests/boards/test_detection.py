"""Corners in rendered pictures: place and order, in both cameras."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import cv2 as opencv
import numpy as np
import pytest

from ocmm_boards import Board, detect_corners, load_board
from ocmm_core.camera import CameraModel, ideal_from_pixels, load_rig, project
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, rotation_from_vector
from tests.boards.board_scene import board_in

cv2: Any = opencv
WIDTH, HEIGHT = 800, 700
PATTERNS = ("*_left.png", "*_right.png")
_PX_PER_MM = 4
FACING = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""The board upright, seen by cameras that look along y."""


def wide_cameras() -> tuple[CameraModel, ...]:
    rig = load_rig(resource("rigs", "recommended.toml"))
    return tuple(
        replace(
            camera, width=WIDTH, height=HEIGHT, pitch_mm=0.0307, u0=WIDTH / 2, v0=HEIGHT / 2,
        )
        for camera in rig.cameras
    )  # fmt: skip


def _print_of(board: Board) -> tuple[Any, Float]:
    """Return the board as printed, and the place (2,) of its first corner there, px."""
    document = board.document
    square = round(document.pitch * _PX_PER_MM)
    if document.pattern == "charuco":
        grid = cv2.aruco.CharucoBoard(
            (document.columns + 1, document.rows + 1), document.pitch, document.marker,
            cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, document.dictionary)),
        )  # fmt: skip
        size = ((document.columns + 1) * square, (document.rows + 1) * square)
        picture = grid.generateImage(size)
    elif document.pattern == "dots":
        picture = _dots(board, square)
        return picture, np.full(2, 2.0 * square)
    elif document.pattern == "apriltag":
        picture = _markers(board, square, from_the_bottom=document.border == 2)
        return picture, np.full(2, float(square) - 0.5)
    else:
        rows, columns = np.indices((document.rows + 1, document.columns + 1))
        # Black behind the first corner, and in every other square.
        picture = np.where((rows + columns) % 2 == 0, 0, 255).astype(np.uint8)
        picture = np.kron(picture, np.ones((square, square), dtype=np.uint8))
    margin = square
    return cv2.copyMakeBorder(
        picture, margin, margin, margin, margin, cv2.BORDER_CONSTANT, value=255
    ), np.full(2, margin + square - 0.5)


def _dots(board: Board, square: int) -> Any:
    document = board.document
    size = np.ptp(board.corners[:, :2], axis=0) * _PX_PER_MM + 4 * square
    picture = np.full(size.astype(int)[::-1], 255, dtype=np.uint8)
    for x, y in (board.corners - board.corners[0])[:, :2] * _PX_PER_MM + 2 * square:
        radius = round(document.dot * _PX_PER_MM * 8)
        cv2.circle(picture, (round(x * 16), round(y * 16)), radius, 0, -1, cv2.LINE_AA, 4)
    return picture


def _markers(board: Board, square: int, *, from_the_bottom: bool) -> Any:
    """Return printed markers; numbered from the bottom they are also turned, as by Kalibr."""
    document = board.document
    code = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, document.dictionary))
    side = round(document.marker * _PX_PER_MM)
    height, width = (n * square + square for n in (document.rows, document.columns))
    picture = np.full((height + square, width + square), 255, dtype=np.uint8)
    for row, column in np.ndindex(document.rows, document.columns):
        number = (document.rows - 1 - row if from_the_bottom else row) * document.columns + column
        marker = cv2.aruco.generateImageMarker(code, number, side, None, document.border)
        y, x = square + row * square, square + column * square
        picture[y : y + side, x : x + side] = np.rot90(marker, 2 if from_the_bottom else 0)
    return picture


@cache
def _rays_of(name: str) -> Float:
    """Return the rays (n, 3) of all pixels of one of `wide_cameras`, in the world."""
    camera = next(one for one in wide_cameras() if one.name == name)
    v, u = np.indices((HEIGHT, WIDTH))
    ideal = ideal_from_pixels(camera, np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float64))
    rotation = camera.T_camera_from_world.rotation
    rays: Float = np.column_stack([ideal, np.full(len(ideal), camera.focal)]) @ rotation
    return rays


def picture_of(camera: CameraModel, board: Board, rotation: Float, at: Float) -> Any:
    """Return the picture by one of `wide_cameras` of a board at ``at``, turned."""
    printed, first = _print_of(board)
    rays = _rays_of(camera.name)
    centre = camera.centre_world
    normal = rotation[:, 2]
    along = ((at - centre) @ normal) / (rays @ normal)
    on_board = (centre + along[:, None] * rays - at) @ rotation
    place = first + (on_board[:, :2] - board.corners[0, :2]) * _PX_PER_MM
    # Blurred by somewhat more than a pixel before it is sampled.
    return cv2.remap(
        cv2.GaussianBlur(printed, (0, 0), 5.0),
        *place.T.reshape(2, HEIGHT, WIDTH).astype(np.float32),
        cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=255,
    )  # fmt: skip


def _written(folder: Path, board: Board) -> tuple[list[Float], tuple[CameraModel, ...]]:
    """Write two views; return their true corners, (C, N, 2) each, and the cameras."""
    cameras, true = wide_cameras(), []
    for number, turn in enumerate(([-0.3, 0.1, 3.0], [0.1, -0.35, 1.4])):
        rotation, at = FACING @ rotation_from_vector(np.array(turn)), np.array([0.0, 20.0, 0.0])
        corners = board.corners @ rotation.T + at
        true.append(np.stack([project(camera, corners) for camera in cameras]))
        for camera in cameras:
            picture = picture_of(camera, board, rotation, at)
            cv2.imwrite(str(folder / f"{number}_{camera.name}.png"), picture)
    return true, cameras


_TAGS = 'dictionary = "DICT_APRILTAG_36h11"\nmarker = 46.0\n'


@pytest.mark.parametrize(
    ("pattern", "more"),
    [
        ("chessboard", ""),
        ("charuco", 'dictionary = "DICT_4X4_50"\nmarker = 36.0\n'),
        ("apriltag", _TAGS),
        ("apriltag", f"{_TAGS}border = 2\n"),
        ("dots", "dot = 12.0\n"),
    ],
)
def test_corners_are_found(tmp_path: Path, pattern: str, more: str) -> None:
    """Nine in ten within 0.25 px, turned any way; single ones are off, as the bundle expects.

    Corners of markers are where two fitted edges meet, and less sharp in a blurred picture.
    """
    size = {"dots": (8, 13, 20.0), "apriltag": (6, 4, 56.0)}.get(pattern, (8, 5, 48.0))
    path = board_in(tmp_path, pattern=pattern, columns=size[0], rows=size[1], pitch=size[2])
    path.write_text(path.read_text(encoding="utf-8") + more, encoding="utf-8")
    board = load_board(path)
    true, cameras = _written(tmp_path, board)
    cv2.imwrite(str(tmp_path / "9_left.png"), np.full((HEIGHT, WIDTH), 128, dtype=np.uint8))
    found = detect_corners(tmp_path, PATTERNS, cameras, board)
    assert found.names == ("0", "1", "9")
    for view, corners in enumerate(true):
        off = np.linalg.norm(found.uv[view] - corners, axis=2)
        assert np.nanpercentile(off, 90.0) < (0.35 if pattern == "apriltag" else 0.25), view
        assert np.isfinite(off).mean() > 0.85, view
    (said,) = found.left_out
    assert "1 of 5 pictures show no whole board" in said
    assert "9_left.png" in said


def test_a_board_whose_ends_look_alike_is_refused(tmp_path: Path) -> None:
    board = load_board(board_in(tmp_path, columns=8, rows=6))
    with pytest.raises(InputError, match="looks the same upside down"):
        detect_corners(tmp_path, PATTERNS, wide_cameras(), board)


@pytest.mark.parametrize(
    ("content", "why"),
    [(b"", "it is no picture"), (b"P5 4 4 255\n" + bytes(16), "it has 4 x 4 pixels")],
)
def test_what_is_no_picture_of_the_camera_is_refused(
    tmp_path: Path, content: bytes, why: str
) -> None:
    board = load_board(board_in(tmp_path, columns=8, rows=5))
    (tmp_path / "0_left.pgm").write_bytes(content)
    with pytest.raises(InputError) as refused:
        detect_corners(tmp_path, ("*_left.pgm", "*_right.pgm"), wide_cameras(), board)
    assert str(tmp_path / "0_left.pgm") in refused.value.what
    assert why in refused.value.what


def test_no_picture_and_no_board(tmp_path: Path) -> None:
    board = load_board(board_in(tmp_path, columns=8, rows=5))
    with pytest.raises(InputError, match="none of its 0 pictures"):
        detect_corners(tmp_path, PATTERNS, wide_cameras(), board)
    cv2.imwrite(str(tmp_path / "0_left.png"), np.full((HEIGHT, WIDTH), 128, dtype=np.uint8))
    with pytest.raises(InputError, match="no picture shows the whole board"):
        detect_corners(tmp_path, PATTERNS, wide_cameras(), board)
    with pytest.raises(InputError, match="none of its 0 pictures"):
        detect_corners(tmp_path / "nowhere", PATTERNS, wide_cameras(), board)
