"""Makers of the virtual sources, listed in `_specs`, and the operator of the virtual rig.

The operator has intents, repeated touches, and a led hand.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import platformdirs
import scipy

from ocmm_core.acquisition.frames import AcquisitionWorker, FrameRing
from ocmm_core.camera import USUAL_SLOTS, Rig, Vector3, load_rig, load_tracker, tracker_rig
from ocmm_core.composition import (
    DEMO_PART,
    VIRTUAL_WIRE,
    Feed,
    Remaining,
    StationRequest,
    bus_config,
    bus_description,
    described_cameras,
    identities,
    rate_of,
    source_of,
)
from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.evaluation import places_of
from ocmm_core.inspection.plan import Plan, part_of_plan
from ocmm_core.part_model import Placement
from ocmm_core.side_files import has_content
from ocmm_sim import scene
from ocmm_sim.bus import SegmentConfig, VirtualBus, VirtualWire
from ocmm_sim.calibration_scenes import CalibratingScript, CalibratingSource
from ocmm_sim.genicam import GENICAM_RATE_HZ, virtual_genicam_feed
from ocmm_sim.hand import HandAtRig
from ocmm_sim.sources._specs import GENICAM
from ocmm_sim.trackers import virtual_tracker_feed

_AS_MANY = 2
"""Touch points per required point of a feature that lists none."""
_OPEN_MM = 1000.0
_MOST_KEPT = 20
_DECIMALS = 9


def part_as_planned(
    plan: Plan, folder: Path | None, rig: Rig, placement: Placement | None = None
) -> scene.PartDocument:
    """Return the nominal part of a plan.

    `folder`: folder of the plan and its CAD model. The part is centred in the volume by the model
    if present, else by its touch points. `placement`: orientation in the volume; upright if None.
    InputError: a feature has no touch points.
    """
    entries = [_entry(feature) for feature in plan.features]
    model = part_of_plan(plan, folder).model
    places = np.array([place for entry in entries for place in entry.places])
    box = np.stack([places.min(axis=0), places.max(axis=0)]) if model is None else model.box
    volume = np.asarray(rig.volume_world)
    pose = (placement or Placement()).pose(box.mean(axis=0), volume.mean(axis=0))
    return scene.PartDocument(
        schema="ocmm.part/1", unit="mm", name=plan.part, pose=_pose(pose), features=list(entries)
    )


def part_text(part: scene.PartDocument) -> str:
    """Return a part as a TOML document."""
    lines = [f"{field} = {_value(getattr(part, field))}" for field in ("schema", "unit", "name")]
    lines += ["", "[pose]", *_fields(msgspec.to_builtins(part.pose))]
    for entry in part.features:
        lines += ["", "[[features]]", *_fields(msgspec.to_builtins(entry))]
    return "\n".join(lines) + "\n"


def kept_part(plan: Plan, plan_file: Path, rig: Rig) -> Path:
    """Return the part document in the user's cache; InputError as `part_as_planned`."""
    content = part_text(part_as_planned(plan, plan_file.absolute().parent, rig)).encode()
    folder = platformdirs.user_cache_path("ocmm") / "virtual-parts"
    path = folder / f"{hashlib.sha256(content).hexdigest()}.toml"
    if has_content(path, content):
        return path
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomic(path, content)
        older = sorted(folder.glob("*.toml"), key=lambda one: one.stat().st_mtime)
        for old in older[:-_MOST_KEPT]:
            old.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(
            "part.not_kept",
            f"{path}: the virtual part of the plan cannot be written ({error.strerror or error}).",
            "Make room there, or write it with 'ocmm plan part' and measure that part.",
        ) from error
    return path


def _entry(feature: NominalFeature) -> scene.TouchedEntry:
    places = places_of(feature, max(_AS_MANY * feature.points, len(feature.targets)))
    if not len(places.points) or not np.linalg.norm(places.normals, axis=1).all():
        raise InputError(
            "part.places",
            f"Feature '{feature.name}' does not say where a virtual part could be touched.",
            "Give its sizes or targets in the plan, or measure the document of a part.",
        )
    spec = feature.shape.spec
    return scene.TouchedEntry(
        name=feature.name,
        point=feature.point,
        direction=feature.direction,
        places=_triples(places.points),
        normals=_triples(places.normals),
        free=_free(feature, places.points),
        true_diameter=feature.diameter,
        true_width=feature.width if spec.has_size("width") else 0.0,
        apex_deg=feature.angle_deg,
    )


def _free(feature: NominalFeature, places: Float) -> float:
    """Return the width of a hollow surface at its narrowest touch point, mm."""
    if feature.side == "outer" or feature.diameter <= 0.0:
        return _OPEN_MM
    if feature.shape is not Shape.CONE:
        return feature.diameter
    axis = np.array(feature.direction) / np.linalg.norm(feature.direction)
    arms = places - np.array(feature.point)
    return 2.0 * float(np.linalg.norm(arms - (arms @ axis)[:, None] * axis, axis=1).min())


def _pose(motion: RigidTransform) -> scene.PartPose:
    vector = scipy.spatial.transform.Rotation.from_matrix(motion.rotation).as_rotvec()
    turn, shift = _triples(np.stack([vector, motion.translation]))
    return scene.PartPose(translation=shift, rotation_vector=turn)


def _triples(rows: Float) -> list[Vector3]:
    return [(x, y, z) for x, y, z in (np.round(rows, _DECIMALS) + 0.0).tolist()]


def _fields(values: dict[str, Any]) -> list[str]:
    return [f"{name} = {_value(value)}" for name, value in values.items()]


def _value(value: object) -> str:
    """Return a text, number or list in TOML syntax, here the same as JSON."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


_MARGIN_S = 0.25


@dataclass(frozen=True, slots=True)
class VirtualOperator:
    """The scripted operator in this process (`source`) or at the far end of a wire (`bus`)."""

    virtual: scene.VirtualRig
    ring: FrameRing
    source: scene.SimulatedSource | None = None
    bus: VirtualWire | None = None

    @property
    def features(self) -> frozenset[str]:
        return frozenset(each.name for each in self.virtual.part.artefacts)

    def intent(self, frame: int) -> str | None:
        margin = round(_MARGIN_S * 1e9 / self.virtual.frame_period_ns)
        for touch in reversed(self.virtual.truth.touches):
            if touch.first_frame - margin <= frame <= touch.last_frame:
                return touch.feature
        return None

    def follow(self, ask: Callable[[], Remaining], *, stay: bool) -> Callable[[int], None] | None:
        if self.source is not None:
            self.source.ask = lambda: scene.Missing(*ask())
        return self._over_the_wire(self.bus, ask, stay=stay) if self.bus is not None else None

    def hand(self) -> HandAtRig | None:
        """Return the probe for a user who holds it; None over a wire."""
        return HandAtRig(self.source, self.virtual) if self.source is not None else None

    def _over_the_wire(
        self, bus: VirtualWire, ask: Callable[[], Remaining], *, stay: bool
    ) -> Callable[[int], None]:
        second = round(1e9 / self.virtual.frame_period_ns)
        rest, rounds, due = round(scene.REST_S * second), 0, 0

        def follow(frame: int) -> None:
            nonlocal rounds, due
            begin = max(due, self.virtual.n_frames - rest)
            if frame < begin or (rounds >= scene.MOST_ROUNDS and not stay):
                return
            due = frame + second // 10
            missing = scene.Missing(*ask())
            if missing.touches:
                rounds += 1
                # The cameras are ahead of the reader, and both rigs must contain the same script.
                after = frame + (self.ring.capacity - self.ring.free()) + second
                self.virtual.complete(missing, after)
                bus.touch_again(missing, after)

        return follow


_AHEAD_S = 0.2
"""Lead of a source that waits: queries for missing points then include the last touch."""

_SCENE_FRAMES = 320
"""Maximum lead of calibration scenes over their reader."""

_PIXEL_RATE_HZ = 1000
"""Two cores compute this rate in real time with reserve."""


def script_of(request: StationRequest, plan: Plan) -> scene.RigScript:
    """Return the script of the requested virtual rig."""
    return scene.RigScript(
        rig=str(request.rig.absolute()),
        probe=str(request.probe.absolute()),
        part=str(_part_file(request, plan).absolute()),
        touches=tuple((one.name, one.points) for one in plan.features if not request.idle),
        seed=request.seed,
        options=request.world
        if isinstance(request.world, scene.WorldOptions)
        else scene.WorldOptions(),
        frame_rate_hz=request.frame_rate_hz,
        reference=str(request.reference.absolute()) if request.reference is not None else "",
        paths={one.name: one.spacing for one in plan.features if one.spacing > 0.0},
        scans={one.name: one.scan for one in plan.features if one.scan},
    )


def _part_file(request: StationRequest, plan: Plan) -> Path:
    """Return the virtual part: the requested document, or one made from the plan."""
    if request.part != DEMO_PART or plan.model is None:
        return request.part
    return kept_part(plan, request.plan, load_rig(request.rig))


def virtual_rig_feed(request: StationRequest, plan: Plan, _rig: Rig, _value: str) -> Feed:
    """Return the virtual rig in this process; it waits for its reader."""
    virtual = script_of(request, plan).build()
    source = scene.SimulatedSource(
        virtual, request.speed, hover=request.stay, rest_speed=request.rest_speed
    )
    description = source.description
    per_read = max(1, round(description.cycle_period_ns / description.frame_period_ns))
    capacity = max(round(_AHEAD_S * 1e9 / description.frame_period_ns), 2 * per_read)
    ring = FrameRing.create(len(description.camera_serials), capacity, description.n_slots)
    return Feed(
        AcquisitionWorker(source, ring), ring, description,
        live=False, virtual=virtual, operator=VirtualOperator(virtual, ring, source),
    )  # fmt: skip


def segment_of(request: StationRequest, plan: Plan, rig: Rig) -> SegmentConfig:
    """Return software cameras playing the request's script; interface not set."""
    return _segment(_wire_script(request, plan, rig).to_json(), rig)


def pixel_segment_of(request: StationRequest, plan: Plan, rig: Rig) -> SegmentConfig:
    """Return the same cameras with rendered images and spot detection."""
    script = _wire_script(request, plan, rig, pixels=True)
    words = scene.PixelScript(pixels=scene.SensorOptions(), script=script).to_json()
    return _segment(words, rig)


def wire_feed(
    request: StationRequest, plan: Plan, rig: Rig, _value: str, *, pixels: bool = False
) -> Feed:
    """Return the virtual rig over a virtual wire; ``pixels``: with rendered images."""
    virtual = _wire_script(request, plan, rig, pixels=pixels).build()
    segment = (pixel_segment_of if pixels else segment_of)(request, plan, rig)
    feed = _on_wire(rig, request.seed, virtual.frame_period_ns, segment, request.bus_processor)
    return _played(feed, virtual)


pixel_feed = partial(wire_feed, pixels=True)


def genicam_feed(request: StationRequest, plan: Plan, rig: Rig, _value: str) -> Feed:
    """Return the virtual rig by GigE Vision cameras, with rendered images."""
    rate = request.frame_rate_hz or GENICAM_RATE_HZ
    script = script_of(replace(request, frame_rate_hz=rate), plan)
    name = f"{GENICAM.recorded_as} ({rig.name}, seed {request.seed})"
    virtual = script.build()
    return _played(virtual_genicam_feed(script, rig, name, virtual.n_leds), virtual)


def tracker_feed(request: StationRequest, plan: Plan, rig: Rig, _value: str) -> Feed:
    """Return the virtual rig by a software tracker."""
    script = script_of(replace(request, frame_rate_hz=rig.frame_rate_hz), plan)
    spec = source_of(request.source).spec
    name = f"{spec.recorded_as} ({rig.name}, seed {request.seed})"
    protocol = spec.prefix.partition(":")[0]
    return _played(virtual_tracker_feed(protocol, script, rig, name), script.build())


def tracker_scenes_feed(
    protocol: str, recorded_as: str, script: CalibratingScript, _speed: float
) -> Feed:
    """Return the virtual rig with the scenes of a calibration, by a software tracker."""
    document = script.tracker or load_tracker(script.rig)
    name = f"{recorded_as} ({document.name}, seed {script.seed})"
    return virtual_tracker_feed(protocol, script, tracker_rig(document, ""), name)


def _played(feed: Feed, virtual: scene.VirtualRig) -> Feed:
    """Return a feed over the wire with its script and the operator at its far end."""
    bus = feed.acquisition if isinstance(feed.acquisition, VirtualWire) else None
    return replace(feed, virtual=virtual, operator=VirtualOperator(virtual, feed.ring, bus=bus))


def scenes_feed(script: CalibratingScript, speed: float) -> Feed:
    """Return the virtual rig with the scenes of a calibration, in this process."""
    source = CalibratingSource(script.build(), speed)
    cameras = len(source.description.camera_serials)
    ring = FrameRing.create(cameras, _SCENE_FRAMES, source.description.n_slots)
    return Feed(AcquisitionWorker(source, ring), ring, source.description, live=False)


def scenes_wire_feed(script: CalibratingScript, _speed: float) -> Feed:
    """Return the virtual rig with the scenes of a calibration, over a virtual wire."""
    virtual = script.build()
    if virtual.world.n_slots > USUAL_SLOTS:
        raise InputError(
            "camera.windows",
            f"The scenes show {virtual.world.n_slots} LEDs, but a camera on the wire sends the "
            f"spots of {USUAL_SLOTS} windows.",
            f"Use the source 'simulated', or a body with {USUAL_SLOTS} LEDs at most.",
        )
    segment = _segment(script.to_json(), virtual.rig)
    return _on_wire(virtual.rig, virtual.seed, virtual.frame_period_ns, segment)


def _wire_script(
    request: StationRequest, plan: Plan, rig: Rig, *, pixels: bool = False
) -> scene.RigScript:
    """Return the script at the rate of rendered cameras, or of the camera description."""
    rate = request.frame_rate_hz
    if pixels:
        rate = rate or _PIXEL_RATE_HZ
    elif rig.device:
        rate = round(rate_of(rig))
    return script_of(replace(request, frame_rate_hz=rate), plan)


def _segment(words: str, rig: Rig) -> SegmentConfig:
    device, lenses = described_cameras(rig)
    return SegmentConfig(
        device=device,
        lenses=lenses,
        interface="",
        cameras=identities(rig),
        provider=msgspec.Raw(words.encode("utf-8")),
    )


def _on_wire(
    rig: Rig, seed: int, frame_period_ns: int, segment: SegmentConfig, processor: int | None = None
) -> Feed:
    ring = FrameRing.create(len(rig.cameras))
    bus = bus_config(rig, ring, "", frame_period_ns, force=False)
    bus = msgspec.structs.replace(bus, processor=processor)
    name = f"{VIRTUAL_WIRE} ({rig.name}, seed {seed})"
    description = replace(bus_description(name, rig, bus, simulated=True), stretched=True)
    return Feed(VirtualBus(bus, segment, ring), ring, description, live=True)
