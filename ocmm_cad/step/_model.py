"""Features of a plan from the surfaces of a STEP file, read by an expendable process."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import msgspec
import numpy as np

from ocmm_cad.pmi import Pmi
from ocmm_cad.reach import TILT_DEG, Setting
from ocmm_cad.step import _profiled as profiled
from ocmm_cad.step._asking import REMEDY, Asking, request_answer
from ocmm_cad.step._model_files import step_error
from ocmm_cad.step._worker import Wanted
from ocmm_cad.step.brep import StepFace, Triple
from ocmm_core.calibration.probe_design import load_design, shipped_design
from ocmm_core.camera import Rig, load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape, shape_fault
from ocmm_core.part_model import PartModel, Placement
from ocmm_core.tracking import ProbeBody, load_probe


class StepRequest(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    ball_mm: float
    probe: str = ""
    """Document of the probe; empty to ignore stylus and body."""
    design: str = ""
    """Document of its design; empty for the shipped one of that name, if any."""
    rig: str = ""
    """Document of the cameras; empty to ignore sight."""
    up: Triple = (0.0, 0.0, 1.0)
    """Direction of the model that points up."""
    turn_deg: float = 0.0
    """Rotation about the vertical, applied after ``up``."""
    offset_world: Triple = (0.0, 0.0, 0.0)
    """mm: of the middle of the part from that of the measuring volume."""
    tilt_deg: float = TILT_DEG
    """Largest angle of the handle from upright."""


def usual_request(
    probe: Path | None = None, rig: Path | None = None, *, ball_mm: float | None = None
) -> StepRequest:
    """Return a request, by default with shipped documents, upright; InputError for a bad probe."""
    probe = resource("probes", "standard.toml") if probe is None else probe
    rig = resource("rigs", "recommended.toml") if rig is None else rig
    ball = 2.0 * load_probe(probe).tip_radius if ball_mm is None else ball_mm
    return StepRequest(ball_mm=ball, probe=str(probe), rig=str(rig))


def setting_for(body: ProbeBody, rig: Rig, up: Triple) -> Setting:
    """Return a setting with ``up`` upwards; InputError if the probe design is unusable."""
    design = shipped_design(body)
    return Setting(
        body=body,
        design=None if design is None else load_design(design, body),
        rig=rig,
        placement=Placement(up),
    )


def up_of(word: str) -> Triple:
    """Return the direction of a word such as ``+z``, ``-y`` or ``x``; InputError otherwise."""
    sign, axis = (word[0], word[1:]) if word[:1] in ("+", "-") else ("+", word)
    if axis.lower() not in ("x", "y", "z"):
        raise InputError(
            "plan.placement",
            f"'{word}' is no axis of the model.",
            "Give the axis that points up: +x, -x, +y, -y, +z or -z.",
        )
    x, y, z = ((-1.0 if sign == "-" else 1.0) * (axis.lower() == one) + 0.0 for one in "xyz")
    return (x, y, z)


def setting_of(request: StepRequest) -> Setting | None:
    """Return probe, cameras and placement of a request; None for the ball alone.

    InputError if a document cannot be used, or no direction points up.
    """
    sizes = (*request.up, *request.offset_world, request.turn_deg, request.tilt_deg)
    if not np.isfinite(sizes).all() or np.linalg.norm(request.up) < 1e-6:
        raise InputError(
            "plan.placement",
            f"The part cannot stand with {request.up} pointing up.",
            "Name an axis of the model, such as +z or -y.",
        )
    if not request.probe:
        return None
    body = load_probe(request.probe)
    design = Path(request.design) if request.design else shipped_design(body)
    return Setting(
        body=body,
        design=None if design is None else load_design(design, body),
        rig=load_rig(request.rig) if request.rig else None,
        placement=Placement(request.up, request.turn_deg, request.offset_world),
        ball_mm=request.ball_mm,
        tilt_deg=request.tilt_deg,
    )


USUAL_BALL_MM = 6.0
"""Diameter of the ball of the standard probe."""
TIMEOUT_S = 120.0
MOST_FEATURES = 10_000
_DECIMALS = 6


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A surface that is not selected by default."""

    feature: NominalFeature
    """The possible feature, without targets."""
    why: str
    """Part of a sentence."""
    faces: tuple[int, ...] = ()
    """Numbers of its faces, see `ModelFace`."""


@dataclass(frozen=True, slots=True)
class ReachableTargets:
    """Faces and attitudes of a feature's targets."""

    faces: tuple[int, ...] = ()
    """Numbers of its faces, see `ModelFace`."""
    held: tuple[Triple, ...] = ()
    """Attitude of the probe at each target: rotation vector, rad, model from probe; or empty."""
    ways: tuple[float, ...] = ()
    """mm: free straight way along the normal at each target."""


@dataclass(frozen=True, slots=True)
class StepModel:
    """Contents of a model."""

    features: tuple[NominalFeature, ...]
    """Surfaces that can be probed, with targets on their faces, in the frame of the model."""
    left_out: tuple[LeftOut, ...]
    """Surfaces with a reason against them, such as fillets, engraved text and narrow faces."""
    others: dict[str, int]
    """Number of faces with another kind of surface, by its word."""
    part: PartModel | None = None
    """The part itself, if requested; its faces name their features."""
    pmi: Pmi | None = None
    """Tolerances of the file; None if not read."""
    faces: dict[int, tuple[str, ...]] = field(default_factory=dict)
    """Surfaces (of both lists) by face number in the file; several for a repeated part."""
    face_words: dict[int, str] = field(default_factory=dict)
    """Kind of surface of every face of the file, by its number there."""
    reached: tuple[ReachableTargets, ...] = ()
    """Per item of ``features``."""
    remark: str = ""
    """Omitted checks of targets, as a sentence; empty if none."""
    free_forms: tuple[profiled.FreeForm, ...] = ()
    """Free forms that can be measured as profiles."""
    not_measured: dict[str, int] = field(default_factory=dict)
    """Reasons against other free forms, and their counts."""
    face_count: int = 0
    """Of the file, of all components of an assembly."""
    recognised: dict[str, float] = field(default_factory=dict)
    """Surfaces that are splines in the file, by name: largest distance from the spline, mm."""
    unasked: Setting | None = None
    """To check selected surfaces with, see `ask_for_chosen`; None if all were, or no request."""


def read_model(
    path: Path | str,
    ball_mm: float = USUAL_BALL_MM,
    timeout_s: float = TIMEOUT_S,
    given_up: Callable[[], bool] = lambda: False,
    progress: Callable[[str], None] = lambda _: None,
    with_part: bool = False,
    request: StepRequest | None = None,
    setting: Setting | None = None,
) -> StepModel:
    """Return planes, cylinders, cones, spheres, tori and free forms of a model, in its own frame.

    Faces of one round surface are joined if they touch or are adjacent about its axis; two bores on
    one axis stay two. A separate, expendable process reads the file. ``ball_mm``: diameter that
    needs room on a face and in a bore. ``timeout_s``: CPU time. ``given_up``: polled some twenty
    times a second. ``progress``: the current step, part of a sentence. ``request``: probe, cameras
    and placement to choose targets by, else only room for the ball is checked; its ball overrides
    ``ball_mm``. ``setting``: the same from loaded objects; overrides the others. InputError: the
    extra is not installed, no readable STEP file, no such surfaces, too slow or cancelled. With a
    request all may be left out, out of reach.
    """
    path = Path(path)
    asking = Asking(timeout_s, given_up, progress)
    if setting is not None:
        ball_mm = 2.0 * setting.ball_radius
    elif request is not None:
        ball_mm, setting = request.ball_mm, setting_of(request)
    said, part = request_answer(path, Wanted(ball_mm, setting), with_part, asking)
    model = _model(path, said, part, may_be_empty=setting is not None)
    return replace(model, unasked=setting) if said.remark else model


def read_part(
    path: Path | str,
    timeout_s: float = TIMEOUT_S,
    given_up: Callable[[], bool] = lambda: False,
    progress: Callable[[str], None] = lambda _: None,
) -> PartModel:
    """Return the part in a STEP file, in the frame of the file and in mm.

    All faces of the solids, of all components of an assembly; parameters and errors as of
    `read_model`.
    """
    path = Path(path)
    _, part = request_answer(path, Wanted(), True, Asking(timeout_s, given_up, progress))
    if part is None:
        raise step_error(path, "no part was made of it", REMEDY)
    return part


def _model(
    path: Path, said: profiled.StepAnswer, part: PartModel | None, *, may_be_empty: bool
) -> StepModel:
    chosen = [one for one in said.surfaces if not one.against]
    # If the part obstructs the probe it can be turned: the reasons explain it.
    least = 0 if said.free_forms or (may_be_empty and said.surfaces) else 1
    if not least <= len(chosen) <= MOST_FEATURES:
        raise step_error(path, *_no_plan_of(said, len(chosen)))
    surfaces = (*chosen, *(one for one in said.surfaces if one.against))
    made = [_feature(surface, "") for surface in surfaces]
    words = [
        next(filter(None, (said.face_names.get(number) for number in surface.numbers)), "")
        for surface in surfaces
    ]
    named = profiled.feature_names(made, words)
    faults = [_fault(feature, surface) for feature, surface in zip(made, surfaces, strict=True)]
    features: list[NominalFeature] = []
    left_out: list[LeftOut] = []
    owners: dict[int, str] = {}
    reached: list[ReachableTargets] = []
    recognised: dict[str, float] = {}
    for surface, nameless, name, fault in zip(surfaces, made, named, faults, strict=True):
        feature = msgspec.structs.replace(nameless, name=name)
        owners.update(dict.fromkeys(surface.numbers, feature.name))
        if surface.face.deviation_mm is not None:
            recognised[name] = surface.face.deviation_mm
        if fault:
            bare = msgspec.structs.replace(feature, targets=())
            left_out.append(LeftOut(bare, fault, surface.numbers))
        else:
            features.append(feature)
            reached.append(ReachableTargets(surface.numbers, surface.held, surface.ways))
    free_forms, against = profiled.free_forms_of(said.free_forms, named)
    return StepModel(
        tuple(features), tuple(left_out), dict(said.others), _with_owners(part, owners), said.pmi,
        _in_file(owners, said.face_entities), said.face_words,
        tuple(reached), said.remark, free_forms, dict(against + Counter(said.faults)),
        said.face_count, recognised,
    )  # fmt: skip


def _fault(feature: NominalFeature, surface: profiled.StepSurface) -> str:
    """Return why a surface is no feature, as a part of a sentence; empty if it is one."""
    if surface.against:
        return surface.against
    sizes = (*feature.point, *feature.direction, feature.length, feature.width, feature.diameter)
    if not np.isfinite(sizes).all():
        return "its size or place is not that of a part"
    wrong = shape_fault(feature)
    if wrong is None:
        return ""
    place, fault = wrong
    return f"no plan can hold it: its {place} {fault}"


def _no_plan_of(said: profiled.StepAnswer, count: int) -> tuple[str, str]:
    reasons = Counter(one.against for one in said.surfaces if one.against)
    reasons.update(one.against for one in said.free_forms if one.against)
    reasons.update(said.faults)
    if not count and reasons:
        (why, often), *_ = reasons.most_common(1)
        whole = len(said.surfaces) + len(said.free_forms) + sum(said.faults.values())
        return (
            f"none of its {whole} surfaces can be probed; most often ({often} of them), {why}",
            "Check the unit of the model, or choose a smaller ball."
            if why != profiled.OPEN
            else "Have the model repaired where it was designed, and export it again.",
        )
    return (
        f"it has {count} surfaces that can be probed (planes, cylinders, cones, spheres, "
        f"tori), of {said.face_count} faces",
        f"Give a model with 1 to {MOST_FEATURES} of them.",
    )


def _in_file(owners: dict[int, str], entities: dict[int, int]) -> dict[int, tuple[str, ...]]:
    found: dict[int, tuple[str, ...]] = {}
    for number, entity in entities.items():
        if number in owners:
            found[entity] = (*found.get(entity, ()), owners[number])
    return found


def _with_owners(part: PartModel | None, owners: dict[int, str]) -> PartModel | None:
    if part is None:
        return None
    faces = (replace(face, feature=owners.get(face.number, "")) for face in part.faces)
    return replace(part, faces=tuple(faces))


def _feature(surface: profiled.StepSurface, name: str) -> NominalFeature:
    face = surface.face
    shape = Shape(face.shape)
    middle, radius = _middle(face)
    width = 2.0 * face.second if shape.spec.has_size("width") else face.width
    return NominalFeature(
        name=name,
        shape=shape,
        points=shape.spec.usual_points,
        point=_rounded(middle),
        direction=_rounded(face.direction),
        across=_rounded(face.across),
        diameter=round(2.0 * radius, _DECIMALS),
        length=round(face.high - face.low, _DECIMALS),
        width=round(width, _DECIMALS),
        angle_deg=round(2.0 * float(np.degrees(face.half_angle)), _DECIMALS),
        side="inner" if face.inner else "outer",
        targets=tuple(map(_rounded, surface.targets)),
    )


def _middle(face: StepFace) -> tuple[np.ndarray[tuple[int], np.dtype[np.float64]], float]:
    """Return the middle of the touched region, (3,), mm, and the radius there."""
    point, direction = np.array(face.point), np.array(face.direction)
    along = 0.5 * (face.low + face.high)
    if face.shape == "Cylinder":
        return point + along * direction, face.radius
    if face.shape == "Cone":
        return point + along * direction, along * float(np.tan(face.half_angle))
    return point, face.radius


def _rounded(values: Iterable[float]) -> Triple:
    x, y, z = values
    # Plain numbers: a model has a hundred thousand targets, and numpy scalars take five times as
    # long.
    return (
        round(float(x), _DECIMALS) + 0.0,
        round(float(y), _DECIMALS) + 0.0,
        round(float(z), _DECIMALS) + 0.0,
    )
