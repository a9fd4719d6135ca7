"""Error of a probe calibration due to noise alone: simulation of thesis 3.2.1.

The LEDs are turned about the tip by uniformly distributed angles, noise is added to every position,
and the tip is estimated; many times. The product's estimator, which uses spots of a rig instead of
positions, can be studied as well.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.pivot import (
    PivotSweep,
    adjust_pivot,
    common_centre,
    group_average,
    sphere_centres,
    start_pivot,
)
from ocmm_core.camera import Rig, compiled, project
from ocmm_core.cluster import HERE, Site, run_tasks
from ocmm_core.errors import OcmmError
from ocmm_core.geometry import Float, Points3, rigid_fit


@compiled(reorder=True)
def add_paths(
    sines: NDArray[np.float32], cosines: NDArray[np.float32], noise: NDArray[np.float32],
    leds: Float, sigma: Float, first: int, turns: NDArray[np.float32], moments: Float,
    points: Float,
) -> None:  # fmt: skip
    """Turn the LEDs about the tip, add noise, and add to the moments of their paths.

    Data of a pose is one column, so that several poses are vectorised. Single precision serves
    turns and noise: it moves an LED by some 10 nm at random, a hundredth of the noise at most,
    which adds to it by its square.

    ``sines``, ``cosines`` (3, m): of alpha, beta and gamma; ``noise`` (3 L, m): standard normals;
    ``leds`` (L, 3), mm, from the tip; ``sigma`` (3,), mm, world; ``first``: number of the first
    pose; ``turns`` (9, m): scratch; ``moments`` (L, 13), added to: `pivot.add_moments` with the
    LEDs as reference; ``points`` (n, L, 3), mm, output: noisy targets, (0, L, 3) to skip them.
    """
    m = sines.shape[1]
    for i in range(m):
        sa, sb, sc = sines[0, i], sines[1, i], sines[2, i]
        ca, cb, cc = cosines[0, i], cosines[1, i], cosines[2, i]
        # R = Rz(gamma) Ry(beta) Rx(alpha), active, about the tip.
        turns[0, i] = cc * cb
        turns[1, i] = cc * sb * sa - sc * ca
        turns[2, i] = cc * sb * ca + sc * sa
        turns[3, i] = sc * cb
        turns[4, i] = sc * sb * sa + cc * ca
        turns[5, i] = sc * sb * ca - cc * sa
        turns[6, i] = -sb
        turns[7, i] = cb * sa
        turns[8, i] = cb * ca
    for led in range(leds.shape[0]):
        lx, ly, lz = leds[led, 0], leds[led, 1], leds[led, 2]
        noise_x, noise_y, noise_z = noise[3 * led], noise[3 * led + 1], noise[3 * led + 2]
        # Sums of y = target minus the LED at rest, for numerical precision: see `add_moments`.
        tx = ty = tz = 0.0
        xx = xy = xz = yy = yz = zz = qx = qy = qz = 0.0
        for i in range(m):
            # The tip is the origin of the world here: no translation.
            x = turns[0, i] * lx + turns[1, i] * ly + turns[2, i] * lz + sigma[0] * noise_x[i] - lx
            y = turns[3, i] * lx + turns[4, i] * ly + turns[5, i] * lz + sigma[1] * noise_y[i] - ly
            z = turns[6, i] * lx + turns[7, i] * ly + turns[8, i] * lz + sigma[2] * noise_z[i] - lz
            square = x * x + y * y + z * z
            tx += x
            ty += y
            tz += z
            xx += x * x
            xy += x * y
            xz += x * z
            yy += y * y
            yz += y * z
            zz += z * z
            qx += x * square
            qy += y * square
            qz += z * square
        own = moments[led]
        own[0] += m
        own[1] += tx
        own[2] += ty
        own[3] += tz
        own[4] += xx
        own[5] += xy
        own[6] += xz
        own[7] += yy
        own[8] += yz
        own[9] += zz
        own[10] += qx
        own[11] += qy
        own[12] += qz
        # Recomputed: few studies need the targets themselves.
        if points.shape[0] > 0:
            for i in range(m):
                at = points[first + i, led]
                x = turns[0, i] * lx + turns[1, i] * ly + turns[2, i] * lz
                y = turns[3, i] * lx + turns[4, i] * ly + turns[5, i] * lz
                z = turns[6, i] * lx + turns[7, i] * ly + turns[8, i] * lz
                at[0] = x + sigma[0] * noise_x[i]
                at[1] = y + sigma[1] * noise_y[i]
                at[2] = z + sigma[2] * noise_z[i]


Estimator = Literal["thesis", "common", "bundle"]
"""Mean of one sphere for each LED; one common centre; adjustment on the spots of a rig."""

_CHUNK = 2000
"""Poses whose data fit into the cache together."""

_RUNS_A_TASK = 20


@dataclass(frozen=True, slots=True)
class ProbeStudy:
    """Parameters of a study."""

    leds: Points3
    """(L, 3), mm: from the tip (thesis Table 2)."""
    ranges: Float
    """(3,), rad: alpha, beta and gamma are uniform between minus and plus these (Table 3)."""
    sigma: Float
    """(3,), mm: noise of a position, world; unused by "bundle"."""
    poses: int
    estimator: Estimator = "thesis"
    with_leds: bool = True
    """Also average the LEDs and compare them (figure 15); the tip alone is much faster."""
    rig: Rig | None = None
    spot_sigma_px: float = 0.0105
    centre_world: Float | None = None
    """`rig`, `spot_sigma_px`, `centre_world`: for "bundle": cameras, px, ball centre (3,), mm."""


@dataclass(frozen=True, slots=True)
class StudyResult:
    """Errors of all runs, in order."""

    centre_errors: Float
    """(r, 3), mm: estimated minus true ball centre, world."""
    tip_errors: Float
    """(r, 3), mm: tip in the LED frame, relevant in use; NaN without LEDs."""
    led_errors: Float
    """(r,), mm: mean distance of averaged from true LEDs (figure 15); NaN without LEDs."""
    cpu_s: float

    @property
    def distances(self) -> Float:
        """Return the norms of the centre errors (r,), mm (figure 14)."""
        distances: Float = np.linalg.norm(self.centre_errors, axis=1)
        return distances


def draw_angles(study: ProbeStudy, rng: np.random.Generator, count: int) -> Float:
    """Return angles (3, count), rad, float32."""
    drawn = rng.random((3, count), dtype=np.float32) * 2.0 - 1.0
    return (drawn * study.ranges[:, None]).astype(np.float32)


def draw_targets(study: ProbeStudy, rng: np.random.Generator) -> tuple[Float, Float]:
    """Return moments (L, 13) of a run's paths, and targets (n, L, 3), mm, or none if unwanted."""
    n_leds = len(study.leds)
    moments = np.zeros((n_leds, 13))
    points = np.empty((study.poses if study.with_leds else 0, n_leds, 3))
    for first in range(0, study.poses, _CHUNK):
        count = min(_CHUNK, study.poses - first)
        angles = draw_angles(study, rng, count)
        noise = rng.standard_normal((3 * n_leds, count), dtype=np.float32)
        add_paths(
            np.sin(angles), np.cos(angles), noise, study.leds, study.sigma, first,
            np.empty((9, count), dtype=np.float32), moments, points,
        )  # fmt: skip
    return moments, points


def run_once(study: ProbeStudy, seed: np.random.SeedSequence) -> tuple[Float, Float, float]:
    """Return the errors of one run: centre (3,), tip (3,) and mean LED, mm."""
    rng = np.random.default_rng(seed)
    if study.estimator == "bundle":
        return _run_bundle(study, rng)
    moments, points = draw_targets(study, rng)
    if study.estimator == "thesis":
        centre: Float = sphere_centres(moments, study.leds).mean(axis=0)
    else:
        centre = common_centre(moments, study.leds)
    if not study.with_leds:
        return centre, np.full(3, np.nan), np.nan
    return centre, *_led_errors(study, group_average(points, centre))


def run_study(
    study: ProbeStudy,
    runs: int,
    seed: int,
    processes: int | None = None,
    progress: Callable[[int], None] = lambda done: None,
    site: Site = HERE,
) -> StudyResult:
    """Return the errors of many runs, independent of their distribution.

    ``processes`` are on this computer; None lets the site decide, one runs everything in this
    process. OcmmError if a run failed, or the site cannot be used.
    """
    seeds = np.random.SeedSequence(seed).spawn(runs)
    parts = [slice(first, first + _RUNS_A_TASK) for first in range(0, runs, _RUNS_A_TASK)]
    rows, cpu = np.empty((runs, 7)), 0.0
    done = 0
    if processes is not None:
        site = Site(workers=processes)
    for part, values, seconds in _parts(study, seeds, parts, site):
        rows[part] = values
        cpu += seconds
        done += len(values)
        progress(done)
    return StudyResult(rows[:, :3], rows[:, 3:6], rows[:, 6], cpu)


def _parts(
    study: ProbeStudy, seeds: list[np.random.SeedSequence], parts: list[slice], site: Site
) -> Iterator[tuple[slice, Float, float]]:
    answers = run_tasks(
        partial(_run_some, study),
        [seeds[part] for part in parts],
        lambda some: f"Simulating {len(some)} calibrations",
        site=site,
    )
    for part, answer in zip(parts, answers, strict=True):
        if isinstance(answer, OcmmError):
            raise answer
        yield part, *answer


def _run_some(study: ProbeStudy, seeds: list[np.random.SeedSequence]) -> tuple[Float, float]:
    """Return rows of errors (m, 7) and their processor time."""
    began = time.process_time()
    found = [run_once(study, seed) for seed in seeds]
    rows = np.array([[*centre, *tip, led] for centre, tip, led in found])
    return rows, time.process_time() - began


def _led_errors(study: ProbeStudy, arms: Points3) -> tuple[Float, float]:
    """Return the tip error in the LED frame, and the mean error of the LEDs."""
    u, _, vt = np.linalg.svd(arms.T @ study.leds)
    turn = vt.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
    off = np.linalg.norm(arms @ turn.T - study.leds, axis=1)
    return rigid_fit(arms, study.leds)[1], float(off.mean())


def _run_bundle(study: ProbeStudy, rng: np.random.Generator) -> tuple[Float, Float, float]:
    assert study.rig is not None  # noqa: S101 - the command gives one with this estimator
    centre = np.zeros(3) if study.centre_world is None else study.centre_world
    sa, sb, sc = np.sin(angles := draw_angles(study, rng, study.poses).astype(np.float64))
    ca, cb, cc = np.cos(angles)
    rotations = np.array(
        [
            [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
            [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
            [-sb, cb * sa, cb * ca],
        ]
    ).transpose(2, 0, 1)
    points = np.einsum("nij,lj->nli", rotations, study.leds) + centre
    uv = np.stack([project(camera, points) for camera in study.rig.cameras], axis=1)
    uv += study.spot_sigma_px * rng.standard_normal(uv.shape)
    sweep = PivotSweep.even(uv, study.spot_sigma_px)
    found = adjust_pivot(study.rig, sweep, start_pivot(study.rig, sweep, seed=1).state).state
    return found.centre - centre, *_led_errors(study, found.arms)
