"""The reading of a STEP file itself, in a process of its own; only this file needs OCP.

The geometry kernel is C++ that is given whatever somebody saved: if it ends the process, or never
comes back, the program that asked goes on.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from typing import Any

import msgspec
import numpy as np

from ocmm_core.failure import contained
from ocmm_core.host import HOST

_ROUND_TO = 6
_LEAST_TURN = np.radians(170.0)
"""A round face that spans less, with those beside it, is a fillet and no feature."""
_MOST_BYTES = 1_500_000_000


@dataclass(frozen=True, slots=True)
class StepFace:
    """A surface of the model.

    Attributes
    ----------
    shape
        Word of `features.shapes.Shape`.
    point, direction, across
        mm and unit: middle of the face, normal out of the material or axis, and direction of its
        length.
    radius, second, half_angle
        As in `features.shapes.element`, mm and rad.
    low, high
        mm: extent along ``direction`` from ``point`` for round faces, along ``across`` for planes.
    width
        mm: extent of a plane square to ``across``.
    turn
        rad: how much of the turn the face spans.
    inner
        The material is outside.
    """

    shape: str
    point: tuple[float, float, float]
    direction: tuple[float, float, float]
    across: tuple[float, float, float] = (1.0, 0.0, 0.0)
    radius: float = 0.0
    second: float = 0.0
    half_angle: float = 0.0
    low: float = 0.0
    high: float = 0.0
    width: float = 0.0
    turn: float = 0.0
    inner: bool = False


class StepAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the reading sends as JSON: nothing that a damaged process sends becomes more than that.

    Attributes
    ----------
    faces
        The surfaces; none where there is a fault.
    fault
        What is wrong with the file, as a part of a sentence; "MISSING" where the extra is.
    error
        Code, what and remedy of what is wrong with the program.
    """

    faces: tuple[StepFace, ...] = ()
    fault: str = ""
    error: tuple[str, str, str] | None = None


def read_step(path: str, to: Connection) -> None:
    """Send the surfaces of a STEP file, or a sentence that says why there are none."""
    _be_silent()
    HOST.limit_memory(_MOST_BYTES)
    try:
        answer = StepAnswer(tuple(_merged(_finite(_faces(path)))))
    except ImportError:
        answer = StepAnswer(fault="MISSING")
    except ValueError as error:
        answer = StepAnswer(fault=str(error))
    except MemoryError:
        answer = StepAnswer(
            fault=f"reading it takes more than {_MOST_BYTES / 1e9:.1f} GB of memory"
        )
    except Exception as error:
        told = contained(error, "Reading the STEP file")
        answer = StepAnswer(error=(told.code, told.what, told.remedy))
    try:
        # Some of the numbers are numpy's.
        to.send_bytes(msgspec.json.encode(answer, enc_hook=lambda number: number.item()))
    finally:
        to.close()


def _finite(faces: list[StepFace]) -> list[StepFace]:
    """Return surfaces with sizes and places; a number without end is none in JSON either."""
    for face in faces:
        sizes = (face.radius, face.second, face.half_angle, face.low, face.high, face.width)
        if not np.isfinite([*sizes, *face.point, *face.direction, *face.across]).all():
            msg = f"the size or place of a {face.shape} is not a number"
            raise ValueError(msg)
    return faces


def _be_silent() -> None:
    """Keep what the geometry kernel prints out of the terminal of the program that asked."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    for descriptor in (1, 2):
        os.dup2(nothing, descriptor)
    os.close(nothing)


def _faces(path: str) -> list[StepFace]:
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    reader = STEPControl_Reader()
    if reader.ReadFile(path) != IFSelect_RetDone:
        msg = "not a complete STEP file"
        raise ValueError(msg)
    reader.TransferRoots()
    shape = reader.OneShape()
    if shape is None or shape.IsNull():
        msg = "contains no shape"
        raise ValueError(msg)
    # The older of the versions that are allowed call it otherwise.
    as_face = getattr(TopoDS, "Face", None) or TopoDS.Face_s
    explorer = TopExp_Explorer(shape, TopAbs_FACE)
    faces = []
    while explorer.More():
        face = as_face(explorer.Current())
        found = _face(BRepAdaptor_Surface(face, True), face.Orientation() == TopAbs_REVERSED)
        faces += [found] if found is not None else []
        explorer.Next()
    return faces


def _face(surface: Any, reverse: bool) -> StepFace | None:
    from OCP.GeomAbs import (
        GeomAbs_Cone,
        GeomAbs_Cylinder,
        GeomAbs_Plane,
        GeomAbs_Sphere,
        GeomAbs_Torus,
    )

    kind = surface.GetType()
    u0, u1 = surface.FirstUParameter(), surface.LastUParameter()
    v0, v1 = surface.FirstVParameter(), surface.LastVParameter()
    middle, normal = _normal(surface, 0.5 * (u0 + u1), 0.5 * (v0 + v1), reverse)
    if kind == GeomAbs_Plane:
        across = _vector(surface.Plane().Position().XDirection())
        return StepFace(
            "Plane", _tuple(middle), _tuple(normal), _tuple(across),
            low=-0.5 * (u1 - u0), high=0.5 * (u1 - u0), width=v1 - v0,
        )  # fmt: skip
    if kind == GeomAbs_Cylinder:
        return _cylinder(surface, middle, normal, u1 - u0, v0, v1)
    if kind == GeomAbs_Cone:
        return _cone(surface, middle, normal, u1 - u0, v0, v1)
    if kind == GeomAbs_Sphere:
        ball = surface.Sphere()
        centre, axis = _vector(ball.Location()), _vector(ball.Position().Direction())
        inner = float(normal @ (middle - centre)) < 0.0
        return StepFace(
            "Sphere", _tuple(centre), _tuple(axis), radius=ball.Radius(), turn=u1 - u0, inner=inner
        )
    if kind == GeomAbs_Torus:
        ring = surface.Torus()
        centre, axis = _vector(ring.Location()), _vector(ring.Position().Direction())
        arm = middle - centre
        flat = arm - (arm @ axis) * axis
        core = centre + ring.MajorRadius() * flat / np.linalg.norm(flat)
        return StepFace(
            "Torus", _tuple(centre), _tuple(axis), radius=ring.MajorRadius(),
            second=ring.MinorRadius(), turn=u1 - u0, inner=float(normal @ (middle - core)) < 0.0,
        )  # fmt: skip
    return None


def _cylinder(
    surface: Any, middle: Any, normal: Any, turn: float, v0: float, v1: float
) -> StepFace:
    cylinder = surface.Cylinder()
    axis, start = _vector(cylinder.Axis().Direction()), _vector(cylinder.Location())
    sense = _sense(axis)
    # All faces of one cylinder get the same point: that of the axis nearest to the origin.
    foot = start - (start @ axis) * axis
    ends = sorted(((start @ axis + v0) * sense, (start @ axis + v1) * sense))
    arm = middle - foot
    return StepFace(
        "Cylinder", _tuple(foot), _tuple(sense * axis), radius=cylinder.Radius(), low=ends[0],
        high=ends[1], turn=turn, inner=float(normal @ (arm - (arm @ axis) * axis)) < 0.0,
    )  # fmt: skip


def _cone(surface: Any, middle: Any, normal: Any, turn: float, v0: float, v1: float) -> StepFace:
    cone = surface.Cone()
    half = cone.SemiAngle()
    axis, start = _vector(cone.Axis().Direction()), _vector(cone.Location())
    along = 0.5 * (v0 + v1) * np.cos(half)
    radius = cone.RefRadius() + 0.5 * (v0 + v1) * np.sin(half)
    centre = start + along * axis
    reach = 0.5 * (v1 - v0) * np.cos(half)
    arm = middle - centre
    return StepFace(
        "Cone", _tuple(centre), _tuple(axis if half > 0.0 else -axis), radius=radius,
        half_angle=abs(half), low=-reach, high=reach, turn=turn,
        inner=float(normal @ (arm - (arm @ axis) * axis)) < 0.0,
    )  # fmt: skip


def _normal(surface: Any, u: float, v: float, reverse: bool) -> tuple[Any, Any]:
    from OCP.gp import gp_Pnt, gp_Vec

    point, by_u, by_v = gp_Pnt(), gp_Vec(), gp_Vec()
    surface.D1(u, v, point, by_u, by_v)
    normal = np.cross(_vector(by_u), _vector(by_v))
    length = np.linalg.norm(normal)
    normal = normal / length if length > 0.0 else normal
    return _vector(point), -normal if reverse else normal


def _merged(faces: list[StepFace]) -> list[StepFace]:
    """Return the faces with those of one round surface together, and without fillets."""
    found: dict[tuple[object, ...], StepFace] = {}
    for number, face in enumerate(faces):
        key: tuple[object, ...] = (number,)
        if face.shape != "Plane":
            key = (
                face.shape, face.inner, _rounded(face.point), _rounded(face.direction),
                round(face.radius, _ROUND_TO), round(face.second, _ROUND_TO),
                round(face.half_angle, _ROUND_TO),
            )  # fmt: skip
        if key in found:
            old = found[key]
            face = replace(
                old, low=min(old.low, face.low), high=max(old.high, face.high),
                turn=max(old.turn, min(old.turn + face.turn, 2.0 * np.pi)),
            )  # fmt: skip
        found[key] = face
    return [face for face in found.values() if face.shape == "Plane" or face.turn >= _LEAST_TURN]


def _sense(axis: Any) -> float:
    largest = int(np.argmax(np.abs(np.round(axis, _ROUND_TO))))
    return 1.0 if axis[largest] > 0.0 else -1.0


def _vector(triple: Any) -> Any:
    return np.array([triple.X(), triple.Y(), triple.Z()])


def _rounded(values: tuple[float, float, float]) -> tuple[float, ...]:
    return tuple(round(value, _ROUND_TO) + 0.0 for value in values)


def _tuple(vector: Any) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return (x, y, z)
