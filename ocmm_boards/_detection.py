"""Corners of a board in pictures, by OpenCV (extra `boards`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ocmm_boards._board import Board, BoardDocument
from ocmm_boards._corners import BoardViews, view_patterns
from ocmm_core.camera import CameraModel
from ocmm_core.documents import files_of_folder
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Pixels
from ocmm_core.side_files import OversizeError, read_guarded

MOST_BYTES = 256 << 20
_SUFFIXES = (".png", ".pgm", ".tif", ".tiff", ".bmp", ".jpg", ".jpeg")


def detect_corners(
    folder: Path, patterns: Sequence[str], cameras: Sequence[CameraModel], board: Board,
    tell: Callable[[int, int], None] = lambda done, of: None,
) -> BoardViews:  # fmt: skip
    """Return the views in the pictures of a folder; pictures without a whole board are left out.

    InputError: no OpenCV, a board whose ends look alike, no matching picture, a file of another
    kind or size, or no board in any.
    """
    opencv = _opencv()
    document = board.document
    find = _finder(opencv, document)
    expressions = view_patterns(patterns, cameras)
    found: dict[str, dict[int, Path]] = {}
    files = [one for one in files_of_folder(folder, "") if one.suffix.lower() in _SUFFIXES]
    for path in files:
        for camera, expression in enumerate(expressions):
            if match := expression.fullmatch(path.name):
                found.setdefault(match.group(1), {})[camera] = path
    if not found:
        raise InputError(
            "boards.no_picture",
            f"{folder}: none of its {len(files)} pictures matches the patterns of the cameras.",
            f"Give patterns for names such as {files[0].name!r}." if files else "Check the folder.",
        )
    names = tuple(sorted(found))
    uv = np.full((len(names), len(cameras), len(board.corners), 2), np.nan)
    total, done, without = sum(map(len, found.values())), 0, []
    for view, name in enumerate(names):
        for camera, path in found[name].items():
            corners = find(_picture(opencv, path, cameras[camera]))
            if corners is None:
                without.append(path.name)
            else:
                uv[view, camera] = corners
            done += 1
            tell(done, total)
    if len(without) == total:
        raise InputError(
            "boards.not_found",
            f"{folder}: no picture shows the whole board '{document.name}' "
            f"({document.columns} x {document.rows} corners).",
            "Check pattern, columns and rows of its document, focus and light.",
        )
    said: tuple[str, ...] = ()
    if without:
        said = (
            f"{folder}: {len(without)} of {total} pictures show no whole board and were left out, "
            f"such as {without[0]}.",
        )
    return BoardViews(names, uv, np.zeros(uv.shape[:3], dtype=np.int64), said)


def corner_finder(board: Board) -> Callable[[Any], int]:
    """Return what counts the corners of a board in a picture of 16 bits; InputError as above."""
    find = _finder(_opencv(), board.document)

    def count(picture: Any) -> int:
        corners = find((picture >> 8).astype(np.uint8))
        return 0 if corners is None else int(np.isfinite(corners[:, 0]).sum())

    return count


def _opencv() -> Any:
    try:
        import cv2
    except ImportError as error:
        raise InputError(
            "boards.opencv",
            "Corners in pictures are found by OpenCV, which is not installed.",
            "Run ./run setup --boards or pip install 'ocmm[boards]', or give a table of corners.",
        ) from error
    return cv2


def _picture(opencv: Any, path: Path, camera: CameraModel) -> Any:
    try:
        content = np.frombuffer(read_guarded(path, MOST_BYTES), dtype=np.uint8)
    except OversizeError as error:
        raise _wrong(path, f"it is larger than {MOST_BYTES >> 20} MB") from error
    except OSError as error:
        raise _wrong(path, str(error.strerror or error)) from error
    picture = opencv.imdecode(content, opencv.IMREAD_GRAYSCALE) if len(content) else None
    if picture is None:
        raise _wrong(path, "it is no picture")
    if picture.shape != (camera.height, camera.width):
        height, width = picture.shape
        raise _wrong(
            path,
            f"it has {width} x {height} pixels, and camera '{camera.name}' has {camera.width} x "
            f"{camera.height}",
        )
    return picture


def _wrong(path: Path, why: str) -> InputError:
    return InputError(
        "boards.picture",
        f"{path}: the picture cannot be used: {why}.",
        "Give uncropped, unscaled pictures of this camera.",
    )


def _finder(opencv: Any, document: BoardDocument) -> Callable[[Any], Pixels | None]:
    size = (document.columns, document.rows)
    if document.pattern == "charuco":
        aruco = opencv.aruco
        code = getattr(aruco, document.dictionary, None)
        if not isinstance(code, int) or not document.dictionary.startswith("DICT_"):
            raise InputError(
                "boards.dictionary",
                f"OpenCV has no dictionary {document.dictionary!r}.",
                "Give the name under which the board was made, such as DICT_4X4_100.",
            )
        grid = aruco.CharucoBoard(
            (document.columns + 1, document.rows + 1), document.pitch, document.marker,
            aruco.getPredefinedDictionary(code),
        )  # fmt: skip
        detector = aruco.CharucoDetector(grid)

        def by_markers(picture: Any) -> Pixels | None:
            corners, ids, _, _ = detector.detectBoard(picture)
            if ids is None or not len(ids):
                return None
            whole = np.full((size[0] * size[1], 2), np.nan)
            whole[np.ravel(ids)] = np.reshape(corners, (-1, 2))
            return whole

        return by_markers
    if sum(size) % 2 == 0:
        raise InputError(
            "boards.symmetric",
            f"A chessboard of {size[0]} x {size[1]} corners looks the same upside down.",
            "Use one whose columns and rows add up to an odd number, or a ChArUco board.",
        )

    def by_squares(picture: Any) -> Pixels | None:
        flags = opencv.CALIB_CB_ACCURACY | opencv.CALIB_CB_NORMALIZE_IMAGE
        found, corners = opencv.findChessboardCornersSB(picture, size, flags=flags)
        if not found:
            return None
        whole: Pixels = np.reshape(corners, (-1, 2)).astype(np.float64)
        # The square at the first corner is black; else the board was read from its other end.
        return whole if _first_is_black(picture, whole, size) else whole[::-1]

    return by_squares


def _first_is_black(picture: Any, corners: Pixels, size: tuple[int, int]) -> bool:
    """Return whether the square between the first two columns and rows is darker."""
    grid: Float = corners.reshape(size[1], size[0], 2)
    middles = 0.25 * (grid[1:, 1:] + grid[1:, :-1] + grid[:-1, 1:] + grid[:-1, :-1])
    column, row = np.rint(middles).astype(int).transpose(2, 0, 1)
    light = picture[
        np.clip(row, 0, picture.shape[0] - 1), np.clip(column, 0, picture.shape[1] - 1)
    ].astype(np.float64)
    parity = np.add.outer(np.arange(light.shape[0]), np.arange(light.shape[1])) % 2
    return bool(light[parity == 0].mean() < light[parity == 1].mean())
