"""A rig as it is, a board as it is, and the board's corners in the pictures of both cameras."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ocmm_boards import Board, BoardViews, load_board
from ocmm_core.calibration.guided import location_gains, random_lines
from ocmm_core.camera import Rig, load_rig, on_sensor, project
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, Points3, rotation_from_vector, unit
from ocmm_core.tracking import triangulate

DOCUMENT = """schema = "ocmm.board/1"
unit = "mm"
name = "glass 12 x 9"
serial = "CB-12"
pattern = "{pattern}"
columns = {columns}
rows = {rows}
pitch = {pitch}
expanded = {expanded}
corner_sigma = 0.005
flatness = 0.2
expansion = 8.5e-6
expansion_sigma = 1.0e-6
"""
LENGTH_MM = 300.0
SPREAD = (
    *(0.02,) * 3, *(15.0,) * 3, 0.3, 2e-4, 8.0, 8.0, 6e-5, 1e-8, 1e-5, 1e-5,
)  # fmt: skip
"""Standard deviations of the true cameras about the rig document, in the order of `PARAMETERS`."""
_TILT_RAD = 0.8
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 90, endpoint=False)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)
_LEAST_SEEN = 20


@dataclass(frozen=True, slots=True)
class Scene:
    """True cameras and board, and the observed corners."""

    nominal: Rig
    true: Rig
    board: Board
    shape: Points3
    """(N, 3), mm: corners as they are."""
    views: BoardViews


def board_in(folder: Path, *, expanded: float = 0.002, **others: object) -> Path:
    """Write the document of a board; return its path."""
    values = {"pattern": "chessboard", "columns": 11, "rows": 8, "pitch": 30.0} | others
    path = folder / "board.toml"
    path.write_text(DOCUMENT.format(expanded=expanded, **values), encoding="utf-8")
    return path


def scene(
    folder: Path, seed: int, *, views: int = 40, noise_px: float = 0.03, common_px: float = 0.0,
    bent_mm: float = 0.0, expanded: float = 0.002, dot: float = 0.0,
) -> Scene:  # fmt: skip
    """Return a scene; ``common_px`` moves all corners of a picture, ``bent_mm`` bends the board.

    ``dot``: diameter of dots in place of corners, mm.
    """
    rng = np.random.default_rng(seed)
    nominal = load_rig(resource("rigs", "recommended.toml"))
    path = board_in(folder, expanded=expanded)
    if dot:
        path = board_in(folder, expanded=expanded, pattern="dots", columns=7, rows=11, pitch=25.0)
        path.write_text(f"{path.read_text(encoding='utf-8')}dot = {dot}\n", encoding="utf-8")
    board = load_board(path)
    cameras = tuple(
        camera.perturbed(np.array(SPREAD) * rng.standard_normal(14)) for camera in nominal.cameras
    )
    factor = np.linalg.cholesky(board.covariance + 1e-14 * np.eye(board.corners.size))
    shape = board.corners + (factor @ rng.standard_normal(len(factor))).reshape(-1, 3)
    shape[:, 2] += bent_mm * (shape[:, 0] / shape[:, 0].max()) ** 2
    middle = np.mean([camera.centre_world for camera in cameras], axis=0)
    uv = np.full((views, len(cameras), len(shape), 2), np.nan)
    done = 0
    while done < views:
        at = rng.uniform(*nominal.volume_world)
        towards = unit(middle - at)
        across = unit(np.cross([0.0, 0.0, 1.0], towards))
        facing = np.stack([across, -np.cross(towards, across), -towards], axis=1)
        tilt = np.append(rng.uniform(-_TILT_RAD, _TILT_RAD, 2), rng.uniform(-np.pi, np.pi))
        turn = facing @ rotation_from_vector(tilt)
        corners = shape @ turn.T + at
        for index, camera in enumerate(cameras):
            spots = project(camera, corners)
            if dot:
                rims = corners[:, None] + 0.5 * dot * _CIRCLE @ turn[:, :2].T
                spots = _middles(project(camera, rims.reshape(-1, 3)).reshape(*rims.shape[:2], 2))
            seen = on_sensor(camera, spots)
            if seen.sum() >= _LEAST_SEEN:
                errors = noise_px * rng.standard_normal(spots.shape)
                errors += common_px * rng.standard_normal(2)
                uv[done, index] = np.where(seen[:, None], spots + errors, np.nan)
        done += bool(np.isfinite(uv[done]).any())
    names = tuple(f"v{number:03d}" for number in range(views))
    levels = np.zeros(uv.shape[:3], dtype=np.int64)
    return Scene(
        nominal, replace(nominal, cameras=cameras), board, shape, BoardViews(names, uv, levels)
    )


def _middles(rims: Float) -> Float:
    """Return the centroids (n, 2) of areas with these outlines (n, m, 2)."""
    start, end = rims, np.roll(rims, -1, axis=1)
    twice = start[..., 0] * end[..., 1] - end[..., 0] * start[..., 1]
    middles: Float = ((start + end) * twice[..., None]).sum(axis=1) / (3.0 * twice.sum(axis=1))[
        :, None
    ]
    return middles


def length_errors(found: Rig, true: Rig, seed: int, lines: int = 100) -> tuple[Float, Float]:
    """Return errors and standard uncertainties (n,), mm, of lengths all over the volume."""
    ends = random_lines(true.volume_world, LENGTH_MM, lines, seed).reshape(-1, 3)
    located = triangulate(found, np.stack([project(camera, ends) for camera in true.cameras]))
    gains, _, seen = location_gains(found, located)
    whole = seen.reshape(-1, 2).all(axis=1)
    pairs = located.reshape(-1, 2, 3)[whole]
    along = unit(pairs[:, 1] - pairs[:, 0])
    both = gains.reshape(-1, 2, *gains.shape[1:])[whole]
    rows = np.einsum("ni,nip->np", along, both[:, 1] - both[:, 0])
    variances = np.einsum("np,pq,nq->n", rows, found.parameter_covariance, rows, optimize=True)
    errors: Float = np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1) - LENGTH_MM
    return errors, np.sqrt(variances)


def table_of(views: BoardViews) -> str:
    """Return the table of corners of views, as `mrgingham` writes it."""
    lines = ["# filename x y level"]
    for name, pictures in zip(views.names, views.uv, strict=True):
        for camera, corners in enumerate(pictures):
            lines += [
                f"{name}-cam{camera}.png {x:.4f} {y:.4f} 0"
                if np.isfinite(x)
                else f"{name}-cam{camera}.png - - -"
                for x, y in corners
            ]
    return "\n".join(lines) + "\n"
