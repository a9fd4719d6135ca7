"""Tips that touch a sphere and rest in a cone, many times, with wrong cameras and probe.

Places of the touches and attitudes of the probe are planned a few times; the sensitivity of the
tips to errors is computed once for each plan. Cameras, LEDs, tip and spots are drawn for every run,
and tips are computed from the spots.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.guided import RestingTouch, touch_of
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import Sphere, TipRecord, load_sphere
from ocmm_core.calibration.tip import (
    CHECK_RINGS,
    QUALIFICATION_RINGS,
    TipLimits,
    frame_about,
    sphere_layout,
)
from ocmm_core.calibration.tip._check import DIAMETER_SIGMA_MM, TipCheckDecision, decide_check
from ocmm_core.calibration.tip._fit import (
    BallFit,
    fit_ball_on,
    predicted_errors,
    sigma_of_difference,
    sigma_with_sphere,
)
from ocmm_core.calibration.tip._sphere_layout import Rings, cone_layout, round_equator
from ocmm_core.camera import Rig, load_rig, project
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, Points3, rotation_from_vector, unit
from ocmm_core.tracking import ProbeBody, load_probe, solve
from ocmm_sim.scene import attitude_at
from tests.core.calibration.made_probe_records import make_probe_record, make_tip_record
from tests.core.calibration.swept_probe import disturbed

SIGMA_PX = 0.0105
ROOM = Temperature(20.0, 0.3, "")
CENTRE_WORLD, CONE_WORLD = np.array([-40.0, 0.0, -110.0]), np.array([60.0, 20.0, -120.0])
POLE = np.array([0.0, 0.0, 1.0])
_HAND_RAD = np.radians(4.0)
_PLACE_RAD = np.radians(4.0)


@dataclass(frozen=True, slots=True)
class Plan:
    """Touches without noise: where, how the probe is held, and how the tips answer to errors."""

    directions: Points3
    rotations: Float
    touches: tuple[RestingTouch, ...]

    def __add__(self, other: Plan) -> Plan:
        return Plan(
            np.concatenate([self.directions, other.directions]),
            np.concatenate([self.rotations, other.rotations]),
            (*self.touches, *other.touches),
        )


@dataclass(frozen=True, slots=True)
class Fault:
    """Error of the tip, mm."""

    diameter: float = 0.0
    length: float = 0.0


@dataclass(frozen=True, slots=True)
class Truth:
    """One world: cameras, LEDs and tip as they are."""

    rig: Rig
    leds: Points3
    tip: Float


@dataclass(slots=True)
class TipWorld:
    """A rig and a probe by their documents, a sphere, and plans of touches."""

    rig: Rig
    body: ProbeBody
    sphere: Sphere

    @classmethod
    def of(cls, rig: str = "recommended", probe: str = "standard") -> TipWorld:
        return cls(
            load_rig(resource("rigs", f"{rig}.toml")),
            load_probe(resource("probes", f"{probe}.toml")),
            load_sphere(resource("artefacts", "sphere.toml")),
        )

    @property
    def reach(self) -> float:
        return 0.5 * self.sphere.diameter + self.body.tip_radius

    def on_sphere(
        self,
        rings: Rings,
        rng: np.random.Generator,
        sigma_limit: float,
        against: TipRecord | None = None,
    ) -> Plan:
        """Return touches in a layout, and more on the equator until the diameter is determined."""
        frame = frame_about(POLE, self.rig)
        plan = self._touching(sphere_layout(rings, frame).directions, rng)
        while self.sigma(plan, against) > sigma_limit and len(plan.touches) < 60:
            candidates = round_equator(frame)
            sigmas = [self.sigma(plan, against, one[None]) for one in candidates]
            plan = plan + self._touching(candidates[[int(np.argmin(sigmas))]], rng)
        return plan

    def in_cone(self, rng: np.random.Generator) -> Plan:
        handles = cone_layout(frame_about(POLE, self.rig)).directions
        rotations = []
        for handle in handles:
            axis = np.cross(POLE, handle)
            sine = float(np.linalg.norm(axis))
            turn = axis / sine * np.arctan2(sine, handle[2]) if sine > 1e-9 else np.zeros(3)
            rotations.append(rotation_from_vector(turn + rng.normal(0.0, _HAND_RAD / 2.0, 3)))
        balls = np.broadcast_to(CONE_WORLD, (len(handles), 3))
        return self._plan(np.zeros_like(balls), np.array(rotations), balls)

    def sigma(
        self, plan: Plan, against: TipRecord | None = None, more: Points3 | None = None
    ) -> float:
        """Return the predicted standard uncertainty of a diameter or of a difference, mm."""
        errors = predicted_errors(
            plan.touches, plan.directions, self.rig, self.body,
            np.empty((0, 3)) if more is None else more,
        )  # fmt: skip
        assert errors is not None
        if against is None:
            return sigma_with_sphere(errors, self.sphere, ROOM, self.rig, self.body)
        return sigma_of_difference(errors, self.sphere, ROOM, against, self.rig, self.body)

    def qualified(self, plan: Plan) -> TipRecord:
        """Return a qualification of a plan as it is without any error."""
        return record_of(self.ball(plan.touches), self)

    def draw(self, rng: np.random.Generator) -> Truth:
        off = rng.multivariate_normal(
            np.zeros(len(self.body.geometry_covariance)), self.body.geometry_covariance
        )
        return Truth(
            disturbed(self.rig, rng),
            self.body.leds_probe + off[:-3].reshape(-1, 3),
            self.body.tip_probe + off[-3:],
        )

    def seen(
        self, plan: Plan, truth: Truth, rng: np.random.Generator, fault: Fault | None = None
    ) -> Float:
        """Return the spots (n, C, L, 2), px, of a plan in one world."""
        fault = fault or Fault()
        reach = self.reach + 0.5 * fault.diameter
        # A plan in the cone has no directions, and its ball always rests in the same place.
        in_cone = ~np.any(plan.directions, axis=1, keepdims=True)
        balls = np.where(in_cone, CONE_WORLD, CENTRE_WORLD + reach * plan.directions)
        tip = truth.tip - np.array([0.0, 0.0, fault.length])
        points = np.einsum("nij,lj->nli", plan.rotations, truth.leds - tip) + balls[:, None]
        uv = np.stack([project(camera, points) for camera in truth.rig.cameras], axis=1)
        noisy: Float = uv + SIGMA_PX * rng.standard_normal(uv.shape)
        return noisy

    def touched(
        self, plan: Plan, truth: Truth, rng: np.random.Generator, fault: Fault | None = None
    ) -> tuple[RestingTouch, ...]:
        """Return the touches of a plan as they are seen in one world."""
        tips = solve(self.seen(plan, truth, rng, fault), self.rig, self.body, SIGMA_PX).tip_world
        return tuple(
            replace(touch, tip_world=one) for touch, one in zip(plan.touches, tips, strict=True)
        )

    def ball(self, touches: tuple[RestingTouch, ...]) -> BallFit:
        return fit_ball_on(touches, self.sphere, self.rig, self.body, ROOM)

    def check(
        self,
        touches: tuple[RestingTouch, ...],
        cone: tuple[RestingTouch, ...],
        qualification: TipRecord,
    ) -> TipCheckDecision:
        return decide_check(touches, cone, self.sphere, qualification, self.rig, self.body, ROOM)

    def _touching(self, directions: Points3, rng: np.random.Generator) -> Plan:
        off = directions + _PLACE_RAD * rng.standard_normal(directions.shape)
        normals = unit(off)
        rotations = []
        for normal in normals:
            lean, yaw = rng.normal(0.0, _HAND_RAD, 2), float(rng.normal(0.0, _HAND_RAD))
            rotations.append(rotation_from_vector(attitude_at(normal, lean, yaw, bore=False)))
        return self._plan(normals, np.array(rotations), CENTRE_WORLD + self.reach * normals)

    def _plan(self, directions: Points3, rotations: Float, balls: Points3) -> Plan:
        arms = self.body.leds_probe - self.body.tip_probe
        touches = []
        for rotation, ball in zip(rotations, balls, strict=True):
            points = arms @ rotation.T + ball
            uv = np.stack([project(camera, points) for camera in self.rig.cameras])
            touches.append(touch_of(uv, SIGMA_PX, self.rig, self.body))
        return Plan(directions, rotations, tuple(touches))


@dataclass(frozen=True, slots=True)
class CheckPlan:
    """One qualification and one check of it."""

    qualification: Plan
    sphere: Plan
    cone: Plan


def check_plans(world: TipWorld, count: int, seed: int) -> list[CheckPlan]:
    """Return plans whose qualification and check are as the procedures ask for."""
    rng = np.random.default_rng(seed)
    plans = []
    for _ in range(count):
        first = world.on_sphere(QUALIFICATION_RINGS, rng, TipLimits().diameter_sigma)
        check = world.on_sphere(CHECK_RINGS, rng, DIAMETER_SIGMA_MM, world.qualified(first))
        plans.append(CheckPlan(first, check, world.in_cone(rng)))
    return plans


def qualified(diameter: float, sigma: float) -> TipRecord:
    """Return a qualification with a diameter and without its inputs."""
    return make_tip_record(make_probe_record(), diameter_mm=diameter, diameter_sigma_mm=sigma)


def record_of(ball: BallFit, world: TipWorld) -> TipRecord:
    """Return the record of a qualification."""
    return make_tip_record(
        make_probe_record(),
        diameter_mm=ball.diameter,
        diameter_sigma_mm=ball.diameter_sigma,
        noise_sigma_mm=ball.errors.noise,
        by_cameras=tuple(ball.errors.by_cameras.tolist()),
        by_geometry=tuple(ball.errors.by_geometry.tolist()),
        rig_identity=world.rig.identity,
        artefacts=(world.sphere.artefact.use,),
    )
