"""Faces of a STEP file as numbers: their surface, places on them and their edges; needs OCP."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ocmm_cad.step.brep import _edge_steps as edge_steps
from ocmm_cad.step.brep import _surface_kernel as kernel
from ocmm_cad.step.brep._library import explored, is_turned, kind_of, static
from ocmm_cad.step.brep._recognised import LESS, StepFace, elementary_face, recognised_face
from ocmm_core.geometry import Float
from ocmm_core.part_model import FARTHEST_MM, MOST_FACES

ENDLESS = "endless surface"
"""Word for faces without an end, among the kinds of surfaces."""
_DEFLECTION_MM = 0.02
"""A shorter edge is a tip or a pole."""
_GAP_MM = 0.1
"""Gaps left between edges by careless exporters; too small to misplace a target."""


class UnusableModelError(ValueError):
    """A model without a surface that can be probed, with the remedy."""

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(what)
        self.what, self.remedy = what, remedy


@dataclass(frozen=True, slots=True)
class Rim:
    line: Float
    """(n, 3), mm: points along it."""
    normal: Float
    """(3,): normal out of the material in its middle, on this face."""


@dataclass(frozen=True, slots=True)
class RawFace:
    """A face with places inside its edges."""

    face: StepFace
    """Its untrimmed surface."""
    places: Float
    """(n, 3), mm: on the surface and inside the edges."""
    rims: tuple[Rim, ...]
    """Its edges; seams of the surface itself occur twice."""
    number: int = 0
    """Of the face among those with a surface, from 1."""

    @property
    def is_closed(self) -> bool:
        """Return whether its edges close without a gap; else its inside is undefined."""
        ends = np.array([(rim.line[0], rim.line[-1]) for rim in self.rims])
        return go_round(ends.reshape(-1, 2, 3))


@dataclass(frozen=True, slots=True)
class FoundFaces:
    faces: tuple[RawFace, ...]
    """Those with a plane, cylinder, cone, sphere or torus."""
    others: Counter[str]
    """Number of faces with another kind of surface, by its word."""
    faults: dict[int, str]
    """Why faces cannot be used, as a part of a sentence, by number."""


def as_numbers(number: Any) -> float:
    return float(number)


def faces_of(
    with_surface: Sequence[Any], doing: Callable[[str], None], steps: edge_steps.EdgeSteps
) -> FoundFaces:
    """Return the faces with a plane, cylinder, cone, sphere or torus, and counts of the others.

    Placed as in assemblies, in mm. An unusable face is a fault of its own, not of the model.
    """
    found: list[RawFace] = []
    others: Counter[str] = Counter()
    faults: dict[int, str] = {}
    for number, face in enumerate(with_surface, start=1):
        doing(f"face {number} of {len(with_surface)}")
        try:
            kind, raw = _raw_face(face, number, steps)
        except MemoryError:
            raise
        except ValueError as error:
            faults[number] = str(error)
        except Exception:
            # The library raises many classes, with its own codes as text.
            faults[number] = "the geometry library cannot use its surface or its edges"
        else:
            if raw is None:
                others[kind] += 1
            else:
                found.append(raw)
    return FoundFaces(tuple(found), others, faults)


def faces_with_surface(shape: Any) -> tuple[list[Any], Counter[str]]:
    """Return the faces of a part with an exact surface, and counts of the others.

    Beside solids, faces are construction geometry, only counted. ValueError if none, or too many.
    """
    from OCP.BRep import BRep_Tool

    faces, loose = _faces_of_parts(shape)
    surface_of = static(BRep_Tool, "Surface")
    # Querying the kind of a face without surface crashes the process.
    with_surface = [face for face in faces if surface_of(face) is not None]
    if faces and not with_surface:
        count = len(faces) + loose
        raise UnusableModelError(
            f"it is a tessellated model: {count} faces, and none of a part has an exact surface",
            "Export the model with exact geometry (B-rep), not tessellated (mesh).",
        )
    others: Counter[str] = Counter()
    if loose:
        others["construction geometry"] = loose
    if len(with_surface) < len(faces):
        others["tessellated"] = len(faces) - len(with_surface)
    near = _near_faces(shape, with_surface)
    if len(near) < len(with_surface):
        others[ENDLESS] = len(with_surface) - len(near)
    return near, others


def _near_faces(shape: Any, faces: list[Any]) -> list[Any]:
    """Return faces without those that end nowhere near a part; all if there is no other."""
    if box_size(shape) > 0.0:
        return faces
    return [face for face in faces if box_size(face) > 0.0] or faces


def box_size(shape: Any) -> float:
    """Return the diagonal of the box about surfaces and edges, mm; 0 if infinite or NaN."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    static(BRepBndLib, "Add")(shape, box, False)
    size = 0.0 if box.IsVoid() else math.sqrt(box.SquareExtent())
    return size if size < FARTHEST_MM else 0.0


def _faces_of_parts(shape: Any) -> tuple[list[Any], int]:
    """Return the faces of the solids and the number of others; all without solids."""
    has_solids, faces = False, list[Any]()
    for solid in explored(shape, "SOLID"):
        has_solids = True
        _take_faces(solid, faces)
    if not has_solids:
        _take_faces(shape, faces)
        return faces, 0
    return faces, sum(1 for _ in explored(shape, "FACE", but_in="SOLID"))


def _take_faces(shape: Any, faces: list[Any]) -> None:
    """Add the faces of a shape; a small file can hold millions through nested assemblies."""
    for face in explored(shape, "FACE"):
        faces.append(face)
        if len(faces) > MOST_FACES:
            raise UnusableModelError(
                f"it has more than {MOST_FACES} faces, and no part can have more", LESS
            )


def _raw_face(face: Any, number: int, steps: edge_steps.EdgeSteps) -> tuple[str, RawFace | None]:
    from OCP.BRepAdaptor import BRepAdaptor_Surface

    surface = BRepAdaptor_Surface(face, True)
    reverse = is_turned(face)
    kind = kind_of(surface)
    as_said = elementary_face(surface, reverse)
    if as_said is None:
        curves = _curves(face, steps)
        known = recognised_face(face, surface, reverse, curves.on_face(), curves.starts)
        if known is None:
            return kind, None
        as_said, places, lines, normals, lengths = known
        curves.refuse_off(lines)
        _check(as_said)
        rims = rims_of(curves.starts, lines, normals, lengths)
        return kind, RawFace(as_said, places, rims, number)
    _check(as_said)
    rims, places = _edges(_curves(face, steps), edge_steps.surface_numbers(surface), reverse)
    return kind, RawFace(as_said, places, rims, number)


def _check(face: StepFace) -> None:
    """Refuse infinite sizes and places, which JSON cannot represent either."""
    sizes = (face.radius, face.second, face.half_angle, face.low, face.high, face.width)
    if not all(map(math.isfinite, (*sizes, *face.point, *face.direction, *face.across))):
        msg = f"the size or place of a {face.shape} is not a number"
        raise ValueError(msg)


@dataclass(frozen=True, slots=True, eq=False)
class _Curves:
    """Edges of a face in the form of `_surface_kernel.run_along`."""

    kinds: NDArray[np.int64]
    numbers: Float
    starts: NDArray[np.int64]
    along: Float
    uv: Float
    """Filled in for `kernel.OTHER` curves."""
    middles: Float
    """(m, 3), mm: the middle of each edge, by its curve in space; NaN for a point."""

    def refuse_off(self, lines: Float) -> None:
        """Raise ValueError for a damaged face: edges (n, 3), mm, off their own curves."""
        at = self.starts[:-1] + np.diff(self.starts) // 2
        off = np.linalg.norm(lines[at] - self.middles, axis=1)
        for row in np.flatnonzero(off > _GAP_MM).tolist():
            # The parameter of an edge may run differently on the surface without moving the line.
            away = _away(self.middles[row], lines[self.starts[row] : self.starts[row + 1]])
            if away <= _GAP_MM:
                continue
            msg = f"its edges lie off its surface (by {away:.3g} mm)"
            raise ValueError(msg)

    def on_face(self) -> Float:
        """Return the parameters (n, 2) of all edges on the face."""
        uv, at = self.uv.copy(), self.along[:, None]
        kind = np.repeat(self.kinds, np.diff(self.starts))
        six = np.repeat(self.numbers, np.diff(self.starts), axis=0)
        straight, ring = kind == kernel.LINE, kind == kernel.RING
        uv[straight] = (six[:, :2] + at * six[:, 2:4])[straight]
        uv[ring] = (six[:, :2] + np.cos(at) * six[:, 2:4] + np.sin(at) * six[:, 4:])[ring]
        return uv


def _away(point: Float, line: Float) -> float:
    """Return the distance of a point (3,) from a line (n, 3), mm."""
    starts, ways = line[:-1], np.diff(line, axis=0)
    squares = np.maximum((ways * ways).sum(axis=1), 1e-30)
    shares = np.clip(((point - starts) * ways).sum(axis=1) / squares, 0.0, 1.0)
    return float(np.linalg.norm(starts + shares[:, None] * ways - point, axis=1).min())


def _curves(face: Any, steps: edge_steps.EdgeSteps) -> _Curves:
    from OCP.BRepAdaptor import BRepAdaptor_Curve2d

    kinds: list[int] = []
    numbers: list[tuple[float, ...]] = []
    alongs: list[Float] = []
    middles: list[edge_steps.Place] = []
    others: dict[int, Float] = {}
    for edge in explored(face, "EDGE"):
        curve = BRepAdaptor_Curve2d(edge, face)
        along, middle = steps.lookup(edge, curve.FirstParameter(), curve.LastParameter())
        middles.append(middle)
        kind, six = edge_steps.curve_numbers(curve)
        if kind == kernel.OTHER:
            others[len(kinds)] = edge_steps.parameters_on(curve, along)
        kinds.append(kind)
        numbers.append(six)
        alongs.append(along)
    starts = np.zeros(len(kinds) + 1, dtype=np.int64)
    np.cumsum([len(one) for one in alongs], out=starts[1:])
    uv = np.zeros((starts[-1], 2))
    for row, known in others.items():
        uv[starts[row] : starts[row + 1]] = known
    return _Curves(
        np.array(kinds, dtype=np.int64), np.array(numbers).reshape(-1, 6), starts,
        np.concatenate([np.empty(0), *alongs]), uv, np.array(middles).reshape(-1, 3),
    )  # fmt: skip


def _edges(
    curves: _Curves, surface: tuple[int, Float, Float], reverse: bool
) -> tuple[tuple[Rim, ...], Float]:
    count, length = len(curves.kinds), len(curves.uv)
    if not count:
        return (), np.empty((0, 3))
    lines, normals, lengths = np.empty((length, 3)), np.empty((count, 3)), np.empty(count)
    kernel.run_along(
        *surface, -1.0 if reverse else 1.0, curves.kinds, curves.numbers, curves.starts,
        curves.along, curves.uv, lines, normals, lengths,
    )  # fmt: skip
    rims = rims_of(curves.starts, lines, normals, lengths)
    curves.refuse_off(lines)
    return rims, kernel.places_inside(*surface, curves.uv, curves.starts)


def rims_of(
    starts: NDArray[np.int64], lines: Float, normals: Float, lengths: Float
) -> tuple[Rim, ...]:
    """Return the edges of a face that are edges in space, see `_surface_kernel.run_along`.

    ValueError for an edge without a place: a target could lie on it unnoticed.
    """
    if not np.isfinite(lengths).all():
        msg = "the place of an edge is not a number"
        raise ValueError(msg)
    ends = starts.tolist()
    # The tip of a cone or the pole of a sphere is an edge in the parameters only.
    return tuple(
        Rim(lines[ends[row] : ends[row + 1]], normals[row])
        for row, length in enumerate(lengths.tolist())
        if length >= _DEFLECTION_MM
    )


def go_round(ends: Float) -> bool:
    """Return whether edges with ends (n, 2, 3), mm, leave no gap: at a corner two meet."""
    loose = ends[np.abs(ends[:, 0] - ends[:, 1]).max(axis=1) > _GAP_MM].reshape(-1, 3)
    if not len(loose):
        return True
    if not np.any(cKDTree(loose).query_ball_point(loose, _GAP_MM, return_length=True) % 2):
        return True
    # Edges no longer than a gap, as of a curve exported as a thousand lines: chains of near ends
    # belong to one corner.
    every = ends.reshape(-1, 3)
    near = cKDTree(every).query_pairs(_GAP_MM, output_type="ndarray")
    links = coo_array((np.ones(len(near)), (near[:, 0], near[:, 1])), shape=(len(every),) * 2)
    _, corner = connected_components(links, directed=False)
    return not np.any(np.bincount(corner) % 2)


def stretches_of(line: Float) -> Float:
    """Return the stretches (n - 1, 2, k) of a line (n, k)."""
    found = np.empty((len(line) - 1, 2, line.shape[1]))
    found[:, 0], found[:, 1] = line[:-1], line[1:]
    return found
