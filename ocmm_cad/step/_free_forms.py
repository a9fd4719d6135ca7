"""Free-form faces of a model, with places for a ball; needs OCP.

A free form is no element: its requirement is the profile of a surface (decision 60). Places lie
inside its edges, as far apart as possible, within reach of the probe and in sight of the cameras.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ocmm_cad.reach import Reach
from ocmm_cad.step._joined import EDGE_MM, NOT_INSIDE, Inside
from ocmm_cad.step._placed import LEAST, WANTED, reached_places
from ocmm_cad.step._profiled import StepFreeForm
from ocmm_cad.step.brep import StepDocument, Triple, box_size, model_face
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.part_model import ModelFace, NominalFace, nominal_face, searched, spread_places

_TRIED = 3
"""Candidates for reach and sight per place."""
_MOST = 100
"""Free forms of a model with places, the largest first: each takes some 0.05 s."""
_MOST_NUMBERS = 1_000_000
"""Numbers of all faces together: a message of some 20 MB."""


@dataclass(frozen=True, slots=True, eq=False)
class FreeFormRoom:
    """A free-form face, and room for a ball by the face itself; fields as `StepFreeForm`."""

    number: int
    name: str
    face: NominalFace | None = None
    points: Float = field(default_factory=lambda: np.empty((0, 3)))
    normals: Float = field(default_factory=lambda: np.empty((0, 3)))
    """`points`, `normals`: (n, 3), mm and unit: more than needed, in order of preference."""
    against: str = ""


def free_form_rooms(
    document: StepDocument,
    faces: Sequence[Any],
    taken: frozenset[int],
    ball_radius: float,
    doing: Callable[[str], None],
) -> list[FreeFormRoom]:
    """Return the free-form faces of a part, each with places or a reason against it.

    Without mesh. `faces`: with a surface. `taken`: numbers, from 1, of planes etc. `ball_radius`,
    mm.
    """
    others = [number for number in range(1, len(faces) + 1) if number not in taken]
    if len(others) > _MOST:
        sizes = {number: box_size(faces[number - 1]) for number in others}
        others.sort(key=lambda number: sizes[number], reverse=True)
    numbers = 0
    found = []
    for place, number in enumerate(others, start=1):
        if place > _MOST or numbers > _MOST_NUMBERS:
            against = "the model has many free forms, and places are looked for on larger ones"
            name = document.about(faces[number - 1]).name
            found.append(FreeFormRoom(number, name, against=against))
            continue
        doing(f"places on free form {place} of {min(len(others), _MOST)}")
        made = model_face(number, faces[number - 1], document, is_exact=True)
        one = _room(made, ball_radius)
        numbers += 0 if one.face is None else len(one.face.poles)
        found.append(one)
    return sorted(found, key=lambda one: one.number)


def free_forms_of(
    rooms: Sequence[FreeFormRoom], reach: Reach | None, doing: Callable[[str], None], inside: Inside
) -> list[StepFreeForm]:
    """Return free forms with targets (``reach``: None to skip; ``inside``: checks all places)."""
    found = []
    for place, room in enumerate(rooms, start=1):
        if not room.against:
            doing(f"targets on free form {place} of {len(rooms)}")
            room = _checked(room, inside)
        found.append(_with_targets(room, reach))
    return found


def _room(face: ModelFace, ball_radius: float) -> FreeFormRoom:
    if face.spline is None:
        against = "the library gives no exact surface of it"
        return FreeFormRoom(face.number, face.name, against=against)
    try:
        held = nominal_face(face)
    except InputError as error:
        return FreeFormRoom(face.number, face.name, against=error.what.rstrip("."))
    clear = ball_radius + EDGE_MM
    points, normals = spread_places(searched(held), _TRIED * WANTED, clear, ball_radius)
    if len(points) < LEAST:
        ball = f"a ball of {2.0 * ball_radius:g} mm"
        against = f"{ball} has room for {len(points)} points, {LEAST} are needed"
        return FreeFormRoom(face.number, face.name, against=against)
    return FreeFormRoom(face.number, face.name, held, points, normals)


def _checked(room: FreeFormRoom, inside: Inside) -> FreeFormRoom:
    good = inside([room.number], room.points)
    if np.count_nonzero(good) < LEAST:
        return FreeFormRoom(room.number, room.name, against=NOT_INSIDE)
    return replace(room, points=room.points[good], normals=room.normals[good])


def _with_targets(room: FreeFormRoom, reach: Reach | None) -> StepFreeForm:
    number, name = room.number, room.name
    if room.against:
        return StepFreeForm(number=number, name=name, against=room.against)
    points, normals = room.points[:WANTED], room.normals[:WANTED]
    ways, turns = np.empty(0), np.empty((0, 3))
    if reach is not None:
        asked = reach.of(room.points, room.normals, [number - 1])
        can, turns = reached_places(room.points, asked)
        if not len(can):
            return StepFreeForm(number=number, name=name, against=reach.why_not(asked))
        points, normals, ways = room.points[can], room.normals[can], asked.ways_mm[can]
    return StepFreeForm(
        number=number, name=name, face=room.face, targets=_triples(points),
        normals=_triples(normals), held=_triples(turns), ways=tuple(ways.tolist()),
    )  # fmt: skip


def _triples(rows: np.ndarray[Any, np.dtype[np.float64]]) -> tuple[Triple, ...]:
    return tuple((x, y, z) for x, y, z in rows.tolist())
