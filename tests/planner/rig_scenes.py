"""Random rig plans, and the whole chain simulated, for tests and `benchmarks.rig_plan`."""

from __future__ import annotations

from dataclasses import dataclass, replace

import msgspec
import numpy as np

from ocmm_core.camera import project
from ocmm_core.documents import resource
from ocmm_core.geometry import Float
from ocmm_core.tracking import load_probe, solve
from ocmm_planner import (
    RigPlan,
    Scene,
    load_rig_plan,
    predict_tips,
    scene_of,
    shared_covariance,
    spots_of,
)
from ocmm_planner._plan import CameraPlace, attitudes_of, load_catalogue

CAMERAS = ("smart-2048", "imx174", "imx250", "imx304", "cmv4000-nir")


def given_plan(name: str = "thesis") -> RigPlan:
    return load_rig_plan(resource("rig_plans", f"{name}.toml"))


def changed(plan: RigPlan, **fields: object) -> RigPlan:
    """Return a plan with other fields of its document; cameras keep their types."""
    return replace(plan, document=msgspec.structs.replace(plan.document, **fields))


def random_plan(seed: int, spare: float = 1.0) -> RigPlan:
    """Return two to four equal cameras in front of a random volume, and a random probe.

    The lens is the longest one whose picture is ``spare`` times the volume with the probe.
    """
    rng = np.random.default_rng(seed)
    plan, (kinds, lenses) = given_plan(), load_catalogue()
    half = rng.uniform([100.0, 60.0, 100.0], [250.0, 200.0, 250.0])
    volume = {"volume_min": tuple(-half), "volume_max": tuple(half)}
    distance = rng.uniform(900.0, 2000.0)
    kind = kinds[str(rng.choice(CAMERAS))]
    sensor = min(kind.width_px, kind.height_px) * kind.pitch
    reach = 2.0 * spare * (float(half.max()) + 260.0)
    fitting = [lens for lens in lenses.values() if lens.id != "25mm-thesis"
               and sensor / lens.focal * (distance - half[1]) > reach]  # fmt: skip
    lens = max(fitting, key=lambda one: one.focal, default=lenses["8mm"])
    count = int(rng.integers(2, 5))
    across = np.linspace(-0.5, 0.5, count) * rng.uniform(0.4, 1.0) * distance
    cameras = []
    for index, x in enumerate(across):
        centre = (float(x), -distance, float(rng.uniform(-200.0, 400.0)))
        planned = plan.document.cameras[0]
        cameras.append(msgspec.structs.replace(
            planned, name=f"camera {index + 1}", camera=kind.id, lens=lens.id, centre=centre,
            place=None,
        ))  # fmt: skip
    # The LEDs, not the ball, must be inside the calibrated volume.
    more = np.array([80.0, 40.0, 0.0]), np.array([80.0, 40.0, 240.0])
    calibration = msgspec.structs.replace(
        plan.document.calibration, volume_min=tuple(-half - more[0]),
        volume_max=tuple(half + more[1]), spot_sigma_px=0.02, points=200,
    )  # fmt: skip
    probe = load_probe(resource("probes", f"{rng.choice(['thesis', 'standard'])}.toml"))
    changes = changed(plan, cameras=tuple(cameras), calibration=calibration, **volume)
    return replace(changes, cameras=(kind,) * count, lenses=(lens,) * count, probe=probe)


def search_scene(seed: int) -> RigPlan:
    """Return two cameras of `random_plan` that may be anywhere in a plane in front of it."""
    plan = random_plan(seed, spare=1.4)
    pair = (plan.document.cameras[0], plan.document.cameras[-1])
    y = pair[0].centre[1]
    places = (
        CameraPlace(min=(-900.0, y, -300.0), max=(-100.0, y, 500.0)),
        CameraPlace(min=(100.0, y, -300.0), max=(900.0, y, 500.0)),
    )
    cameras = tuple(msgspec.structs.replace(one, place=place)
                    for one, place in zip(pair, places, strict=True))  # fmt: skip
    hand = msgspec.structs.replace(plan.document.attitudes, tilt_deg=(15.0, 15.0, 10.0))
    found = changed(plan, cameras=cameras, search_nodes=(3, 2, 3), attitudes=hand)
    turns = attitudes_of(hand)
    return replace(found, cameras=plan.cameras[:2], lenses=plan.lenses[:2], turns=turns)


@dataclass(frozen=True, slots=True)
class Compared:
    """Predicted and simulated U (k = 2), mm: of the tip, longest half axis, and of a length."""

    tip: tuple[float, float]
    length: tuple[float, float]


def compare(plan: RigPlan, seed: int, draws: int) -> Compared | None:
    """Return both for a random measurable place and attitude; None if none of 50 is."""
    rng = np.random.default_rng(seed)
    scene = scene_of(plan, plan.places)
    low, high = plan.volume
    for _ in range(50):
        ends = low + (high - low) * rng.random((2, 3))
        turns = np.repeat(plan.turns[rng.integers(len(plan.turns))][None], 2, axis=0)
        tips = predict_tips(scene, turns, ends)
        if not tips.stage.any() and np.linalg.norm(ends[1] - ends[0]) > 50.0:
            break
    else:
        return None
    errors = simulated_errors(scene, turns, ends, draws, rng)
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    common = shared_covariance(scene)
    shared = along @ (tips.by_shared[1] - tips.by_shared[0])
    own = along @ (tips.own[0] + tips.own[1]) @ along
    found = np.mean(errors[:, 0, :, None] * errors[:, 0, None, :], axis=0)
    lengths = np.linalg.norm((ends + errors)[:, 1] - (ends + errors)[:, 0], axis=1)
    off = lengths - np.linalg.norm(ends[1] - ends[0])
    covariance = tips.own[0] + tips.by_shared[0] @ common @ tips.by_shared[0].T
    predicted = 2.0 * float(np.sqrt(shared @ common @ shared + own))
    return Compared(
        (_half_axis(covariance), _half_axis(found)),
        (predicted, 2.0 * float(np.sqrt(np.mean(off**2)))),
    )


def simulated_errors(
    scene: Scene, turns: Float, tips_world: Float, draws: int, rng: np.random.Generator
) -> Float:
    """Return errors (draws, n, 3), mm, of solved tips: true cameras, probe and spots are drawn."""
    plan, rig, body = scene.plan, scene.rig, scene.plan.probe
    spots = spots_of(scene, turns, tips_world)
    sigma = np.sqrt(spots.white / plan.document.measuring.frames)[..., None]
    patterns = [_pattern(scene, index, spots.uv[:, index]) for index in range(len(rig.cameras))]
    uv = np.empty((draws, *spots.uv.shape))
    tips = np.empty((draws, *tips_world.shape))
    by_camera = np.linalg.cholesky(rig.parameter_covariance)
    by_probe = np.linalg.cholesky(body.geometry_covariance)
    for draw in range(draws):
        off = (by_probe @ rng.standard_normal(len(by_probe))).reshape(-1, 3)
        origins = tips_world - turns @ body.tip_probe
        tips[draw] = turns @ (body.tip_probe + off[-1]) + origins
        leds = np.einsum("nij,lj->nli", turns, body.leds_probe + off[:-1]) + origins[:, None]
        changes = (by_camera @ rng.standard_normal(len(by_camera))).reshape(-1, 14)
        for index, camera in enumerate(rig.cameras):
            root = patterns[index]
            uv[draw, :, index] = project(camera.perturbed(changes[index]), leds)
            drawn = root @ rng.standard_normal((len(root), 2))
            uv[draw, :, index] += drawn.reshape(*leds.shape[:2], 2)
    uv += sigma * rng.standard_normal(uv.shape)
    uv[:, spots.stage != 0] = np.nan
    flat = uv.reshape(-1, *spots.uv.shape[1:])
    found = solve(flat, rig, body, 0.02)
    assert not found.status.any()
    return found.tip_world.reshape(tips.shape) - tips


def _pattern(scene: Scene, index: int, uv: Float) -> Float:
    """Return a root of the covariance of the sensor pattern at spots (n, L, 2), px.

    Gaussian over the distance on the sensor, as the virtual rig has it; the prediction takes spots
    of different LEDs as independent.
    """
    places = np.nan_to_num(uv.reshape(-1, 2), nan=-1e6)
    squares = np.sum((places[:, None] - places) ** 2, axis=2)
    length = scene.rig.noise.pattern_length_px
    covariance = np.exp(-0.5 * squares / length**2) + 1e-9 * np.eye(len(places))
    root: Float = scene.plan.cameras[index].pattern_px * np.linalg.cholesky(covariance)
    return root


def _half_axis(covariance: Float) -> float:
    return 2.0 * float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
