"""Free-form faces of a model, with places on them where a ball can touch; needs OCP.

A free form is no element: what is asked of it is the profile of a surface (decision 64). The face
itself goes to whoever asked, exactly, and its places lie inside its edges, as far from each other
as can be, where the probe reaches them and cameras see it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.inspection.reach import Reach
from ocmm_core.inspection.step._answer import StepFreeForm, Triple
from ocmm_core.inspection.step._document import StepDocument
from ocmm_core.inspection.step._joined import EDGE_MM
from ocmm_core.inspection.step._part import model_face
from ocmm_core.inspection.step._placed import spread_rows
from ocmm_core.part_model import (
    ModelFace,
    nominal_face,
    searched,
    spread_places,
)

WANTED, LEAST = 20, 10
"""Places of a face: those of a free form tell nothing of each other, so there are more of them."""
_TRIED = 3
"""So many times the places are tried for reach and sight."""
_MOST = 100
"""Free forms of a model that get places, the largest first: each takes some 0.05 s."""
_MOST_NUMBERS = 1_000_000
"""Numbers of all faces together: some 20 MB on the way to who asked."""


def free_forms_of(
    document: StepDocument,
    faces: Sequence[Any],
    taken: frozenset[int],
    ball_radius: float,
    reach: Reach | None,
    sizes: Float,
    doing: Callable[[str], None],
) -> list[StepFreeForm]:
    """Return the free-form faces of a part, each with places to touch or with a reason against it.

    Parameters
    ----------
    faces
        All with a surface, in order.
    taken
        Numbers, from 1, of those that are planes, cylinders and so on.
    ball_radius
        mm.
    reach
        Asked whether places can be touched; None where nobody asks.
    sizes
        About how large each face is, mm, in their order: the largest get places first.
    """
    others = [number for number in range(1, len(faces) + 1) if number not in taken]
    others.sort(key=lambda number: sizes[number - 1], reverse=True)
    numbers = 0
    found = []
    for place, number in enumerate(others, start=1):
        if place > _MOST or numbers > _MOST_NUMBERS:
            against = "the model has many free forms, and places are looked for on larger ones"
            name = document.about(faces[number - 1]).name
            found.append(StepFreeForm(number=number, name=name, against=against))
            continue
        doing(f"places on free form {place} of {len(others)}")
        made = model_face(number, faces[number - 1], document, is_exact=True)
        one = _with_places(made, ball_radius, reach)
        numbers += 0 if one.face is None else len(one.face.poles)
        found.append(one)
    return sorted(found, key=lambda one: one.number)


def _refused(face: ModelFace, why: str) -> StepFreeForm:
    return StepFreeForm(number=face.number, name=face.name, against=why)


def _with_places(face: ModelFace, ball_radius: float, reach: Reach | None) -> StepFreeForm:
    if face.spline is None:
        return _refused(face, "the library gives no exact surface of it")
    try:
        held = nominal_face(face)
    except InputError as error:
        return _refused(face, error.what.rstrip("."))
    tried = WANTED if reach is None else _TRIED * WANTED
    points, normals = spread_places(searched(held), tried, ball_radius + EDGE_MM, ball_radius)
    ways, turns = np.empty(0), np.empty((0, 3))
    if len(points) < LEAST:
        ball = f"a ball of {2.0 * ball_radius:g} mm"
        return _refused(face, f"{ball} has room for {len(points)} points, {LEAST} are needed")
    if reach is not None:
        asked = reach.of(points, normals, [face.number - 1])
        can = np.flatnonzero(asked.stage == 0)
        if len(can) < LEAST:
            return _refused(face, reach.why_not(asked))
        can = can[spread_rows(points[can], WANTED)]
        points, normals, ways = points[can], normals[can], asked.ways_mm[can]
        held_part = asked.turns_part_from_probe[can]
        if np.isfinite(held_part).all():
            turns = Rotation.from_matrix(held_part).as_rotvec()
    return StepFreeForm(
        number=face.number, name=face.name, face=held, targets=_triples(points),
        normals=_triples(normals), held=_triples(turns), ways=tuple(ways.tolist()),
    )  # fmt: skip


def _triples(rows: np.ndarray[Any, np.dtype[np.float64]]) -> tuple[Triple, ...]:
    return tuple((x, y, z) for x, y, z in rows.tolist())
