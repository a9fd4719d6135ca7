"""A rig as it is, a board as it is, and the board's corners in the pictures of both cameras."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ocmm_boards import Board, BoardViews, RecordedSpots, load_board
from ocmm_core.acquisition.frames import FrameBlock, SourceDescription
from ocmm_core.acquisition.recording import FrameRecorder
from ocmm_core.calibration.cameras import LensCamera, project_extended
from ocmm_core.calibration.guided import location_gains, random_lines
from ocmm_core.calibration.records import ArtefactUse
from ocmm_core.calibration.relocation import BarDistance, Observations, ProbeFrames, ShownBar
from ocmm_core.camera import CameraModel, Rig, load_rig, on_sensor, project
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, Pixels, Points3, rotation_from_vector, unit
from ocmm_core.tracking import ProbeBody, load_probe, triangulate

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
SPOT_PX = 0.0105
"""Scatter of an averaged spot of an LED."""
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
    extra: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """k3, mm^-6, and thin prism s1, s2, mm^-1, of all true lenses."""


def board_in(folder: Path, *, expanded: float = 0.002, **others: object) -> Path:
    """Write the document of a board; return its path."""
    values = {"pattern": "chessboard", "columns": 11, "rows": 8, "pitch": 30.0} | others
    path = folder / "board.toml"
    path.write_text(DOCUMENT.format(expanded=expanded, **values), encoding="utf-8")
    return path


def scene(
    folder: Path, seed: int, *, views: int = 40, noise_px: float = 0.03, common_px: float = 0.0,
    bent_mm: float = 0.0, expanded: float = 0.002, dot: float = 0.0, small: bool = False,
    distortion: float = 0.0, extra: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Scene:  # fmt: skip
    """Return a scene; ``common_px`` moves all corners of a picture, ``bent_mm`` bends the board.

    ``dot``: diameter of dots in place of corners, mm; ``small``: half the corners;
    ``distortion``: more by k1, part of the radius in the corner of a picture; ``extra``: terms of
    the true lenses beyond the model, as `Scene.extra`.
    """
    rng = np.random.default_rng(seed)
    nominal = load_rig(resource("rigs", "recommended.toml"))
    path = board_in(folder, expanded=expanded)
    if small:
        path = board_in(folder, expanded=expanded, columns=7, rows=6, pitch=45.0)
    if dot:
        path = board_in(folder, expanded=expanded, pattern="dots", columns=7, rows=11, pitch=25.0)
        path.write_text(f"{path.read_text(encoding='utf-8')}dot = {dot}\n", encoding="utf-8")
    board = load_board(path)
    cameras = tuple(
        _distorted(camera.perturbed(np.array(SPREAD) * rng.standard_normal(14)), distortion)
        for camera in nominal.cameras
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
            spots = true_spots(camera, corners, extra)
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
        nominal, replace(nominal, cameras=cameras), board, shape, BoardViews(names, uv, levels),
        extra,
    )  # fmt: skip


def hard_scene(folder: Path, seed: int) -> Scene:
    """Return a rig of a shop: cheap lenses, a printed board of 3e-4, 10 to 40 views, blur."""
    rng = np.random.default_rng([seed, 4])
    return scene(
        folder, seed, views=int(rng.integers(10, 41)), noise_px=float(rng.uniform(0.03, 0.1)),
        common_px=float(rng.uniform(0.0, 0.02)), bent_mm=float(rng.uniform(-0.1, 0.1)),
        expanded=2.0 * 3e-4 * 366.0, distortion=float(rng.uniform(-0.08, 0.08)),
    )  # fmt: skip


def true_spots(camera: CameraModel, points: Points3, extra: tuple[float, float, float]) -> Pixels:
    """Return the images (n, 2), px, of points by a lens with more terms than the model."""
    if not any(extra):
        return project(camera, points)
    return project_extended(LensCamera(camera, np.array(extra)), points)


def _distorted(camera: CameraModel, part: float) -> CameraModel:
    radius = 0.5 * camera.pitch_mm * float(np.hypot(camera.width, camera.height))
    return replace(camera, k1=camera.k1 + part / radius**2)


@dataclass(frozen=True, slots=True)
class Truth:
    """True probe and bar of recordings, and what their documents state of them."""

    body: ProbeBody
    """As stated."""
    leds: Points3
    length: float
    """Length of the bar, mm."""
    stated: BarDistance


def truth(seed: int, *, led_sigma: float = 0.002, bar_sigma: float = 0.0005) -> Truth:
    """Return a probe and a bar of 300 mm with errors as large as stated."""
    rng = np.random.default_rng([seed, 1])
    body = load_probe(resource("probes", "standard.toml"))
    sigmas = np.concatenate([np.full(body.leds_probe.size, led_sigma), np.full(3, 0.002)])
    off = led_sigma * rng.standard_normal(body.leds_probe.shape)
    return Truth(
        replace(body, geometry_covariance=np.diag(sigmas**2)), body.leds_probe + off,
        LENGTH_MM + bar_sigma * rng.standard_normal(), BarDistance("bar", LENGTH_MM, bar_sigma),
    )  # fmt: skip


def recorded(
    one: Scene, seed: int, *, poses: int = 120, placements: int = 10, certified: bool = True,
    true: Truth | None = None, rig: Rig | None = None,
) -> RecordedSpots:  # fmt: skip
    """Return the probe waved ``poses`` times and the bar shown, by the cameras of ``rig``."""
    true, cameras = true or truth(seed), (rig or one.true).cameras
    rng = np.random.default_rng([seed, 2])
    low, high = one.true.volume_world
    places = rng.uniform(low, high, (poses, 3))
    vectors = rng.uniform(-0.6, 0.6, (poses, 3))
    turns = np.array([rotation_from_vector(v) for v in vectors]).reshape(-1, 3, 3)
    leds = np.einsum("nij,lj->nli", turns, true.leds - true.leds.mean(axis=0)) + places[:, None]
    bars: tuple[ShownBar, ...] = ()
    if placements:
        ends = random_lines(one.true.volume_world, true.length, placements, seed)
        spots = seen_by(cameras, ends, rng)
        bars = (ShownBar(true.stated, spots, np.full(placements, SPOT_PX)),)
    use = ArtefactUse(
        name="bar", serial="B-1", certificate="C-1", certificate_sha256="",
        due_utc="2099-01-01T00:00:00+00:00",
    )  # fmt: skip
    waved = ProbeFrames.waved(seen_by(cameras, leds, rng), SPOT_PX)
    uses = (use,) if certified and placements else ()
    return RecordedSpots(true.body, Observations(waved, bars), 0.0, uses)


def write_recording(path: Path, rig: Rig, uv: Pixels, hold: int, seed: int) -> None:
    """Record spots (n, C, k, 2), px: each shown for ``hold`` frames, with the noise of the rig."""
    rng = np.random.default_rng([seed, 3])
    noise, slots = rig.noise, 8
    period = round(1e9 / rig.frame_rate_hz)
    serials = tuple(camera.serial for camera in rig.cameras)
    description = SourceDescription("made", serials, period, period, live=False, simulated=True)
    steady = uv + noise.pattern_px * rng.standard_normal(uv.shape)
    with FrameRecorder(path, description, rig) as recorder:
        for index, shown in enumerate(steady):
            frames = np.full((hold, len(serials), slots, 2), np.nan)
            frames[:, :, : shown.shape[1]] = shown + noise.white_px * rng.standard_normal(
                (hold, *shown.shape)
            )
            counter = index * hold + np.arange(hold)
            seen = np.isfinite(frames[..., 0])
            valid = (seen * (1 << np.arange(slots))).sum(axis=2).astype(np.uint64)
            flags = np.zeros(hold, dtype=np.uint32)
            recorder.append(FrameBlock(counter, counter * period, flags, valid, frames))


def seen_by(cameras: tuple[CameraModel, ...], points: Float, rng: np.random.Generator) -> Pixels:
    """Return noisy spots (n, C, k, 2), px, of points (n, k, 3), mm; NaN off the sensor."""
    flat = points.reshape(-1, 3)
    uv = np.stack([project(one, flat).reshape(*points.shape[:2], 2) for one in cameras], axis=1)
    seen = np.stack(
        [on_sensor(one, uv[:, c].reshape(-1, 2)) for c, one in enumerate(cameras)], axis=1
    ).reshape(*points.shape[:2], len(cameras))
    noisy: Pixels = uv + SPOT_PX * rng.standard_normal(uv.shape)
    return np.where(seen.transpose(0, 2, 1)[..., None], noisy, np.nan)


def _middles(rims: Float) -> Float:
    """Return the centroids (n, 2) of areas with these outlines (n, m, 2)."""
    start, end = rims, np.roll(rims, -1, axis=1)
    twice = start[..., 0] * end[..., 1] - end[..., 0] * start[..., 1]
    middles: Float = ((start + end) * twice[..., None]).sum(axis=1) / (3.0 * twice.sum(axis=1))[
        :, None
    ]
    return middles


def length_errors(
    found: Rig, true: Rig, seed: int, lines: int = 100,
    extra: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> tuple[Float, Float]:  # fmt: skip
    """Return errors and standard uncertainties (n,), mm, of lengths all over the volume."""
    ends = random_lines(true.volume_world, LENGTH_MM, lines, seed).reshape(-1, 3)
    located = triangulate(
        found, np.stack([true_spots(camera, ends, extra) for camera in true.cameras])
    )
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
