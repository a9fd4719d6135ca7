"""Simultaneous pictures of cameras, as files, and corners of a board in them (extra `boards`)."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocmm_boards._board import Board, BoardDocument
from ocmm_boards._corners import BoardViews, view_patterns
from ocmm_core.acquisition.frames import SourceDescription
from ocmm_core.camera import CameraModel, Rig
from ocmm_core.documents import files_of_folder, write_new
from ocmm_core.errors import InputError, StorageError
from ocmm_core.fieldbus.objects import encoder_for
from ocmm_core.geometry import Float, Pixels
from ocmm_core.side_files import OversizeError, read_guarded
from ocmm_genicam import GenicamSource, camera_library, named_cameras

MOST_BYTES = 256 << 20
_LEAST_MARKERS = 6
_OF_A_SIDE = 0.25
"""Corners farther than this from where all markers put them belong to no such board."""
_LEAST_DOT_PX2, _MOST_DOT_PX2 = 12.0, 40_000.0
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
    find = _finder(opencv, board)
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


def views_in(
    folder: Path, rig: Rig, board: Board, tell: Callable[[int, int], None] = lambda done, of: None
) -> BoardViews:
    """Return the views that `write_view` wrote into a folder; errors as `detect_corners`."""
    patterns = [f"*-{camera.serial}.png" for camera in rig.cameras]
    return detect_corners(folder, patterns, rig.cameras, board, tell)


def corner_finder(board: Board) -> Callable[[NDArray[np.uint16]], Pixels]:
    """Return what finds the corners (N, 2) of a board in a picture, NaN if unseen; as above."""
    find = _finder(_opencv(), board)

    def corners_in(picture: NDArray[np.uint16]) -> Pixels:
        found = find((picture >> 8).astype(np.uint8))
        return np.full((len(board.corners), 2), np.nan) if found is None else found

    return corners_in


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


def _finder(opencv: Any, board: Board) -> Callable[[Any], Pixels | None]:
    document = board.document
    size = (document.columns, document.rows)
    if document.pattern == "apriltag":
        return _marker_finder(opencv, board)
    if document.pattern == "dots":
        blobs = opencv.SimpleBlobDetector_Params()
        blobs.minArea, blobs.maxArea = _LEAST_DOT_PX2, _MOST_DOT_PX2
        flags = opencv.CALIB_CB_ASYMMETRIC_GRID | opencv.CALIB_CB_CLUSTERING
        detect = opencv.SimpleBlobDetector_create(blobs)

        def by_dots(picture: Any) -> Pixels | None:
            found, centres = opencv.findCirclesGrid(picture, size, flags=flags, blobDetector=detect)
            return np.reshape(centres, (-1, 2)).astype(np.float64) if found else None

        return by_dots
    if document.pattern == "charuco":
        aruco = opencv.aruco
        grid = aruco.CharucoBoard(
            (document.columns + 1, document.rows + 1), document.pitch, document.marker,
            _dictionary(opencv, document),
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


def _dictionary(opencv: Any, document: BoardDocument) -> Any:
    code = getattr(opencv.aruco, document.dictionary, None)
    if not isinstance(code, int) or not document.dictionary.startswith("DICT_"):
        raise InputError(
            "boards.dictionary",
            f"OpenCV has no dictionary {document.dictionary!r}.",
            "Give the name under which the board was made, such as DICT_4X4_100.",
        )
    return opencv.aruco.getPredefinedDictionary(code)


def _marker_finder(opencv: Any, board: Board) -> Callable[[Any], Pixels | None]:
    """Return what finds the corners of numbered markers.

    Makers number the rows from the top or from the bottom, and turn markers by quarters. Both are
    read from the picture: a wrong order of rows would show the board from behind.
    """
    document = board.document
    count = document.columns * document.rows
    options = opencv.aruco.DetectorParameters()
    options.markerBorderBits = document.border
    options.cornerRefinementMethod = opencv.aruco.CORNER_REFINE_APRILTAG
    detector = opencv.aruco.ArucoDetector(_dictionary(opencv, document), options)
    corners = board.corners[:, :2].reshape(count, 4, 2)
    numbers = np.arange(count).reshape(document.rows, document.columns)
    orders = (numbers.ravel(), numbers[::-1].ravel())

    def by_numbers(picture: Any) -> Pixels | None:
        found, ids, _ = detector.detectMarkers(picture)
        known = [] if ids is None else [n for n, one in enumerate(ids.ravel()) if one < count]
        if len(known) < _LEAST_MARKERS:
            return None
        # Edges that are fitted so count pixels from the corner of the first one.
        seen = np.array([found[n][0] for n in known], dtype=np.float64) - 0.5
        side = np.linalg.norm(seen - np.roll(seen, 1, axis=1), axis=2).min(axis=1)
        for order, turn in product(orders, range(4)):
            shown, chosen = np.roll(seen, turn, axis=1), order[ids.ravel()[known]]
            places = corners[chosen].reshape(-1, 1, 2)
            plane, _ = opencv.findHomography(places, shown.reshape(-1, 1, 2))
            if plane is None:
                continue
            off = opencv.perspectiveTransform(places, plane).reshape(-1, 4, 2) - shown
            if np.all(np.linalg.norm(off, axis=2).max(axis=1) < _OF_A_SIDE * side):
                whole = np.full((count, 4, 2), np.nan)
                whole[chosen] = shown
                return whole.reshape(-1, 2)
        return None

    return by_numbers


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


_VIEW = re.compile(r"(\d{3,})-\d+\.png")
_SILENCE_S = 1.5


def genicam_source(source: str, rig: Rig) -> GenicamSource:
    """Return the cameras of a source, closed; InputError unless they are those of the rig."""
    serials, expected, gentl = named_cameras(source, rig)
    period_ns = expected[0].period_ns
    described = SourceDescription(
        source, tuple(camera.serial for camera in rig.cameras), period_ns, period_ns, live=True,
        simulated=False,
    )  # fmt: skip
    return GenicamSource(described, camera_library(gentl), serials, expected, _SILENCE_S)


def next_view(folder: Path) -> int:
    """Return the number of the next view in a folder, and make it; StorageError if it cannot."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(
            "pictures.folder", f"{folder}: the folder cannot be used ({error.strerror}).",
            "Give another folder.",
        ) from error  # fmt: skip
    names = [path.name for path in files_of_folder(folder, ".png")]
    return max((int(found[1]) for one in names if (found := _VIEW.fullmatch(one))), default=0) + 1


def write_view(folder: Path, number: int, rig: Rig, pictures: Sequence[NDArray[np.uint16]]) -> None:
    """Write the pictures of a view as VIEW-SERIAL.png; StorageError if one cannot be written."""
    for camera, picture in zip(rig.cameras, pictures, strict=True):
        path = folder / f"{number:03d}-{camera.serial}.png"
        try:
            write_new(path, encoder_for(path)(picture))
        except OSError as error:
            raise StorageError(
                "pictures.write", f"{path}: the picture was not written ({error.strerror}).",
                "Check the disk, then start the command again: it continues after the last view.",
            ) from error  # fmt: skip
