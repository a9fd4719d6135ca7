"""Scenes and hands of the virtual rig for the remaining steps of guided procedures.

Procedures are calibrations and acceptance tests.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ocmm_core.acceptance import AcceptanceProcedure, AcceptanceView, Stage, UsedArtefact
from ocmm_core.calibration.cameras import KnownPoints
from ocmm_core.calibration.guided import (
    KnownPointsView,
    RelocationView,
    TrackerView,
    VerificationView,
)
from ocmm_core.calibration.records import LengthBar, Sphere
from ocmm_core.calibration.tip import POLE, QUALIFICATION_RINGS, TouchView, frame_about
from ocmm_core.camera import CameraModel, Rig, TrackerDocument, Vector3, project
from ocmm_core.composition import Feed, StationRequest, require_scenes, source_of
from ocmm_core.composition.hands import VirtualHand
from ocmm_core.errors import OcmmError
from ocmm_core.geometry import Float, Points3, RigidTransform, rigid_fit, triple, unit
from ocmm_core.tracking import triangulate
from ocmm_sim.calibration_scenes import (
    SEATS,
    CalibratingScript,
    FrameMove,
    FreeMotionScene,
    Scene,
    ShowBar,
    TargetScene,
    TipFault,
    TouchSeats,
    TouchSphere,
    TouchWithTip,
    stand_of,
)

_LIST_ERROR, _BAR_ERROR, _PLACES, _SPREAD = range(40, 44)
_CLAMPED_S = 62.0
_SECONDS_OF_WAVING = 60
_SET_POINTS = ((-150.0, -50.0, -120.0), (150.0, -50.0, -120.0), (-150.0, 50.0, -120.0))


_SPHERE, _CONE = np.array([-40.0, 0.0, -110.0]), np.array([60.0, 20.0, -120.0])
"""mm from the middle of the volume; the handle above must also be inside."""

_ALSO_DEG = (0.0, 180.0, 24.0, 204.0, -24.0, 156.0, 6.0, 186.0, -18.0, 162.0)
"""Azimuths from the right along the equator, most useful extra point first."""


@dataclass(frozen=True, slots=True)
class VirtualSite:
    """Virtual rig of a procedure."""

    rig: Path
    probe: Path
    seed: int
    move: int | None
    """Seed of the displacement of the camera frame since calibration; None: not displaced."""
    tracker: TrackerDocument | None = None
    """As in `CalibratingScript`."""

    def script(self, scenes: tuple[Scene, ...]) -> CalibratingScript:
        """Return the script of the rig with scenes."""
        return CalibratingScript(
            calibrating=scenes,
            rig=str(self.rig.absolute()),
            probe=str(self.probe.absolute()),
            seed=self.seed,
            moved=None if self.move is None else FrameMove(seed=self.move),
            tracker=self.tracker,
        )


def scenes_of_known_points(
    site: VirtualSite, view: KnownPointsView, points: KnownPoints
) -> tuple[Scene, ...]:
    """Return the positions not yet recorded, with errors of the list's own sigma."""
    error = np.random.default_rng([site.seed, _LIST_ERROR]).standard_normal((len(points.names), 3))
    true = points.positions_world + points.sigma * error
    left = [i for i, point in enumerate(view.points) if point.views is None]
    return (TargetScene(positions=_vectors(true[left])),) if left else ()


def scenes_of_tracker(site: VirtualSite, rig: Rig, view: TrackerView) -> tuple[Scene, ...]:
    """Return the minute at rest, if not recorded, and the remaining places."""
    low, high = rig.volume_world
    rest, spread = view.base.steps[1:3]
    scenes: list[Scene] = []
    if not rest.done:
        middle = _vectors(0.5 * (low + high)[None])
        scenes.append(TouchSeats(tips=middle, seed=site.seed, clamped_s=_CLAMPED_S))
    # Places in one order, so that a resumed session takes others than it has.
    shares = np.random.default_rng([site.seed, _SPREAD]).permuted(
        np.linspace(0.05, 0.95, spread.wanted)[:, None].repeat(3, axis=1), axis=0
    )
    left = (low + shares * (high - low))[spread.done :]
    return (*scenes, TouchSeats(tips=_vectors(left), seed=site.seed + 50 + spread.done))


def relocation_by_step(
    site: VirtualSite, rig: Rig, view: RelocationView, bar: LengthBar, control: KnownPoints | None
) -> dict[str, Scene]:
    """Return the remaining seats, sweeps, bar placements and control points by step, in order."""
    scenes: dict[str, Scene] = {}
    # A resumed session sees other poses than those it already has.
    rng = np.random.default_rng([site.seed, _PLACES, view.poses])
    missing = {step.name for step in view.base.steps if not step.gate.open}
    low, high = rig.volume_world
    seats = low + SEATS * (high - low)
    if "seats" in missing:
        left = seats[len(view.seats_world) :]
        scenes["seats"] = TouchSeats(tips=_vectors(left), seed=site.seed + 30)
    if "wave" in missing:
        seed = site.seed + 1000 * view.poses
        scenes["wave"] = FreeMotionScene(ways=_SECONDS_OF_WAVING, seed=seed)
    count = view.bars_wanted - view.bar_placements
    if count > 0:
        places = bar.leds or (bar.nests[0], bar.nests[-1])
        length = (places[1] - places[0]) * _true_scale(site, bar)
        ends = _placements(rig.volume_world, length, count, rng)
        if bar.leds:
            scenes["bar"] = ShowBar(ends=tuple((triple(a), triple(b)) for a, b in ends))
        else:
            scenes["bar"] = TouchSeats(tips=_vectors(ends.reshape(-1, 3)), seed=site.seed)
    names = [name for name in view.world_wanted if name not in view.world_points]
    if names:
        known = dict(zip(view.world_wanted, map(np.array, _SET_POINTS), strict=False))
        if control is not None:
            known = dict(zip(control.names, control.positions_world, strict=True))
        tips = np.array([known[name] for name in names])
        scenes["world"] = TouchSeats(tips=_vectors(tips), seed=site.seed + 1)
    if "again" in missing:
        left = seats[view.next_seat or 0 :] if view.base.step.name == "again" else seats
        scenes["again"] = TouchSeats(tips=_vectors(left), seed=site.seed + 31)
    return scenes


def scenes_of_verification(
    site: VirtualSite, rig: Rig, view: VerificationView, bar: LengthBar, spheres: Sequence[Sphere]
) -> tuple[Scene, ...]:
    """Return remaining seats, nests and touches; the world may differ from `rig`."""
    return sum(verification_by_step(site, rig, view, bar, spheres).values(), ())


def verification_by_step(
    site: VirtualSite, rig: Rig, view: VerificationView, bar: LengthBar, spheres: Sequence[Sphere]
) -> dict[str, tuple[Scene, ...]]:
    """Return the scenes of `scenes_of_verification` by step, in order."""
    T_true_from_rig = _motion(rig, site.script(()).build().world.cameras)
    scale, tips = _true_scale(site, bar), []
    for line in view.lines:
        begin, end = T_true_from_rig.apply(line.ends_world)
        along = (end - begin) / np.linalg.norm(end - begin)
        tips += [begin + along * scale * (nest - bar.nests[0]) for nest in bar.nests[line.taken :]]
    scenes: dict[str, tuple[Scene, ...]] = {}
    low, high = rig.volume_world
    seats = T_true_from_rig.apply(low + SEATS * (high - low))
    if len(view.seats_world) < len(seats):
        left = seats[len(view.seats_world) :]
        scenes["seats"] = (TouchSeats(tips=_vectors(left), seed=site.seed + 30),)
    if tips:
        scenes["lines"] = (TouchSeats(tips=_vectors(np.array(tips)), seed=site.seed + 2),)
    touched: list[Scene] = []
    for number, (sphere, taken) in enumerate(zip(spheres, view.spheres, strict=True)):
        normals = _normals()[taken:]
        if len(normals):
            touched.append(
                TouchSphere(
                    centre=triple(
                        T_true_from_rig.apply(stand_of(rig, view.places[number], number))
                    ),
                    diameter=sphere.diameter,
                    normals=_vectors(normals),
                    seed=site.seed + 3 + number,
                )
            )
    if touched:
        scenes["spheres"] = tuple(touched)
    if not view.base.steps[-2].gate.open:
        again = seats[view.next_seat or 0 :] if view.base.step.name == "again" else seats
        scenes["again"] = (TouchSeats(tips=_vectors(again), seed=site.seed + 31),)
    return scenes


def _true_scale(site: VirtualSite, bar: LengthBar) -> float:
    """Return the ratio of the true to the certified bar length."""
    length = bar.nests[-1] - bar.nests[0]
    sigma = 0.5 * (bar.artefact.expanded / length + bar.artefact.expanded_per_length)
    return 1.0 + sigma * float(np.random.default_rng([site.seed, _BAR_ERROR]).standard_normal())


def _placements(volume_world: Float, length: float, count: int, rng: np.random.Generator) -> Float:
    """Return random bar ends (count, 2, 3), mm, within a volume."""
    low, high = volume_world
    found: list[Float] = []
    while len(found) < count:
        direction = rng.standard_normal(3)
        arm = 0.5 * length * direction / np.linalg.norm(direction)
        room = high - low - 2.0 * np.abs(arm)
        if (room >= 0.0).all():
            centre = low + np.abs(arm) + rng.random(3) * room
            found.append(np.stack([centre - arm, centre + arm]))
    return np.array(found)


def _motion(rig: Rig, true: tuple[CameraModel, ...]) -> RigidTransform:
    """Return the motion from the world of a calibration to that of the true cameras."""
    if rig.markers is not None:
        # Its views follow from its noise; the world is that of the device.
        return RigidTransform(np.eye(3), np.zeros(3))
    low, high = rig.volume_world
    corners = np.array([[(low, high)[bit][axis] for axis, bit in enumerate(bits)]
                        for bits in np.ndindex(2, 2, 2)])  # fmt: skip
    spots = np.stack([project(camera, corners) for camera in rig.cameras])
    return RigidTransform(*rigid_fit(corners, triangulate(replace(rig, cameras=true), spots)))


def _normals() -> Points3:
    normals = []
    for polar, count, turn in QUALIFICATION_RINGS:
        around = np.radians(turn + 360.0 * np.arange(count) / count)
        sine, cosine = np.sin(np.radians(polar)), np.cos(np.radians(polar))
        for angle in around:
            normals.append([sine * np.cos(angle), sine * np.sin(angle), cosine])
    return np.array(normals)


def scene_of_tip(
    view: TouchView, sphere: Sphere, rig: Rig, seed: int, fault: TipFault
) -> TouchWithTip:
    """Return the remaining touches plus spares on the equator."""
    frame = frame_about(POLE, rig)
    angles = np.radians(np.array(_ALSO_DEG))[:, None]
    also = np.cos(angles) * frame.right + np.sin(angles) * frame.back
    begun = len(view.sphere.tips_world) + len(view.cone.tips_world)
    places = [place.direction_world for place in view.sphere.places if place.point is None]
    handles = [one.handle_world for one in view.cone.attitudes if one.point is None]
    middle = rig.volume_world.mean(axis=0)
    return TouchWithTip(
        centre=triple(middle + _SPHERE),
        diameter=sphere.diameter,
        normals=tuple(triple(one) for one in (*places, *also)),
        cone=triple(middle + _CONE),
        handles=tuple(triple(one) for one in handles),
        # Resumed sessions get other touches.
        seed=seed + 100 * begun + len(view.sphere.places),
        fault=fault,
    )


def _vectors(values: Float) -> tuple[Vector3, ...]:
    return tuple(triple(value) for value in values)


_APART_MM, _TURN_RAD = 1.5, 0.15
_CERTIFICATE = 45
_EXTREMES = np.radians(28.0)


def acceptance_hand(
    request: StationRequest, procedure: AcceptanceProcedure, failed: Callable[[OcmmError], None]
) -> VirtualHand:
    """Return the virtual hand of a test, which makes the touches that are missing."""
    site = VirtualSite(request.rig, request.probe, procedure.session.stage.seed, None)

    def make() -> tuple[Feed, int]:
        view = procedure.view
        return acceptance_feed(site, request.source, view.test, view.stage, request.speed)

    return VirtualHand(make, procedure, failed)


def acceptance_feed(
    site: VirtualSite, source: str, view: AcceptanceView, stage: Stage, speed: float
) -> tuple[Feed, int]:
    """Return the virtual rig with the remaining touches, and its frames; InputError if none."""
    require_scenes(source)
    make = source_of(source).spec.scenes
    if make is None:
        msg = f"{source!r} is no virtual rig"
        raise ValueError(msg)
    away = np.array(stage.instrument.away)
    script = site.script(_scenes_of_acceptance(site, view, stage.artefacts, away))
    return make(script, speed), script.build().n_frames


def _scenes_of_acceptance(
    site: VirtualSite, view: AcceptanceView, artefacts: Sequence[UsedArtefact], away: Float
) -> tuple[Scene, ...]:
    """Return the remaining touches; artefacts deviate within their certificates."""
    scenes: list[Scene] = []
    known = {one.role: one for one in artefacts}
    right = unit(np.cross(away, [0.0, 0.0, 1.0]))
    for number, (position, done) in enumerate(zip(view.positions, view.done, strict=True)):
        points = np.array(position.points_world * position.repeats)
        artefact = known.get(position.role)
        error = 0.0
        if artefact is not None:
            draw = np.random.default_rng([site.seed, _CERTIFICATE]).standard_normal()
            error = 0.5 * artefact.expanded * float(draw)
        seed = site.seed + 7 * number + 1000 * done
        left = points[done:]
        if not len(left):
            continue
        if position.role == "cone":
            leans = [1.0 if (done + one) % 2 else -1.0 for one in range(len(left))]
            handles = [
                np.cos(_EXTREMES) * np.array([0.0, 0.0, 1.0]) + lean * np.sin(_EXTREMES) * right
                for lean in leans
            ]
            scenes.append(_rest(left[0], handles, seed))
        elif position.handle is not None:
            scenes += [
                _rest(point, [np.array(position.handle)], seed + one)
                for one, point in enumerate(left)
            ]
        elif position.normals and artefact is not None:
            normals = np.array(position.normals * position.repeats)
            reach = float(np.linalg.norm(points[0] - points[1]))
            reach /= float(np.linalg.norm(normals[0] - normals[1]))
            scenes.append(
                TouchSphere(
                    centre=triple(points[0] - reach * normals[0]),
                    diameter=artefact.sizes[0] + error,
                    normals=tuple(triple(one) for one in normals[done:]),
                    seed=seed,
                )
            )
        else:
            first = points[0]
            scale = 1.0
            if position.role == "bar" and artefact is not None:
                scale += error / (artefact.sizes[-1] - artefact.sizes[0])
            if position.role == "gauge block":
                # The second face is offset from its certified distance.
                half = len(position.points_world) // 2
                wide = points[half] - points[0]
                later = (np.arange(len(points)) // half % 2)[:, None]
                left = (points + error * later * wide / np.linalg.norm(wide))[done:]
                first = left[0]
            scenes.append(
                TouchSeats(
                    tips=tuple(triple(first + scale * (one - first)) for one in left), seed=seed
                )
            )
    return tuple(scenes)


def _rest(point: Float, handles: Sequence[Float], seed: int) -> TouchWithTip:
    return TouchWithTip(
        centre=(0.0, 0.0, 0.0), diameter=10.0, normals=(), cone=triple(point),
        handles=tuple(triple(one) for one in handles), seed=seed,
    )  # fmt: skip
