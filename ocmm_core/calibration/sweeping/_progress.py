"""Progress of a sweep: coverage, missing parts, and current guard findings.

The cells of its sphere map are fixed in the world, so that drawing does not flicker.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration import pivot
from ocmm_core.calibration.guided import OPEN, Gate, viewer_axes
from ocmm_core.calibration.records import Finding
from ocmm_core.calibration.sweeping._views import MapCell, SweepPhase, SweepView
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3, rigid_fit, unit
from ocmm_core.tracking import ProbeBody, solve

_CELLS = 600
CELL_RAD = float(np.sqrt(4.0 * np.pi / _CELLS))
"""Distance of neighbouring cells, about 8 degrees."""

_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
_AWAY = 0.3
"""Fraction of the largest direction above which a second one is named."""


def sphere_map(directions_world: Points3, reach: float) -> tuple[Float, tuple[MapCell, ...]]:
    """Return the middle of the map (3,) and its cells, required up to ``reach``, rad.

    ``directions_world`` (n, 3), unit, lead from the ball to the middle of the LEDs.
    """
    if not len(directions_world):
        return np.full(3, np.nan), ()
    grid = _grid()
    counts = np.bincount(np.argmax(directions_world @ grid.T, axis=1), minlength=_CELLS)
    middle = unit(grid[counts > 0].mean(axis=0))
    wanted = grid @ middle >= np.cos(reach)
    cells = tuple(
        MapCell(grid[cell], int(counts[cell]), bool(wanted[cell]))
        for cell in np.flatnonzero(wanted | (counts > 0))
    )
    return middle, cells


def where_missing(rig: Rig, middle_world: Float, cells: tuple[MapCell, ...]) -> str:
    """Return the sides, seen by the cameras, of missing cells ("to the left"), or nothing."""
    empty = [cell.direction_world for cell in cells if cell.wanted and not cell.poses]
    if not empty:
        return ""
    right, away, up = viewer_axes(rig)
    aside = np.mean(empty, axis=0)
    aside -= (aside @ middle_world) * middle_world
    words = (
        ("to the left", "to the right"), ("towards the cameras", "away from the cameras"),
        ("further down", "further up"),
    )  # fmt: skip
    sizes = np.array([aside @ right, aside @ away, aside @ up])
    order = np.argsort(-np.abs(sizes))[:2]
    named = [
        words[axis][int(sizes[axis] > 0.0)]
        for axis in order
        if abs(sizes[axis]) > _AWAY * np.abs(sizes).max()
    ]
    return ", ".join(named)


def _grid() -> Points3:
    """Return evenly spread directions on the sphere (Fibonacci's spiral), (n, 3)."""
    number = np.arange(_CELLS)
    z = 1.0 - (2.0 * number + 1.0) / _CELLS
    radius, angle = np.sqrt(1.0 - z**2), _GOLDEN * number
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


ENOUGH_TIMES = 2.5
"""With this multiple of the wanted poses, more do not improve the tip."""

SWEEP_ON = "Keep the ball in the cone and the LEDs towards the cameras."

_TIP_POSES = 40
_TIP_RANGE = np.radians(8.0)
_SHAPE_POSES = 100


@dataclass(frozen=True, slots=True)
class SweepProgress:
    poses: int
    coverage: pivot.SweepCoverage | None
    """None with fewer than ten of them."""
    tip_sigma: float
    """mm, predicted; infinite if unavailable."""
    tip_probe: Float | None
    """(3,), mm, document frame: tip determined by the sweep, or None."""
    centre_world: Float
    """(3,), mm: ball centre; NaN if undetermined."""
    middle_world: Float
    cells: tuple[MapCell, ...]
    """`middle_world`, `cells`: Of the sphere map."""
    findings: tuple[Finding, ...]
    """Current guard findings, except that more is needed."""


NO_PROGRESS = SweepProgress(0, None, np.inf, None, np.full(3, np.nan), np.full(3, np.nan), (), ())


def progress_of(
    rig: Rig, body: ProbeBody, sweep: pivot.PivotSweep, limits: pivot.PivotLimits, tip_known: bool
) -> SweepProgress:
    """Return the progress of a sweep; if not ``tip_known``, the tip comes from it alone."""
    if not len(sweep.uv):
        return NO_PROGRESS
    poses = solve(sweep.uv, rig, body, float(np.median(sweep.sigma_px)))
    good = poses.status == 0
    tip = _tip_of(poses.rotation_world_from_probe[good], poses.origin_world[good])
    if tip is None and not tip_known:
        return SweepProgress(
            len(sweep.uv), None, np.inf, None, np.full(3, np.nan), np.full(3, np.nan), (), ()
        )
    own = body if tip is None else replace(body, tip_probe=tip)
    preview = pivot.preview_pivot(rig, own, sweep, pattern=True)
    if preview.coverage is None:
        return SweepProgress(
            len(sweep.uv), None, np.inf, tip, preview.centre_world, np.full(3, np.nan), (), ()
        )
    middle, cells = sphere_map(
        preview.coverage.directions_world, 0.5 * np.radians(limits.wanted_deg)
    )
    return SweepProgress(
        poses=len(sweep.uv),
        coverage=preview.coverage,
        tip_sigma=preview.tip_sigma,
        tip_probe=tip,
        centre_world=preview.centre_world,
        middle_world=middle,
        cells=cells,
        findings=()
        if tip is None
        else _judge(rig, body, own, sweep, preview.centre_world, preview.coverage, limits),
    )


def view_of(
    progress: SweepProgress,
    phase: SweepPhase,
    gate: Gate,
    limits: pivot.PivotLimits,
    poses_wanted: int,
    sigma_wanted: float,
    *,
    may_end: bool,
) -> SweepView:
    """Return the display form of a sweep; with ``may_end`` it may end at a closed gate."""
    coverage = progress.coverage
    return SweepView(
        phase=SweepPhase.GOOD if gate.open else phase, poses=progress.poses,
        poses_wanted=poses_wanted, attitudes=0 if coverage is None else coverage.attitudes,
        attitudes_wanted=limits.least_attitudes,
        ranges=np.zeros(3) if coverage is None else coverage.ranges,
        ranges_wanted=np.radians([limits.wanted_deg, limits.wanted_deg, limits.roll_deg]),
        tip_sigma_mm=progress.tip_sigma, tip_sigma_wanted_mm=sigma_wanted,
        map_middle_world=progress.middle_world, cells=progress.cells,
        centre_world=progress.centre_world, good=gate.open,
        missing="" if gate.open else gate.reason, may_end=gate.open or may_end,
    )  # fmt: skip


def gate_of(
    rig: Rig,
    progress: SweepProgress,
    limits: pivot.PivotLimits,
    poses_wanted: int,
    sigma_wanted: float,
    *,
    forced: bool,
) -> Gate:
    """Return whether a sweep is complete, and what is missing; ``forced`` overrules guards only."""
    refused = [one for one in progress.findings if one.refuses and not (forced and one.forcible)]
    if refused:
        return Gate(False, refused[0].what, refused[0].remedy)
    missing = _missing(rig, progress, limits, poses_wanted, sigma_wanted)
    return Gate(False, missing, SWEEP_ON) if missing else OPEN


def _missing(
    rig: Rig,
    progress: SweepProgress,
    limits: pivot.PivotLimits,
    poses_wanted: int,
    sigma_wanted: float,
) -> str:
    if progress.coverage is None:
        return "Hardly any sweep yet."
    first, second, third = np.degrees(progress.coverage.ranges)
    if second < limits.wanted_deg:
        side = where_missing(rig, progress.middle_world, progress.cells)
        wider = f"Sweep wider ({side})" if side else "Sweep wider"
        return f"{wider}: {first:.0f} and {second:.0f} of {limits.wanted_deg:.0f} degrees reached."
    if third < limits.roll_deg:
        return (
            f"Turn the probe about its handle: {third:.0f} of {limits.roll_deg:.0f} degrees "
            "reached."
        )
    if progress.coverage.attitudes < limits.least_attitudes:
        left = limits.least_attitudes - progress.coverage.attitudes
        attitudes = "1 attitude" if left == 1 else f"{left} attitudes"
        return f"Keep sweeping along different paths: {attitudes} to go."
    if progress.poses < poses_wanted:
        left = poses_wanted - progress.poses
        poses = "1 pose" if left == 1 else f"{left} poses"
        return f"Keep sweeping: {poses} to go."
    if not np.isfinite(progress.tip_sigma):
        return "Keep sweeping: the tip is not determined yet."
    if progress.tip_sigma > sigma_wanted and progress.poses < ENOUGH_TIMES * poses_wanted:
        return (
            f"Keep sweeping: U of the tip (k = 2) {2e3 * progress.tip_sigma:.1f} um, target "
            f"{2e3 * sigma_wanted:.1f} um."
        )
    return ""


def is_forcible(progress: SweepProgress, limits: pivot.PivotLimits) -> bool:
    """Return whether the user may end an incomplete sweep."""
    coverage = progress.coverage
    return (
        coverage is not None
        and progress.poses >= pivot.LEAST_FRAMES
        and coverage.attitudes >= limits.least_attitudes
        and bool(np.degrees(coverage.ranges[1]) >= limits.weak_deg)
        and not any(one.refuses and not one.forcible for one in progress.findings)
    )


def _tip_of(rotations: Float, origins: Float) -> Float | None:
    """Return the tip from poses, (3,), mm; None if undetermined."""
    if len(rotations) < _TIP_POSES or second_range(rotations) < _TIP_RANGE:
        return None
    try:
        return pivot.pivot_of_poses(rotations, origins).tip
    except CalibrationError:
        return None


def second_range(rotations: Float) -> float:
    """Return the second largest rotation range of rotations (n, 3, 3), rad."""
    u, _, vt = np.linalg.svd(rotations.mean(axis=0))
    turned = (u @ vt).T @ rotations
    # Small enough for the skew part to equal the rotation vector to some per cent.
    vectors = 0.5 * np.stack(
        [
            turned[:, 2, 1] - turned[:, 1, 2],
            turned[:, 0, 2] - turned[:, 2, 0],
            turned[:, 1, 0] - turned[:, 0, 1],
        ],
        axis=1,
    )
    axes = np.linalg.svd(vectors - vectors.mean(axis=0), full_matrices=False)[2]
    return float(np.sort(np.ptp(vectors @ axes.T, axis=0))[-2])


def _judge(
    rig: Rig,
    body: ProbeBody,
    own: ProbeBody,
    sweep: pivot.PivotSweep,
    centre: Float,
    coverage: pivot.SweepCoverage,
    limits: pivot.PivotLimits,
) -> tuple[Finding, ...]:
    targets = pivot.locate_targets(rig, sweep.uv)
    if not np.isfinite(targets).all(axis=(1, 2)).any():
        led = int(np.isfinite(targets[..., 0]).sum(axis=0).argmin())
        return (
            Finding(
                "pivot.no_complete_frame",
                f"No pose shows all LEDs of the probe to two cameras; LED {led + 1} least.",
                "Turn the LEDs towards the cameras and keep the hand off them; check that all "
                "of them are lit.",
                refuses=True,
            ),
        )
    leds = body.leds_probe
    shape = pivot.mean_shape(targets, _SHAPE_POSES)
    rotation, shift = rigid_fit(shape, leds)
    found = tuple(pivot.judge_shape(body, shape @ rotation.T + shift, own.tip_probe, limits))
    if np.degrees(coverage.ranges[1]) < limits.small_deg:
        # A poorly determined tip varies with the attitude.
        return found
    arms = own.leds_probe - own.tip_probe
    free = pivot.free_poses(rig, sweep, arms)
    common = pivot.shared_part(rig, sweep)
    moved = tuple(pivot.judge_jump(pivot.find_jump(free, free.solved, centre, common), limits))
    if moved:
        # Costs some tenths of a second, so only where it decides.
        turns = free.rotations[free.solved]
        state = pivot.PivotState(centre, arms, turns, np.zeros((len(turns), 3)))
        by_tips = pivot.tips_by_cameras(rig, sweep.only(free.solved), state, 0.0)
        moved = tuple(
            pivot.judge_jump(pivot.find_jump(free, free.solved, centre, common, by_tips), limits)
        )
    return (*found, *moved)
