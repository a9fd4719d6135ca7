"""Jobs of a rig whose first camera is pushed between them, written into real job files.

The true cameras, the probe and the patterns of the sensors differ from what is believed by draws
from the covariances of the documents. The touches are those of the virtual operator on the quick
plan; each job has a part of its own, whose ball and step are made larger or smaller, and puts it
down a little otherwise. Spots are those of the true cameras with the pattern of the sensors and the
white noise of the mean of the frames. A point is stored as the station stores it: by the
calibration that is believed.
"""

from __future__ import annotations

import uuid
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from ocmm_core import __version__
from ocmm_core.calibration.records import (
    SCHEMA,
    VERIFICATION_SCHEMA,
    CalibrationStore,
    CameraRecord,
    Check,
    ResidualMap,
    VerificationRecord,
    canonical,
    entry_of,
    record_hash,
    rig_from_record,
    store_folder,
)
from ocmm_core.camera import N_PARAMETERS, CameraModel, Rig, load_rig, project
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, rotation_from_vector
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.plan import Plan, load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import MeasuredPoint, TouchCollector
from ocmm_core.storage import JobFile, JobHead, make_head
from ocmm_core.tracking import TrackingPipeline, load_probe, solve, spot_sigma_px
from ocmm_sim.scene import SpotPattern, VirtualRig, draw_pattern, load_part

PLAN = resource("plans", "quick.toml")
RIG = resource("rigs", "recommended.toml")
PROBE = resource("probes", "standard.toml")
DIAMETER, STEP, TOLERANCE = 19.989, 20.34, 0.08
_RATE_HZ = 500


@dataclass(frozen=True, slots=True)
class TruePart:
    """Truth of a part, mm: diameter of the ball and height of the step."""

    diameter: float = DIAMETER
    step: float = STEP

    @property
    def conforms(self) -> bool:
        """Return whether it is within its tolerances."""
        return max(abs(self.diameter - DIAMETER), abs(self.step - STEP)) <= TOLERANCE


def base_points(folder: Path, plan_file: Path = PLAN) -> tuple[MeasuredPoint, ...]:
    """Return the points of a plan as the virtual operator takes them."""
    plan, rig, body = load_plan(plan_file), load_rig(RIG), load_probe(PROBE)
    script = [(feature.name, feature.points) for feature in plan.features]
    part = load_part(resource("parts", "demo.toml"))
    virtual = VirtualRig(rig, body, part, script, seed=1, frame_rate_hz=_RATE_HZ)
    options = SessionOptions()
    collector = TouchCollector(1.0 / _RATE_HZ, options.point)
    frames = virtual.frames(0, virtual.n_frames)
    head = make_head(plan=plan_file, rig=RIG, probe=PROBE, operator="me", part="P", serial="1")
    with JobFile.create(folder / "base.job", head) as job:
        session = InspectionSession(plan, rig, body, job, options)
        for touch in collector.push(TrackingPipeline(rig, body).process(frames)):
            session.touches.record_touch(touch)
        return tuple(job.points())


class World:
    """A rig with its errors, its believed calibrations, and jobs that are measured with it.

    Parameters
    ----------
    base
        Points to take after (`base_points`).
    calibrations
        Where its calibrations are kept.
    seed
        Of all its draws.
    """

    def __init__(self, base: Sequence[MeasuredPoint], calibrations: Path, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self._base = base
        self.calibrations = calibrations
        self.plan: Plan = load_plan(PLAN)
        self._believed = load_rig(RIG)
        self._body = load_probe(PROBE)
        self.cameras = self._drawn(self._believed.cameras, -1.0)
        self._patterns = [
            draw_pattern(self._believed.noise, camera.width, camera.height, self._rng)
            for camera in self.cameras
        ]
        geometry = np.concatenate([self._body.leds_probe.ravel(), self._body.tip_probe])
        geometry = geometry + self._draw(self._body.geometry_covariance)
        self._leds, self._tip = geometry[:-3].reshape(-1, 3), geometry[-3:]
        self._radius = self._body.tip_radius + self._body.tip_radius_sigma * float(
            self._rng.standard_normal()
        )
        self.record = _record(self._believed.cameras, self._believed)
        self.store = CalibrationStore(store_folder(calibrations, self.record.rig))
        self._checks = 0
        self.store.accept(self.record, "technician", "new", datetime.now(UTC))
        self.verify()

    def push(self, turn: Float, shift: Float) -> None:
        """Turn the first camera by a rotation vector, rad, and shift it, mm."""
        change = np.zeros(N_PARAMETERS)
        change[:3], change[3:6] = turn, shift
        self.cameras = (self.cameras[0].perturbed(change), *self.cameras[1:])

    def verify(self, *, passed: bool = True) -> None:
        """Verify the calibration in force now."""
        self._checks += 1
        now = datetime.now(UTC)
        self.store.verify(
            _verification(str(self.store.active_hash), self._checks, now, passed=passed), now
        )

    def calibrate(self) -> None:
        """Calibrate the cameras at their present places, and verify the calibration."""
        record = _record(self._drawn(self.cameras, 1.0), self._believed, str(self._checks))
        self.store.accept(record, "technician", "new", datetime.now(UTC))
        self.verify()

    def measure(
        self, path: Path, part: TruePart, push_at: tuple[int, Float, Float] | None = None
    ) -> None:
        """Write the job of a part, measured by the calibration that was in force first.

        Parameters
        ----------
        push_at
            Before this point the first camera is pushed, by turn and shift as `push`.
        """
        head = JobHead(
            job_uuid=str(uuid.uuid4()),
            created_utc=datetime.now(UTC).isoformat(),
            software_version=__version__,
            operator="me",
            part="P",
            serial=path.stem,
            plan_text=PLAN.read_text(encoding="utf-8"),
            rig_text=canonical(self.record).decode("utf-8"),
            probe_text=PROBE.read_text(encoding="utf-8"),
        )
        spots, frames = [], [point.n_frames for point in self._base]
        for index, (rotation, tip) in enumerate(self._poses(part)):
            if push_at is not None and index == push_at[0]:
                self.push(*push_at[1:])
            spots.append(self._seen(rotation, tip, frames[index], self._base[index].seen))
        rig = rig_from_record(self.record)
        found = solve(np.stack(spots), rig, self._body, spot_sigma_px(rig))
        white = solve(np.stack(spots), rig, self._body, rig.noise.white_px)
        with JobFile.create(path, head) as job:
            job.change(
                append=[
                    replace(
                        point,
                        number=index + 1,
                        spots=spots[index],
                        tip_world=found.tip_world[index],
                        rotation_world_from_probe=found.rotation_world_from_probe[index],
                        random_covariance=white.tip_covariance[index] / point.n_frames,
                        tip_radius=self._body.tip_radius,
                    )
                    for index, point in enumerate(self._base)
                ]
            )

    def _poses(self, part: TruePart) -> Iterator[tuple[Float, Float]]:
        """Give attitude of the probe and true ball centre, mm, of every touch."""
        turn = rotation_from_vector(self._rng.normal(0.0, 0.02, 3))
        shift = self._rng.uniform(-8.0, 8.0, 3)
        up = self._normal("BED")
        ball = [point for point in self._base if point.feature == "SPHERE"]
        centre = np.mean([p.tip_world - _arm(p) * p.direction for p in ball], axis=0)
        bed = np.mean([p.tip_world @ up for p in self._base if p.feature == "BED"])
        for point in self._base:
            if point.feature == "SPHERE":
                away = 0.5 * part.diameter + self._radius
                out = point.tip_world - centre
                tip = centre + away * out / np.linalg.norm(out)
            else:
                height = bed + (part.step if point.feature == "BLOCK_TOP" else 0.0)
                tip = point.tip_world + (height - point.tip_world @ up) * up
            yield turn @ point.rotation_world_from_probe, turn @ tip + shift

    def _normal(self, feature: str) -> Float:
        tips = np.array([p.tip_world for p in self._base if p.feature == feature])
        normal = np.linalg.svd(tips - tips.mean(axis=0))[2][2]
        upward: Float = normal * np.sign(normal[2])
        return upward

    def _seen(self, rotation: Float, tip: Float, frames: int, seen: np.ndarray) -> Float:
        origin = tip - rotation @ self._tip
        leds = self._leds @ rotation.T + origin
        white = self._believed.noise.white_px / np.sqrt(frames)
        spots = []
        for camera, pattern, here in zip(self.cameras, self._patterns, seen, strict=True):
            uv = project(camera, leds)
            uv = uv + _at(pattern, uv) + self._rng.normal(0.0, white, uv.shape)
            spots.append(np.where(here[:, None], uv, np.nan))
        return np.stack(spots)

    def _drawn(self, cameras: Sequence[CameraModel], sign: float) -> tuple[CameraModel, ...]:
        """Return cameras that differ by a draw from the covariance of their calibration."""
        change = sign * self._draw(self._believed.parameter_covariance)
        rows = change.reshape(len(cameras), N_PARAMETERS)
        return tuple(camera.perturbed(row) for camera, row in zip(cameras, rows, strict=True))

    def _draw(self, covariance: Float) -> Float:
        scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
        factor = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        drawn: Float = factor @ self._rng.standard_normal(len(scale))
        return drawn


def _arm(point: MeasuredPoint) -> float:
    return 0.5 * DIAMETER + point.tip_radius


def _at(pattern: SpotPattern, uv: Float) -> Float:
    """Return the error of spots (n, 2), px, by bilinear interpolation."""
    at = uv / pattern.step_px
    low = np.clip(at.astype(int), 0, np.array(pattern.nodes.shape[:0:-1]) - 2)
    part = at - low
    u, v = low.T
    found = np.zeros_like(uv)
    for step_u in (0, 1):
        for step_v in (0, 1):
            weight = np.abs(1 - step_u - part[:, 0]) * np.abs(1 - step_v - part[:, 1])
            found += weight[:, None] * pattern.nodes[:, v + step_v, u + step_u].T
    return found


def _record(cameras: Sequence[CameraModel], rig: Rig, made_by: str = "technician") -> CameraRecord:
    empty = ResidualMap(columns=1, rows=1, mean_u_px=(0.0,), mean_v_px=(0.0,), count=(0,))
    now = datetime.now(UTC)
    low, high = rig.volume_world.tolist()
    return CameraRecord(
        schema=SCHEMA,
        rig=rig.name,
        method="known points",
        made_utc=now.isoformat(),
        valid_until_utc=now.replace(year=now.year + 1, day=1).isoformat(),
        made_by=made_by,
        software=__version__,
        temperature_c=20.0,
        frame_rate_hz=rig.frame_rate_hz,
        noise=rig.noise,
        cameras=tuple(entry_of(c, a) for c, a in zip(cameras, rig.aliases, strict=True)),
        covariance=tuple(tuple(row) for row in rig.parameter_covariance.tolist()),
        volume_min=tuple(low),
        volume_max=tuple(high),
        hull=((0.0, 0.0, 0.0),),
        residual_maps=(empty,) * len(cameras),
        rms_px=0.0105,
        chi2_per_dof=1.0,
        points=400,
        outliers=(),
        data_sha256="a" * 64,
        artefacts=(),
        previous="",
    )


def _verification(
    calibration: str, number: int, now: datetime, *, passed: bool
) -> VerificationRecord:
    measured = 400.002 if passed else 400.2
    return VerificationRecord(
        schema=VERIFICATION_SCHEMA,
        calibration=calibration,
        made_utc=now.isoformat(),
        made_by="technician",
        software=__version__,
        temperature_c=20.0,
        rule="every length within its limit",
        checks=(
            Check(
                name="line 1, 400 mm", measured_mm=measured, certified_mm=400.0,
                expanded_mm=0.002, limit_mm=0.06,
            ),
        ),
        artefacts=(),
        data_sha256=f"{number:064x}",
        passed=passed,
    )  # fmt: skip


def calibration_of(world: World) -> str:
    """Return the hash of the calibration that the jobs of a world are measured with."""
    return record_hash(world.record)
