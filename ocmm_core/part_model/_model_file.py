"""A part as bytes: a JSON head and the arrays behind it, with their hash.

Layout, little-endian: the mark, the version, the length of the head (uint32 each), SHA-256 of all
that follows (32 bytes), the head, and the arrays without gaps in the order of `_body`.

Readers of CAD models are added by packages, by entry points of `ocmm.models`.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_core.documents import decode_json, read_bytes, write_atomic
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.part_model._part_model import ModelFace, PartModel, SplineSurface, check_model
from ocmm_core.plugins import load_all

MODEL_ENDING = ".ocmm-part"
LARGEST_MODEL = 32_000_000
"""Bytes; the maximum of a value of a job file."""
_MARK = b"OCMMPART"
_VERSION = 1
_FRONT = struct.Struct("<8sII32s")
_MOST_HEAD = 16_000_000
_MOST_ITEMS = 4_000_000
_Count = int


class _SplineHead(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    poles_u: _Count
    poles_v: _Count
    degree_u: _Count
    degree_v: _Count


class _FaceHead(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True,
                omit_defaults=True):  # fmt: skip
    number: int
    kind: str
    name: str = ""
    layer: str = ""
    colour: str = ""
    feature: str = ""
    outward: bool = True
    spline: _SplineHead | None = None
    loops: tuple[_Count, ...] = ()


class _Head(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    source_name: str
    source_sha256: str
    deflection_mm: float
    vertices: _Count
    triangles: _Count
    edge_points: _Count
    edges: _Count
    faces: tuple[_FaceHead, ...]


def model_to_bytes(model: PartModel) -> bytes:
    """Return a model as bytes for `model_from_bytes`; InputError if inconsistent or too large."""
    check_model(model, model.source_name)
    head = msgspec.json.encode(_head(model))
    body = b"".join(
        [head, *(np.ascontiguousarray(array, kind).tobytes() for array, kind in _body(model))]
    )
    if _FRONT.size + len(body) > LARGEST_MODEL:
        raise InputError(
            "part_model.too_large",
            f"{model.source_name}: its shape takes {len(body) / 1e6:.0f} MB, and at most "
            f"{LARGEST_MODEL / 1e6:.0f} MB can be kept.",
            "Export the model without parts and details that nobody measures.",
        )
    return _FRONT.pack(_MARK, _VERSION, len(head), hashlib.sha256(body).digest()) + body


def model_from_bytes(content: bytes, where: str) -> PartModel:
    """Return a model; `where`: for errors; InputError: no model, other version, inconsistent."""
    if len(content) > LARGEST_MODEL:
        raise _damaged(where, f"it has more than {LARGEST_MODEL / 1e6:.0f} MB")
    if len(content) < _FRONT.size or not content.startswith(_MARK):
        raise _damaged(where, "it is no part of OCMM")
    _, version, head_length, said = _FRONT.unpack_from(content)
    if version != _VERSION:
        raise InputError(
            "part_model.version",
            f"{where}: the part has version {version}, and this program reads version {_VERSION}.",
            "Open it with the version of OCMM that wrote it, or import the CAD model again.",
        )
    body = memoryview(content)[_FRONT.size :]
    if hashlib.sha256(body).digest() != said:
        raise _damaged(where, "its hash is another than it says")
    if head_length > min(len(body), _MOST_HEAD):
        raise _damaged(where, "its head is longer than it is")
    try:
        head = decode_json(bytes(body[:head_length]), _Head)
    except msgspec.MsgspecError as error:
        raise _damaged(where, f"its head cannot be read ({error})") from error
    model = _filled(head, _Arrays(body[head_length:], where))
    check_model(model, where)
    return model


def write_model_file(path: Path, model: PartModel) -> None:
    """Write a model atomically; InputError: inconsistent or too large; OSError."""
    write_atomic(path, model_to_bytes(model))


def read_model_file(path: Path) -> PartModel:
    """Return the model of a file of `write_model_file`; raises as `model_from_bytes`."""
    return model_from_bytes(read_bytes(path, LARGEST_MODEL), str(path))


def _head(model: PartModel) -> _Head:
    return _Head(
        source_name=model.source_name,
        source_sha256=model.source_sha256,
        deflection_mm=float(model.deflection_mm),
        vertices=len(model.vertices),
        triangles=len(model.triangles),
        edge_points=len(model.edge_points),
        edges=len(model.edge_faces),
        faces=tuple(_face_head(face) for face in model.faces),
    )


def _face_head(face: ModelFace) -> _FaceHead:
    spline = face.spline
    return _FaceHead(
        number=face.number,
        kind=face.kind,
        name=face.name,
        layer=face.layer,
        colour=face.colour,
        feature=face.feature,
        outward=face.outward,
        spline=None
        if spline is None
        else _SplineHead(
            len(spline.weights), spline.weights.shape[1], spline.degree_u, spline.degree_v
        ),
        loops=tuple(len(loop) for loop in face.loops),
    )


def _body(model: PartModel) -> list[tuple[NDArray[Any], str]]:
    """Return the arrays in their order, each with its number type."""
    arrays: list[tuple[NDArray[Any], str]] = [
        (model.vertices, "<f8"),
        (model.normals, "<f4"),
        (model.triangles, "<i4"),
        (model.triangle_faces, "<i4"),
        (model.edge_points, "<f8"),
        (model.edge_starts, "<i4"),
        (model.edge_faces, "<i4"),
    ]
    for face in model.faces:
        if (spline := face.spline) is not None:
            parts = (spline.poles, spline.weights, spline.knots_u, spline.knots_v)
            arrays += [(part, "<f8") for part in parts]
        arrays += [(loop, "<f8") for loop in face.loops]
    return arrays


class _Arrays:
    """Reader of the arrays behind the head."""

    def __init__(self, body: memoryview, where: str) -> None:
        self._body, self._where, self._at = body, where, 0

    def read(self, kind: str, *shape: int) -> NDArray[Any]:
        """Return the next array; InputError if the rest is too short."""
        if any(not 0 <= length <= _MOST_ITEMS for length in shape):
            raise _damaged(self._where, "it says a length that cannot be")
        # Python integers: a product of lengths from a file has no bound.
        count = 1
        for length in shape:
            count *= length
        end = self._at + count * np.dtype(kind).itemsize
        if end > len(self._body):
            raise _damaged(self._where, "it ends too early")
        array = np.frombuffer(self._body[self._at : end], kind).reshape(shape)
        self._at = end
        return array.astype(np.int32 if kind == "<i4" else np.float64)

    def at_end(self) -> None:
        """Raise InputError where bytes are left."""
        if self._at != len(self._body):
            raise _damaged(self._where, "it goes on after its end")


def _filled(head: _Head, arrays: _Arrays) -> PartModel:
    vertices = arrays.read("<f8", head.vertices, 3)
    normals = arrays.read("<f4", head.vertices, 3)
    triangles = arrays.read("<i4", head.triangles, 3)
    triangle_faces = arrays.read("<i4", head.triangles)
    edge_points = arrays.read("<f8", head.edge_points, 3)
    edge_starts = arrays.read("<i4", head.edges + 1)
    edge_faces = arrays.read("<i4", head.edges, 2)
    faces = tuple(_face(face, arrays) for face in head.faces)
    arrays.at_end()
    return PartModel(
        source_name=head.source_name,
        source_sha256=head.source_sha256,
        vertices=vertices,
        normals=_unit(normals),
        triangles=triangles,
        triangle_faces=triangle_faces,
        faces=faces,
        edge_points=edge_points,
        edge_starts=edge_starts,
        edge_faces=edge_faces,
        deflection_mm=head.deflection_mm,
    )


def _face(head: _FaceHead, arrays: _Arrays) -> ModelFace:
    spline = None
    if (size := head.spline) is not None:
        spline = SplineSurface(
            poles=arrays.read("<f8", size.poles_u, size.poles_v, 3),
            weights=arrays.read("<f8", size.poles_u, size.poles_v),
            knots_u=arrays.read("<f8", size.poles_u + size.degree_u + 1),
            knots_v=arrays.read("<f8", size.poles_v + size.degree_v + 1),
            degree_u=size.degree_u,
            degree_v=size.degree_v,
        )
    loops = tuple(arrays.read("<f8", count, 2) for count in head.loops)
    return ModelFace(
        number=head.number,
        kind=head.kind,
        name=head.name,
        layer=head.layer,
        colour=head.colour,
        spline=spline,
        outward=head.outward,
        loops=loops,
        feature=head.feature,
    )


def _unit(normals: Float) -> Float:
    """Return normals with the length lost by rounding restored; others are kept."""
    with np.errstate(over="ignore", invalid="ignore"):
        lengths = np.linalg.norm(normals, axis=1)
        near = np.abs(lengths - 1.0) < 1e-3
        return normals / np.where(near, lengths, 1.0)[:, None]


def _damaged(where: str, why: str) -> InputError:
    return InputError(
        "part_model.damaged",
        f"{where}: the part in it cannot be used: {why}.",
        "Import the CAD model again, or restore the file from a good copy.",
    )


GROUP = "ocmm.models"
STEP_ENDINGS = (".step", ".stp", ".p21")
"""Of models that a plan may name, whether or not their reader is installed."""


class FilesOfModel(Protocol):
    """A model, and the files of its folder that it names."""

    @property
    def top(self) -> Path: ...
    @property
    def sha256(self) -> str:
        """Return the hash of all bytes."""

    @property
    def parts(self) -> Mapping[str, bytes]:
        """Return the content of each other file by its name, relative to the folder of `top`."""

    def copied(self, folder: Path, stem: str = "model") -> Path:
        """Copy all files to a folder and return the renamed copy of `top`; raises OSError."""


@dataclass(frozen=True, slots=True)
class ModelReader:
    """Reader of one format; errors as InputError that names the file."""

    endings: tuple[str, ...]
    """Endings of its files, in lower case with the dot."""
    files: Callable[[Path], FilesOfModel]
    read: Callable[[Path, Callable[[], bool], Callable[[str], None]], PartModel]
    """Of a path, whether to give up, and progress; mm, frame of the file."""


def model_endings() -> tuple[str, ...]:
    """Return the endings of CAD models that a plan may name."""
    added = (ending for one in _readers() for ending in one.endings)
    return tuple(dict.fromkeys((*STEP_ENDINGS, *added)))


def model_reader(path: Path) -> ModelReader:
    """Return the reader of a model; InputError if none is installed for its ending."""
    ending = path.suffix.lower()
    for one in _readers():
        if ending in one.endings:
            return one
    raise InputError(
        "plan.no_reader",
        f"{path}: this program has no reader of CAD models ending in '{ending}'.",
        "Install the package of the reader; of STEP files, ocmm_cad.",
    )


def _readers() -> Iterator[ModelReader]:
    return load_all(GROUP, ModelReader)
