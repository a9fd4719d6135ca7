"""A virtual rig with a store of calibrations, for the tests of guided procedures."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from ocmm_core.calibration.cameras import (
    KnownPoints,
    KnownPointsProcedure,
    KnownPointsSetup,
    SpotTable,
)
from ocmm_core.calibration.guided import Procedure, SessionSite, Shot
from ocmm_core.calibration.records import CalibrationStore, LengthBar, Sphere, load_bar, load_sphere
from ocmm_core.calibration.verification import VerificationProcedure
from ocmm_core.camera import Rig, load_rig, on_sensor, project
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, rotation_from_vector
from ocmm_core.tracking import ProbeBody, load_probe
from ocmm_sim.calibration_scenes import SEATS, CalibrationScenesRig, FrameMove, Scene
from ocmm_sim.sources import VirtualSite, scenes_of_verification
from tests.slow_rig import CALM_HZ

SEED = 3
BEGIN = datetime(2026, 3, 2, 8, 0, tzinfo=UTC)
RIG_DOCUMENT = resource("rigs", "recommended.toml")
PROBE_DOCUMENT = resource("probes", "standard.toml")
FULL_HZ = 8000
"""For tests that count frames of the recommended rig."""


class Clock:
    """A simulated clock: every call is a tenth of a second later."""

    def __init__(self) -> None:
        self._looks = 0

    def __call__(self) -> datetime:
        self._looks += 1
        return BEGIN + timedelta(seconds=0.1 * self._looks)


@dataclass(slots=True)
class Bench:
    """Rig, probe, artefacts and an empty store in a folder."""

    folder: Path
    now: Clock
    rig: Rig
    body: ProbeBody
    bar: LengthBar
    sphere: Sphere

    @classmethod
    def at(cls, folder: Path, rate_hz: int = CALM_HZ) -> Bench:
        return cls(
            folder,
            Clock(),
            replace(load_rig(RIG_DOCUMENT), frame_rate_hz=rate_hz),
            load_probe(PROBE_DOCUMENT),
            load_bar(resource("artefacts", "bar.toml")),
            load_sphere(resource("artefacts", "sphere.toml")),
        )

    @property
    def sessions(self) -> Path:
        return self.folder / "sessions"

    def site(self, rig: Rig | None = None) -> SessionSite:
        return SessionSite(self.sessions, rig or self.rig, self.body, self.folder / "store")

    def store(self) -> CalibrationStore:
        return CalibrationStore(self.folder / "store")

    def virtual(self, *scenes: Scene, move: int | None = None) -> CalibrationScenesRig:
        moved = None if move is None else FrameMove(seed=move)
        return CalibrationScenesRig(self.rig, self.body, scenes, SEED, moved=moved)

    def points(self, n: int = 100) -> KnownPoints:
        """Return a list of points in the whole volume."""
        low, high = self.rig.volume_world
        positions = np.random.default_rng(1).uniform(low, high, (n, 3))
        return KnownPoints(tuple(f"P{i:03d}" for i in range(n)), positions, 0.0017, "CMM")

    def spots(self, points: KnownPoints, shift_mm: float = 0.0) -> SpotTable:
        """Return the virtual cameras' spots of a list as a table, with all points moved in X."""
        rng = np.random.default_rng(2)
        true = points.positions_world + points.sigma * rng.standard_normal((len(points.names), 3))
        cameras = self.virtual().world.cameras
        uv = np.stack(
            [project(camera, true + np.array([shift_mm, 0.0, 0.0])) for camera in cameras]
        )
        uv += 0.0105 * rng.standard_normal(uv.shape)
        return SpotTable(tuple(camera.serial for camera in cameras), uv, 0.0105)

    def calibrated(self, n: int = 250) -> Rig:
        """Put a calibration from known points in force and return the rig with it."""
        procedure = self.known_points(n)
        procedure.take_table(self.spots(self.points(n)), self.now())
        procedure.compute()
        procedure.accept(self.now(), "first")
        outcome = procedure.view.outcome
        assert outcome is not None
        return outcome.rig

    def known_points(self, n: int = 100) -> KnownPointsProcedure:
        return KnownPointsProcedure.start(
            self.site(), KnownPointsSetup(who="technician", points=self.points(n)), self.now()
        )

    def verified_scenes(
        self, procedure: VerificationProcedure, spheres: tuple[Sphere, ...] = (),
        move: int | None = None,
    ) -> tuple[Scene, ...]:  # fmt: skip
        site = VirtualSite(RIG_DOCUMENT, PROBE_DOCUMENT, SEED, move)
        return scenes_of_verification(site, procedure.rig, procedure.view, self.bar, spheres)


def show(
    procedure: Procedure, rig: CalibrationScenesRig, now: Clock, *, at_most: int | None = None
) -> int:
    """Show all frames of a rig to a procedure, take each finished step, and return their number."""
    taken = 0
    last = len(procedure.base.steps) - 1
    for first in range(0, rig.n_frames, 80):
        view = procedure.base
        while view.current < last and view.step.gate.open:
            procedure.advance(now())
            view = procedure.base
        procedure.watch(rig.frames(first, min(80, rig.n_frames - first)))
        if procedure.base.live.ready and (at_most is None or taken < at_most):
            procedure.record(now())
            taken += 1
    return taken


def recorded(
    bench: Bench, poses: int, bars: int, seat_shift_mm: float = 0.0, seed: int = 21
) -> list[Shot]:
    """Return shots of the true cameras of the virtual rig, with noise; two seats first and last.

    The first seat is pushed meanwhile, in X.
    """
    rng = np.random.default_rng(seed)
    rig = bench.virtual()
    cameras, leds = rig.world.cameras, rig.world.leds_probe - rig.world.tip_probe
    low, high = bench.rig.volume_world

    def see(at: Float) -> Float:
        uv = np.stack([project(camera, at) for camera in cameras])
        for camera, spots in zip(cameras, uv, strict=True):
            spots[~on_sensor(camera, spots)] = np.nan
        return uv + 0.0105 * rng.standard_normal(uv.shape)

    def rest(number: int, shift_mm: float) -> Shot:
        tip = low + SEATS[number] * (high - low) + np.array([shift_mm, 0.0, 0.0])
        turn = rng.uniform(-0.3, 0.3, 3)
        return Shot("repeat", "", see(tip + leds @ rotation_from_vector(turn).T), 0.0105)

    shots = [rest(0, 0.0), rest(1, 0.0)]
    for number in range(poses):
        # Cells of the volume in turn, so that all of it is covered.
        cell = np.array(np.unravel_index(number % 27, (3, 3, 3)))
        tip = low + (cell + rng.random(3)) / 3.0 * (high - low)
        turn = rng.uniform(-0.6, 0.6, 3)
        shots.append(Shot("pose", "", see(tip + leds @ rotation_from_vector(turn).T), 0.0105))
    while len(shots) < 2 + poses + bars:
        centre = rng.uniform(low, high)
        arm = rng.standard_normal(3)
        arm *= 200.0 / np.linalg.norm(arm)
        ends = np.stack([centre - arm, centre + arm])
        if (ends > low - 30.0).all() and (ends < high + 30.0).all():
            shots.append(Shot("bar", "", see(ends), 0.0105))
    return [*shots, rest(0, seat_shift_mm), rest(1, 0.0)]


def without_field(session: Path, field: str) -> None:
    """Rewrite a session of one line as a version without this field wrote it."""
    item = json.loads(session.read_bytes())["item"]
    del item["event"][field]
    text = json.dumps(item, separators=(",", ":")).encode()
    link = hashlib.sha256(b"1 " + b"0" * 64 + b" " + text).hexdigest()
    line = {"number": 1, "previous": "0" * 64, "item": item, "sha256": link}
    session.write_bytes(json.dumps(line, separators=(",", ":")).encode() + b"\n")
