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

from ocmm_core.calibration.pivot import (
    PivotSweep,
    adjust_pivot,
    common_centre,
    group_average,
    sphere_centres,
    start_pivot,
)
from ocmm_core.camera import Rig, project
from ocmm_core.cluster import HERE, Site, run_tasks
from ocmm_core.errors import OcmmError
from ocmm_core.geometry import Float, Points3, rigid_fit
from ocmm_sim.scene._probe_study_kernel import add_paths

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
    s = arms.T @ study.leds
    u, _, vt = np.linalg.svd(s)
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
