"""Tables of board corners in pictures, as `mrgingham` and `mrcal` write and read them.

::

    # filename x y level
    frame00-cam0.png 512.31 388.02 0
    frame00-cam0.png 561.77 388.95 0

One line a corner, row by row in the order of the board. ``level`` is how often the picture was
halved for the detector: the corner counts with a standard deviation of 2^level. ``-`` in place of
the numbers, or a negative level, is a corner that was not seen. Pixels are counted from the centre
of the first one. A pattern for each camera, such as ``*-cam0.png``, selects its pictures. The text
matched by ``*`` is the view; pictures of one view were taken at the same time.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ocmm_core.calibration.bundle import BundleState
from ocmm_core.camera import CameraModel, project
from ocmm_core.documents import read_text
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Int, Pixels

LEGENDS = (("filename", "x", "y", "level"), ("filename", "x", "y"))
LEAST_CORNERS = 12
"""Of one camera in a view, to determine the pose."""
MOST_LEVEL = 10
MOST_BYTES = 256 << 20
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
_RIM = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1) / np.sqrt(
    (2.0 + np.cos(_ANGLES[1])) / 3.0
)
"""(m, 2): polygon with the second moments of the unit circle, on which the shift depends."""
_OUTSIDE_PX = 1.0
"""Corners are found up to the border of a picture, not beyond."""


@dataclass(frozen=True, slots=True)
class BoardViews:
    """Corners in simultaneous pictures, in the order of the views' names."""

    names: tuple[str, ...]
    """(n,): text matched by ``*``."""
    uv: Pixels
    """(n, C, N, 2), px; NaN if unseen."""
    levels: Int
    """(n, C, N): corners count with 2^level times the common standard deviation."""
    left_out: tuple[str, ...] = ()
    """Sentences about unused pictures."""

    @property
    def seen(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Return the mask of seen corners, (n, C, N)."""
        found: np.ndarray[tuple[int, ...], np.dtype[np.bool_]] = np.isfinite(self.uv[..., 0])
        return found

    @property
    def usable(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Return the pictures with enough corners for a pose, (n, C)."""
        enough: np.ndarray[tuple[int, ...], np.dtype[np.bool_]] = (
            self.seen.sum(axis=2) >= LEAST_CORNERS
        )
        return enough

    def chosen(self, indices: Int) -> BoardViews:
        names = tuple(self.names[index] for index in indices)
        return BoardViews(names, self.uv[indices], self.levels[indices], self.left_out)


def with_dot_centres(views: BoardViews, dot: float, state: BundleState, chosen: Int) -> BoardViews:
    """Return views with the images of the centres of dots, of this diameter in mm.

    ``state``: cameras, and poses of the board in the views ``chosen``.
    Seen is the middle of the area of a dot, which tilt and lens move off the image of its centre.
    """
    uv = views.uv.copy()
    for row, view in enumerate(chosen):
        across = 0.5 * dot * _RIM @ state.rotations[row][:, :2].T
        centres = state.leds_world[row]
        rims = (centres[:, None] + across).reshape(-1, 3)
        for index, camera in enumerate(state.cameras):
            start = project(camera, rims).reshape(len(centres), -1, 2)
            end = np.roll(start, -1, axis=1)
            twice = start[..., 0] * end[..., 1] - end[..., 0] * start[..., 1]
            weighted = ((start + end) * twice[..., None]).sum(axis=1)
            middles = weighted / (3.0 * twice.sum(axis=1))[:, None]
            uv[view, index] -= middles - project(camera, centres)
    return replace(views, uv=uv)


def view_patterns(patterns: Sequence[str], cameras: Sequence[CameraModel]) -> list[re.Pattern[str]]:
    """Return one expression a camera; InputError without one pattern with one * for each."""
    names = ", ".join(f"'{camera.name}'" for camera in cameras)
    if len(patterns) != len(cameras):
        raise InputError(
            "boards.patterns",
            f"{len(patterns)} patterns of pictures were given, and the rig has {len(cameras)} "
            f"cameras: {names}.",
            "Give one pattern for each camera, in the order of the rig.",
        )
    found = []
    for pattern in patterns:
        before, star, behind = pattern.partition("*")
        if not star or "*" in behind:
            raise InputError(
                "boards.patterns",
                f"The pattern {pattern!r} does not contain exactly one *.",
                "Write * in place of what changes from view to view, such as *-cam0.png.",
            )
        found.append(re.compile(f"{re.escape(before)}(.+){re.escape(behind)}"))
    return found


def read_corners(
    path: Path, patterns: Sequence[str], cameras: Sequence[CameraModel], count: int
) -> BoardViews:
    """Return the views of a table of corners; ``count`` corners a board.

    InputError: not such a table, a picture of two cameras, with another number of corners, or with
    a corner outside the sensor of its camera.
    """
    expressions = view_patterns(patterns, cameras)
    pictures = _pictures(path)
    views: dict[str, dict[int, tuple[Pixels, Int]]] = {}
    strange: list[str] = []
    for picture, (line, rows) in pictures.items():
        owners = [
            (index, match.group(1))
            for index, expression in enumerate(expressions)
            if (match := expression.fullmatch(Path(picture).name))
        ]
        if len(owners) > 1:
            raise _wrong(
                path, line, f"{picture!r} matches the patterns of two cameras",
                "Give patterns that tell the cameras apart.",
            )  # fmt: skip
        if not owners:
            strange.append(picture)
            continue
        camera, view = owners[0]
        if camera in views.setdefault(view, {}):
            raise _wrong(
                path, line, f"the picture {picture!r} of this view occurs already",
                "Keep one of the two.",
            )  # fmt: skip
        if rows.shape[0] == 1 and not np.isfinite(rows[0, 0]):
            rows = np.full((count, 3), np.nan)
        if len(rows) != count:
            raise _wrong(
                path, line, f"{picture!r} has {len(rows)} corners, and the board has {count}",
                "Give the table of this board, or correct columns and rows of its document.",
            )  # fmt: skip
        _require_inside(path, line, picture, rows, cameras[camera])
        views[view][camera] = rows[:, :2], np.nan_to_num(rows[:, 2]).astype(np.int64)
    if not views:
        raise InputError(
            "boards.no_picture",
            f"{path}: none of its {len(pictures)} pictures matches the patterns of the cameras.",
            f"Give patterns for names such as {next(iter(pictures))!r}.",
        )
    names = tuple(sorted(views))
    uv = np.full((len(names), len(cameras), count, 2), np.nan)
    levels = np.zeros(uv.shape[:3], dtype=np.int64)
    for index, name in enumerate(names):
        for camera, (spots, weights) in views[name].items():
            uv[index, camera], levels[index, camera] = spots, weights
    said: tuple[str, ...] = ()
    if len(strange) == 1:
        said = (f"{path}: 1 picture of no camera of this rig was left out: {strange[0]!r}.",)
    elif strange:
        said = (
            f"{path}: {len(strange)} pictures of no camera of this rig were left out, "
            f"such as {strange[0]!r}.",
        )
    return BoardViews(names, uv, levels, said)


def _pictures(path: Path) -> dict[str, tuple[int, Float]]:
    """Return the first line and the rows (m, 3) of x, y, level of each picture of a table."""
    rows: dict[str, list[tuple[float, float, float]]] = {}
    first: dict[str, int] = {}
    legend: list[str] = []
    for line, text in enumerate(read_text(path, MOST_BYTES).splitlines(), start=1):
        words = text.split("##")[0].split()
        if not words:
            continue
        if words[0].startswith("#"):
            # Only the first comment that is not ## is the legend.
            legend = legend or " ".join(words).lstrip("# ").split()
            continue
        if tuple(legend) not in LEGENDS:
            raise _wrong(
                path, line, f"the columns {' '.join(legend)!r} are not those of a table of corners",
                "Write '# filename x y level' above the corners.",
            )  # fmt: skip
        name, numbers = words[0], words[1:]
        if len(numbers) != len(legend) - 1:
            raise _wrong(
                path, line, f"{len(numbers)} numbers where {len(legend) - 1} are wanted",
                "Write one corner a line.",
            )  # fmt: skip
        first.setdefault(name, line)
        rows.setdefault(name, []).append(_corner(path, line, numbers))
    if not rows:
        raise InputError(
            "boards.empty", f"{path}: there are no corners.", "Give a table of corners."
        )
    return {name: (first[name], np.array(corners)) for name, corners in rows.items()}


def _corner(path: Path, line: int, numbers: Sequence[str]) -> tuple[float, float, float]:
    if numbers[-1] == "-" or numbers[0] == "-":
        return np.nan, np.nan, 0.0
    try:
        x, y = float(numbers[0]), float(numbers[1])
        level = int(numbers[2]) if len(numbers) > 2 else 0
    except ValueError:
        level, x = -1, np.inf
    if not np.isfinite(x) or not np.isfinite(y) or level > MOST_LEVEL:
        raise _wrong(
            path, line, f"{' '.join(numbers)!r} is no corner",
            "Write x and y in pixels and a level, or - for one that was not seen.",
        )  # fmt: skip
    return (x, y, float(level)) if level >= 0 else (np.nan, np.nan, 0.0)


def _require_inside(path: Path, line: int, picture: str, rows: Float, camera: CameraModel) -> None:
    far = np.array([camera.width, camera.height]) - 1.0
    beyond = np.maximum(-rows[:, :2], rows[:, :2] - far)
    if np.nanmax(beyond, initial=-np.inf) > _OUTSIDE_PX:
        raise _wrong(
            path, line,
            f"{picture!r} has corners outside the {camera.width} x {camera.height} pixels of "
            f"camera '{camera.name}'",
            "Give the pictures of this camera at their full size.",
        )  # fmt: skip


def _wrong(path: Path, line: int, what: str, remedy: str) -> InputError:
    return InputError("boards.corners", f"{path}, line {line}: {what}.", remedy)
