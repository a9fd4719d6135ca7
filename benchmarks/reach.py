"""Targets of models, held against the library's own distances: nothing touches, cameras see.

The probe is built anew as solids of the library (a ball, cones, prisms, posts), put where each
target says that it is held, at the touch and where its way along the normal begins, and the least
distance from the part is asked of `BRepExtrema`. Lines from LEDs to cameras likewise. Nothing of
the mesh, of the tree of boxes and of the search is used. Then the virtual rig is shown the probe as
it comes along the normal, held so, and rests there: the tracking has to find it. Needs the extra
``step``:

    python -m benchmarks.reach --targets 1000 [model.stp ...]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ocmm_cad.reach import Setting
from ocmm_cad.step import StepModel, read_model, setting_of, usual_request
from ocmm_core.calibration.probe_design import Bar, Panel, ProbeDesign, leds_behind_body
from ocmm_core.camera import on_sensor, project
from ocmm_core.documents import resource
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.evaluation import places_of
from ocmm_core.tracking import TrackingPipeline
from ocmm_sim.scene import Motion, VirtualRig, load_part

SEED = 18
_RATE_HZ, _COMING, _RESTING = 500, 40, 60
_OFF_MM = 0.2
"""A ball found farther off was labelled wrongly; the errors of the virtual probe are smaller."""
_BALL_SLACK_MM = 0.02
"""The ball is made smaller by this: it touches the part, and the library is exact to 1e-7."""


def main(arguments: list[str] | None = None) -> int:
    """Print the numbers of targets that collide or are hidden; code 1 if there are any."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="*", type=Path)
    parser.add_argument(
        "--targets", type=int, default=1000, help="of all models together, as many of each"
    )
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        paths = options.models or _made(Path(folder))
        return run(paths, options.targets)


def run(paths: list[Path], wanted: int) -> int:
    """Print the findings for ``wanted`` targets of all models, in turns between the models."""
    rng = np.random.default_rng(SEED)
    request = usual_request()
    setting = setting_of(request)
    assert setting is not None
    hand = Hand(setting)
    total = hits = unseen = lost = 0
    nearest, fewest, farthest = np.inf, 99, 0.0
    drawn = []
    for path in paths:
        begun = time.perf_counter()
        rows = _targets(read_model(path, request=request))
        read_s = time.perf_counter() - begun
        part = _shape(path)
        taken = rng.permutation(len(rows)).tolist()
        drawn.append((part, model_middle(part), [rows[index] for index in taken]))
        print(f"{path.stem}: {len(rows)} targets in {read_s:.1f} s", flush=True)
    # One target of each model in turn: a run cut short has printed its results so far, and models
    # with more targets compensate for those with few.
    for turn in range(max(len(rows) for _, _, rows in drawn)):
        if total >= wanted:
            break
        for part, middle, rows in drawn:
            if turn >= len(rows) or total >= wanted:
                continue
            gap, seen = examined(part, rows[turn], setting, middle)
            off = hand.measured_off(rows[turn], middle)
            lost += not np.isfinite(off)
            farthest = max(farthest, off if np.isfinite(off) else 0.0)
            total += 1
            hits += gap <= 0.0
            unseen += seen < 4
            nearest, fewest = min(nearest, gap), min(fewest, seen)
        print(
            f"so far {hits} touch, {unseen} not seen, {lost} not measured, of {total}; nearest "
            f"{nearest:.3f} mm, fewest {fewest} LEDs, farthest {1000.0 * farthest:.0f} um",
            flush=True,
        )
    print(f"{hits} of {total} touch; least distance of stylus and body {nearest:.3f} mm")
    print(f"{unseen} of {total} show fewer than 4 LEDs to both cameras; fewest {fewest}")
    print(f"{lost} of {total} not measured by the virtual rig; farthest {1000.0 * farthest:.0f} um")
    return int(hits > 0 or unseen > 0 or lost > 0 or farthest > _OFF_MM)


class Hand:
    """A virtual hand that comes along the normal of a target, held as the target says, and rests.

    Parameters
    ----------
    setting
        Probe, cameras and placement.
    """

    def __init__(self, setting: Setting) -> None:
        assert setting.rig is not None
        assert setting.design is not None
        self._setting, self._cameras = setting, setting.rig
        part = load_part(resource("parts", "demo.toml"))
        self._rig = VirtualRig(
            setting.rig, setting.body, part, ((part.artefacts[0].name, 1),), SEED,
            frame_rate_hz=_RATE_HZ, behind_body=leds_behind_body(setting.body, setting.design),
        )  # fmt: skip

    def measured_off(self, row: Row, middle: Float) -> float:
        """Return the distance of the found resting ball from its place, mm; NaN if not found."""
        target, normal, held, way = row
        pose = self._setting.pose(middle)
        backs = np.concatenate([np.linspace(way, 0.0, _COMING), np.zeros(_RESTING)])
        balls = target + (self._setting.ball_radius + backs[:, None]) * normal
        turn = pose.rotation @ Rotation.from_rotvec(held).as_matrix()
        count = len(backs)
        rests = backs == 0.0
        motion = Motion(np.tile(turn, (count, 1, 1)), pose.apply(balls), rests, rests)
        pipeline = TrackingPipeline(self._cameras, self._setting.body)
        tracked = pipeline.process(self._rig.frames_of(motion, 0))
        tips = tracked.tip_world[-_RESTING:]
        good = np.isfinite(tips).all(axis=1)
        if not good.all():
            return float("nan")
        return float(np.linalg.norm(tips.mean(axis=0) - motion.tip_world[-1]))


Row = tuple[Float, Float, Float, float]
"""Target (3,), normal (3,), rotation vector (3,), way, mm."""


def _targets(model: StepModel) -> list[Row]:
    rows: list[Row] = []
    for feature, how in zip(model.features, model.reached, strict=True):
        normals = _normals(feature)
        for target, normal, held, way in zip(
            feature.targets, normals, how.held, how.ways, strict=True
        ):
            rows.append((np.array(target), normal, np.array(held), way))
    return rows


def _normals(feature: NominalFeature) -> Float:
    """Return the normals of the guidance, which is independent of faces."""
    places = places_of(feature, len(feature.targets))
    np.testing.assert_array_equal(places.points, feature.targets)
    return places.normals


def examined(part: Any, row: Row, setting: Setting, middle: Float) -> tuple[float, int]:
    """Return the distance of stylus and body, mm, 0 if the ball collides; and LEDs seen by both."""
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape

    target, normal, held, way = row
    turn = Rotation.from_rotvec(held).as_matrix()
    least = np.inf
    for back in (0.0, way):
        centre = target + (setting.ball_radius + back) * normal
        ball, *others = _probe(setting, RigidTransform(turn, centre))
        if BRepExtrema_DistShapeShape(ball, part).Value() <= 0.0:
            least = 0.0
        for solid in others:
            least = min(least, float(BRepExtrema_DistShapeShape(solid, part).Value()))
    return least, _seen(part, setting, turn, target + setting.ball_radius * normal, middle)


def _seen(part: Any, setting: Setting, turn: Float, centre: Float, middle: Float) -> int:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape
    from OCP.gp import gp_Pnt

    assert setting.rig is not None
    assert setting.design is not None
    assert leds_behind_body(setting.body, setting.design) == ()
    pose = setting.pose(middle)
    leds_part = (setting.body.leds_probe - setting.body.tip_probe) @ turn.T + centre
    leds = pose.apply(leds_part)
    looks = setting.body.led_directions_probe @ turn.T @ pose.rotation.T
    both = np.ones(len(leds), dtype=np.bool_)
    for camera in setting.rig.cameras:
        ray = camera.centre_world - leds
        cosine = (looks * ray).sum(axis=1) / np.linalg.norm(ray, axis=1)
        both &= cosine >= np.cos(setting.body.emission_half_angle)
        both &= on_sensor(camera, project(camera, leds))
        eye = pose.inverse().apply(camera.centre_world)
        for number, led in enumerate(leds_part):
            line = BRepBuilderAPI_MakeEdge(gp_Pnt(*led.tolist()), gp_Pnt(*eye.tolist())).Edge()
            both[number] &= BRepExtrema_DistShapeShape(line, part).Value() > 0.0
    return int(both.sum())


def _probe(setting: Setting, pose: RigidTransform) -> list[Any]:
    """Return the solids of a probe whose ball is at the origin of its frame, put into a part."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere
    from OCP.gp import gp_Trsf

    design = setting.design
    assert design is not None
    solids = [BRepPrimAPI_MakeSphere(setting.ball_radius - _BALL_SLACK_MM).Shape()]
    solids += [_section(design, section) for section in design.sections]
    across = np.cross(design.soft_probe, design.axis_probe)
    offset = next((one.offset_mm for one in design.sections if isinstance(one, Panel)), 0.0)
    for led in setting.body.leds_probe - setting.body.tip_probe:
        foot = led + (offset - led @ design.soft_probe) * design.soft_probe
        solids.append(_cone(foot, led, 2.0, 2.0, across))
    motion = gp_Trsf()
    m, t = pose.rotation, pose.translation
    motion.SetValues(*(float(x) for row in range(3) for x in (*m[row], t[row])))
    return [BRepBuilderAPI_Transform(solid, motion, True).Shape() for solid in solids]


def _section(design: ProbeDesign, section: Any) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Pnt, gp_Vec

    axis, soft = design.axis_probe, design.soft_probe
    across = np.cross(soft, axis)
    start, end = section.start_mm * axis, section.end_mm * axis
    if isinstance(section, Bar):
        first, last = (0.5 * size for size in section.diameter_mm)
        return _cone(start, end, first, last, across)
    half = 0.5 * section.core_mm + section.face_mm
    start, end = start + section.offset_mm * soft, end + section.offset_mm * soft
    first, last = (0.5 * size for size in section.width_mm)
    outline = BRepBuilderAPI_MakePolygon()
    for place, width in ((start, -first), (start, first), (end, last), (end, -last)):
        outline.Add(gp_Pnt(*(place + width * across - half * soft).tolist()))
    outline.Close()
    face = BRepBuilderAPI_MakeFace(outline.Wire()).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(*(2.0 * half * soft).tolist())).Shape()


def _cone(start: Float, end: Float, first: float, last: float, across: Float) -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    way = end - start
    length = float(np.linalg.norm(way))
    frame = gp_Ax2(gp_Pnt(*start.tolist()), gp_Dir(*way.tolist()), gp_Dir(*across.tolist()))
    if abs(first - last) < 1e-9:
        return BRepPrimAPI_MakeCylinder(frame, first, length).Shape()
    return BRepPrimAPI_MakeCone(frame, first, last, length).Shape()


def _shape(path: Path) -> Any:
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    return reader.OneShape()


def model_middle(part: Any) -> Float:
    """Return the middle of the box about a part, (3,), mm."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(part, box, False, False)
    low, high = box.CornerMin(), box.CornerMax()
    return 0.5 * np.array([low.X() + high.X(), low.Y() + high.Y(), low.Z() + high.Z()])


def _made(folder: Path) -> list[Path]:
    from tests.cad.step_models import MODELS, written

    return [
        written(folder / f"{name.replace(' ', '_')}.step", make())
        for name, (make, _) in MODELS.items()
    ]


if __name__ == "__main__":
    sys.exit(main())
