"""Predicted spots of a planned rig, its uncertainty over the volume, and its best placement.

The tip is the least-squares pose of its spots, so that to first order its error is the derivative
(`tracking.tip_derivatives`) by spots, cameras and probe times their errors (GUM 5.1.2).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.optimize import Bounds, differential_evolution

from ocmm_core.camera import Rig, on_sensor, project
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking import tip_derivatives
from ocmm_core.tracking.kernels import MAX_TIP_SIGMA
from ocmm_planner._plan import RigPlan

LEAST_LEDS = 4
"""LEDs seen by two cameras; fewer cannot be identified reliably."""
LINE = 6
"""Obstacle, next to the others: enough LEDs are seen, but they are close to one line."""
_CHUNK = 2000
_K = 2.0


@dataclass(frozen=True, slots=True)
class Tips:
    """Predicted tips of n poses; rows without a tip are NaN."""

    stage: Int
    """(n,): `SEEN`, or the most frequent obstacle, or `LINE`."""
    leds: Int
    """(n,): LEDs seen by two cameras."""
    own: Float
    """(n, 3, 3), mm^2: covariance by noise of its own spots."""
    by_shared: Float
    """(n, 3, m): derivatives by the errors of cameras and probe, see `shared_covariance`."""
    light: Float
    """(n, 3): largest blur, px, faintest and brightest pixel by the saturation, of seen spots."""


@dataclass(frozen=True, slots=True)
class RigMap:
    """Prediction at n nodes; U is expanded (k = 2), mm, NaN if none."""

    nodes: Float
    """(n, 3), mm, frame of the document."""
    u_tip: Float
    """(n,): longest half axis, the largest over the attitudes."""
    u_length: Float
    """(n,): of the length of the plan, the largest of X, Y and Z, probe upright at both ends."""
    stage: Int
    """(n,): 0, or the obstacle of the first attitude without a tip."""
    leds: Int
    leds_mean: Float
    """`leds`, `leds_mean`: (n,): seen by two cameras; fewest and mean over the attitudes."""
    share: Float
    """(n,): part of the attitudes that give a tip."""
    light: Float
    """(n, 3): extremes over the attitudes, see `Tips`."""


def shared_covariance(scene: Scene) -> Float:
    """Return the covariance (m, m) of cameras and probe, common to all tips of a rig."""
    found: Float = block_diag(scene.rig.parameter_covariance, scene.plan.probe.geometry_covariance)
    return found


def predict_tips(scene: Scene, rotations: Float, tips_world: Float) -> Tips:
    """Return the predicted tips of poses (n, 3, 3) and (n, 3), mm, world from probe and balls."""
    spots, rig = spots_of(scene, rotations, tips_world), scene.rig
    seen, n = spots.stage == SEEN, len(rotations)
    leds = np.count_nonzero(np.count_nonzero(seen, axis=1) >= 2, axis=1)
    # The most frequent reason why a camera does not see an LED.
    hidden = [np.count_nonzero(spots.stage == kind, axis=(1, 2)) for kind in range(1, LINE)]
    stage: Int = 1 + np.argmax(hidden, axis=0)
    good = np.flatnonzero(leds >= LEAST_LEDS)
    tips = tip_derivatives(spots.uv[good], rig, scene.plan.probe)
    # Seen spots are listed first; the derivatives of the rest are 0.
    size = tips.by_spots.shape[2] // 2
    order = np.argsort(~seen[good].reshape(len(good), size), axis=1, kind="stable")

    def by_noise(variances: Float) -> Float:
        listed = np.take_along_axis(variances.reshape(len(good), size), order, axis=1)
        scaled = tips.by_spots * np.repeat(listed, 2, axis=1)[:, None]
        found: Float = scaled @ tips.by_spots.transpose(0, 2, 1)
        return found

    # The pattern of one sensor is correlated over the distance of spots, as in a job.
    uv = np.nan_to_num(spots.uv[good].reshape(len(good), size, 2))
    uv = np.take_along_axis(uv, order[:, :, None], axis=1)
    camera = order // seen.shape[2]
    sigma = np.array([one.pattern_px for one in scene.plan.cameras])[camera]
    squares = np.sum((uv[:, :, None] - uv[:, None]) ** 2, axis=3)
    alike = np.exp(-0.5 * squares / rig.noise.pattern_length_px**2)
    alike *= (camera[:, :, None] == camera[:, None]) * sigma[:, :, None] * sigma[:, None]
    u, v = tips.by_spots[:, :, 0::2], tips.by_spots[:, :, 1::2]
    pattern = u @ alike @ u.transpose(0, 2, 1) + v @ alike @ v.transpose(0, 2, 1)
    white = by_noise(spots.white[good])
    # The kernel refuses each frame by its own noise.
    frame = np.einsum("nii->n", white + pattern)
    stage[good] = np.where(tips.answered & (frame <= MAX_TIP_SIGMA**2), SEEN, LINE)
    own = np.full((n, 3, 3), np.nan)
    own[good] = white / scene.plan.document.measuring.frames + pattern
    by_shared = np.full((n, 3, tips.by_cameras.shape[2] + tips.by_geometry.shape[2]), np.nan)
    by_shared[good] = np.concatenate([tips.by_cameras, tips.by_geometry], axis=2)
    own[stage != SEEN] = by_shared[stage != SEEN] = np.nan
    light = [
        sign * np.where(seen, sign * values, -np.inf).max(axis=(1, 2))
        for sign, values in ((1.0, spots.blur_px), (-1.0, spots.peak), (1.0, spots.peak))
    ]
    return Tips(stage, leds, own, by_shared, np.stack(light, axis=1))


def predict_map(
    scene: Scene, nodes: Float, step: Callable[[float], None] = lambda share: None, *,
    with_length: bool = True,
) -> RigMap:  # fmt: skip
    """Return the prediction at nodes (n, 3), mm; ``step`` gets the finished share."""
    parts = []
    each = max(1, _CHUNK // len(scene.plan.turns))
    for start in range(0, len(nodes), each):
        step(start / len(nodes))
        parts.append(_some(scene, nodes[start : start + each], with_length=with_length))
    return RigMap(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _some(scene: Scene, nodes: Float, *, with_length: bool) -> tuple[Float, ...]:
    turns, common = scene.plan.turns, shared_covariance(scene)
    n, a = len(nodes), len(turns)
    tips = predict_tips(scene, np.tile(turns, (n, 1, 1)), np.repeat(nodes, a, axis=0))
    good, leds = (tips.stage == SEEN).reshape(n, a), tips.leds.reshape(n, a)
    half, flat = np.full(n * a, -np.inf), good.ravel()
    by_shared = tips.by_shared[flat]
    covariance = tips.own[flat] + by_shared @ common @ by_shared.transpose(0, 2, 1)
    half[flat] = _K * np.sqrt(np.linalg.eigvalsh(covariance)[:, -1])
    share = good.mean(axis=1)
    enough = (share >= scene.plan.document.attitudes.share - 1e-9) & good.any(axis=1)
    lost = tips.stage.reshape(n, a)[np.arange(n), (~good).argmax(axis=1)]
    length = _lengths(scene, nodes, tips, common) if with_length else np.full(n, np.nan)
    light = tips.light.reshape(n, a, 3) * [1.0, -1.0, 1.0]
    return (
        nodes, np.where(enough, half.reshape(n, a).max(axis=1), np.nan),
        np.where(enough, length, np.nan), np.where(enough, SEEN, lost),
        leds.min(axis=1), leds.mean(axis=1), share, light.max(axis=1) * [1.0, -1.0, 1.0],
    )  # fmt: skip


def _lengths(scene: Scene, nodes: Float, tips: Tips, common: Float) -> Float:
    """Return the largest U of the lengths from nodes along X, Y and Z towards the middle, (n,)."""
    plan, upright = scene.plan, len(scene.plan.turns)
    low, high = plan.volume
    worst = np.full(len(nodes), np.nan)
    for axis in range(3):
        ends = nodes.copy()
        inwards = np.where(nodes[:, axis] > 0.5 * (low + high)[axis], -1.0, 1.0)
        ends[:, axis] += inwards * plan.document.length
        inside = ((ends >= low - 1e-9) & (ends <= high + 1e-9)).all(axis=1) & ~plan.inside_box(ends)
        far = predict_tips(scene, np.tile(plan.turns[0], (int(inside.sum()), 1, 1)), ends[inside])
        rows = (far.by_shared - tips.by_shared[::upright][inside])[:, axis]
        own = (far.own + tips.own[::upright][inside])[:, axis, axis]
        found = _K * np.sqrt(own + np.einsum("nm,nm->n", rows @ common, rows))
        worst[inside] = np.fmax(worst[inside], found)
    return worst


SEEN, OUTSIDE, AWAY, BLOCKED, BLURRED, DARK = range(6)
"""Whether a camera sees an LED, or the first reason why not."""

_PLANCK_J_S, _LIGHT_M_S = 6.62607015e-34, 2.99792458e8
_AIRY_SIGMA = 0.42
"""Standard deviation of the Gaussian next to an Airy disc, by wavelength times stop."""
_FULL = 0.7
"""Brightest pixel of the nearest spot, by the saturation."""
_LEAST_PEAK = 10.0
"""Brightest pixel of a usable spot, by the read noise."""
_PIXEL = 1.0 / 12.0
"""Variance of a position within a pixel, px^2."""


@dataclass(frozen=True, slots=True)
class Scene:
    """A plan with its cameras placed."""

    plan: RigPlan
    places: Float
    """(C, 6), mm: projection centres and targets."""
    rig: Rig
    focus: Float
    """(C,), mm: distance of best focus along the axis."""
    exposure_us: Float
    """(C,): shortened so that the nearest possible spot does not saturate; NaN without light."""


@dataclass(frozen=True, slots=True)
class PlannedSpots:
    """Spots of n poses, each (n, C, L)."""

    uv: Float
    """(n, C, L, 2), px; NaN unless seen."""
    stage: NDArray[np.int8]
    """`SEEN` or why not."""
    white: Float
    """px^2: variance of one exposure, each axis."""
    blur_px: Float
    """Diameter of the defocus."""
    peak: Float
    """Brightest pixel by the saturation; NaN without light."""


def scene_of(plan: RigPlan, places: Float) -> Scene:
    """Return a plan with cameras at places (C, 6), see `Scene`; InputError as `RigPlan.rig`."""
    aims = np.linalg.norm(places[:, 3:] - places[:, :3], axis=1)
    stated = [one.focus or np.nan for one in plan.document.cameras]
    # A lens does not focus nearer than twice its focal length.
    nearest = np.array([2.0 * lens.focal for lens in plan.lenses])
    focus: Float = np.maximum(np.where(np.isnan(stated), aims, stated), nearest)
    scene = Scene(plan, places, plan.rig(places), focus, np.ones(len(places)))
    exposures, light = np.full(len(places), np.nan), plan.document.light
    if light is not None:
        reach = np.linalg.norm(plan.probe.leds_probe - plan.probe.tip_probe, axis=1).max()
        gaps = np.linalg.norm(places[:, :3] - np.clip(places[:, :3], *plan.volume), axis=1)
        near = np.maximum(gaps - reach, 1.0)
        for index in range(len(places)):
            at = slice(index, index + 1)
            # In focus, where its brightest pixel is brightest.
            peak = _spots_in(scene, index, near[at], focus[at], np.ones(1))[2]
            exposures[index] = min(light.exposure_us, _FULL / float(peak[0]))
    return replace(scene, exposure_us=exposures)


def calibrated_scene(plan: RigPlan, rig: Rig) -> Scene:
    """Return a plan with the cameras of a calibrated rig, in their order, and their covariance.

    InputError if the rig has other sensors than the plan.
    """
    if not plan.describes(rig):
        raise InputError(
            "rig_plan.other_rig",
            f"{plan.path}: the sensors are not those of rig '{rig.name}', in the order of its "
            "document.",
            "Choose the plan of this rig.",
        )
    centres = np.stack([camera.centre_world for camera in rig.cameras])
    ahead = np.stack([camera.T_camera_from_world.rotation[2] for camera in rig.cameras])
    aims = np.linalg.norm(plan.places[:, 3:] - plan.places[:, :3], axis=1)
    scene = scene_of(plan, np.hstack([centres, centres + aims[:, None] * ahead]))
    as_found = replace(
        scene.rig, cameras=rig.cameras, parameter_covariance=rig.parameter_covariance
    )
    return replace(scene, rig=as_found)


def spots_of(scene: Scene, rotations: Float, tips_world: Float) -> PlannedSpots:
    """Return the spots of poses (n, 3, 3) and (n, 3), mm, world from probe and ball centres."""
    plan, body = scene.plan, scene.plan.probe
    arms = body.leds_probe - body.tip_probe
    leds = np.einsum("nij,lj->nli", rotations, arms) + tips_world[:, None]
    light = np.einsum("nij,lj->nli", rotations, body.led_directions_probe)
    shape = (len(leds), len(scene.rig.cameras), body.n_leds)
    uv, stage = np.empty((*shape, 2)), np.full(shape, SEEN, np.int8)
    white, blur, peak = (np.empty(shape) for _ in range(3))
    for index, camera in enumerate(scene.rig.cameras):
        ray = scene.places[index, :3] - leds
        distance = np.sqrt(np.einsum("nli,nli->nl", ray, ray))
        facing = np.einsum("nli,nli->nl", ray, light) / distance
        depth = np.maximum(-ray @ camera.T_camera_from_world.rotation[2], 1.0)
        white[:, index], blur[:, index], peak[:, index], dark = _spots_in(
            scene, index, distance, depth, facing
        )
        uv[:, index] = places = project(camera, leds)
        radius = np.linalg.norm(places - [camera.u0, camera.v0], axis=2) * camera.pitch_mm
        # The reason that remains is the one to remove first.
        found = stage[:, index]
        found[dark] = DARK
        found[blur[:, index] > plan.document.measuring.most_blur_px] = BLURRED
        found[_blocked(plan.boxes, leds, ray)] = BLOCKED
        found[facing <= np.cos(body.emission_half_angle)] = AWAY
        found[:, list(plan.hidden_leds)] = AWAY
        inside = on_sensor(camera, places) & (radius <= 0.5 * plan.lenses[index].image_circle)
        found[~inside] = OUTSIDE
    uv[stage != SEEN] = np.nan
    return PlannedSpots(uv, stage, white, blur, peak)


def _spots_in(
    scene: Scene, index: int, distance: Float, depth: Float, facing: Float
) -> tuple[Float, Float, Float, NDArray[np.bool_]]:
    """Return variance, px^2, blur, px, peak, and whether it is too dark, in one camera.

    ``distance`` and ``depth`` of LEDs, mm; ``facing``: cosine between light and ray.
    """
    plan, planned = scene.plan, scene.plan.document.cameras[index]
    camera, lens, focus = plan.cameras[index], plan.lenses[index], scene.focus[index]
    defocus = np.abs(depth - focus) / (depth * (focus - lens.focal))
    blur = np.broadcast_to(lens.focal**2 / planned.stop * defocus / camera.pitch, facing.shape)
    floor, light = np.full_like(facing, camera.white_px**2), plan.document.light
    if light is None:
        return floor, blur, np.full_like(facing, np.nan), np.zeros(facing.shape, np.bool_)
    airy = _AIRY_SIGMA * 1e-6 * light.wavelength_nm * planned.stop
    chip = light.chip * lens.focal / depth / np.sqrt(12.0)
    # A uniform disc has a standard deviation of a quarter of its diameter, each axis.
    variance = (airy**2 + chip**2) / camera.pitch**2 + (0.25 * blur) ** 2
    # The LED radiates by the cosine law, and the ray sees the aperture under an angle.
    cosines = np.maximum(facing, 1e-3) * np.minimum(depth / distance, 1.0)
    solid_angle = 0.25 * np.pi * (lens.focal / planned.stop) ** 2 * cosines / distance**2
    joules = 1e-9 * light.intensity_mw_sr * light.transmission * solid_angle
    per_joule = 1e-9 * light.wavelength_nm / (_PLANCK_J_S * _LIGHT_M_S)
    electrons = joules * per_joule * camera.quantum_efficiency * scene.exposure_us[index]
    peak = electrons / (2.0 * np.pi * (variance + _PIXEL))
    read = 8.0 * np.pi * variance**2 * (camera.read_noise_e / electrons) ** 2
    white = floor + (variance + _PIXEL) / electrons + read
    return white, blur, peak / camera.saturation_e, peak < _LEAST_PEAK * camera.read_noise_e


def _blocked(boxes: Float, points: Float, way: Float) -> NDArray[np.bool_]:
    """Return whether a box is on the way (..., 3) from points to a camera."""
    blocked = np.zeros(points.shape[:-1], np.bool_)
    # A ray parallel to a side crosses it infinitely far away.
    way = np.where(np.abs(way) < 1e-9, 1e-9, way)
    for box in boxes:
        crossed = (box[:, None, None] - points) / way
        enters, leaves = crossed.min(axis=0).max(axis=-1), crossed.max(axis=0).min(axis=-1)
        blocked |= np.maximum(enters, 0.0) < np.minimum(leaves, 1.0)
    return blocked


_POPULATION = 10
"""Placements of a generation, for each coordinate that is sought."""
_UNSEEN = 1e3
"""Cost, mm, of a placement that leaves nodes without a number: seen nodes never outweigh it."""


def search_places(
    plan: RigPlan, *, seed: int, evaluations: int, step: Callable[[float], None]
) -> tuple[Float, int]:
    """Return the places (C, 6), mm, with the smallest worst U found, and the number of trials.

    U is that of the tip at the search nodes. Differential evolution (Storn and Price 1997) over the
    coordinates that may change; the given placement is one of the first generation.
    """
    given = plan.places
    least, most = given.copy(), given.copy()
    for row, one in enumerate(plan.document.cameras):
        if one.place is not None:
            least[row, :3], most[row, :3] = one.place.min, one.place.max
        if one.place is not None and one.place.aim == "free":
            least[row, 3:], most[row, 3:] = plan.volume
    free = most > least
    if not free.any():
        return given, 0
    nodes, tried = plan.nodes(plan.document.search_nodes), 0
    given = np.clip(given, least, most)

    def placed(values: Float) -> Float:
        moved = given.copy()
        moved[free] = values
        return moved

    def cost(values: Float) -> float:
        nonlocal tried
        tried += 1
        step(min(1.0, tried / evaluations))
        return placement_cost(plan, placed(values), nodes)

    # A Sobol sequence has a power of two.
    size = 1 << (max(5, _POPULATION * int(free.sum())) - 1).bit_length()
    found = differential_evolution(
        cost, Bounds(least[free], most[free]), x0=given[free], rng=np.random.default_rng(seed),
        polish=False, tol=1e-3, popsize=_POPULATION, init="sobol",
        maxiter=max(1, evaluations // size - 1),
    )  # fmt: skip
    return placed(found.x), tried


def placement_cost(plan: RigPlan, places: Float, nodes: Float) -> float:
    """Return the worst U of the tip at nodes (n, 3), mm; far more if a node has none."""
    if plan.inside_box(places[:, :3]).any():
        return 10.0 * _UNSEEN
    try:
        return cost_of(predict_map(scene_of(plan, places), nodes, with_length=False))
    except InputError:
        # The calibration points are outside its picture.
        return 5.0 * _UNSEEN


def cost_of(found: RigMap) -> float:
    """Return the worst U, mm; without one at some nodes, a cost that falls with their number."""
    if np.isfinite(found.u_tip).all():
        return float(found.u_tip.max())
    # The share of attitudes also guides a placement that sees no node completely.
    seen = 0.5 * found.share + 0.5 * np.isfinite(found.u_tip)
    return _UNSEEN * float(2.0 - seen.mean())
