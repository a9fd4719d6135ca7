"""Reading of a STEP file in a separate process.

The geometry kernel is C++ that reads untrusted files: if it crashes or hangs, the caller continues,
and knows what was being read.

A free form is no element: its requirement is the profile of a surface (decision 60). Places lie
inside its edges, as far apart as possible, within reach of the probe and in sight of the cameras.
"""

from __future__ import annotations

import gc
import os
import re
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ocmm_cad.pmi import Pmi
from ocmm_cad.reach import Reach, Setting, make_obstacle
from ocmm_cad.step import brep
from ocmm_cad.step._joined import EDGE_MM, NOT_INSIDE, Inside, bore_axes, rooms_of, surfaces_of
from ocmm_cad.step._placed import LEAST, WANTED, reached_places, triples
from ocmm_cad.step._profiled import StepAnswer, StepFreeForm, StepSurface
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.failure import contained
from ocmm_core.geometry import Float
from ocmm_core.host import HOST
from ocmm_core.part_model import (
    ModelFace,
    NominalFace,
    model_to_bytes,
    nominal_face,
    searched,
    spread_places,
)

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
    document: brep.StepDocument,
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
        sizes = {number: brep.box_size(faces[number - 1]) for number in others}
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
        made = brep.model_face(number, faces[number - 1], document, is_exact=True)
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
        found.append(_form_with_targets(room, reach))
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


def _form_with_targets(room: FreeFormRoom, reach: Reach | None) -> StepFreeForm:
    number, name = room.number, room.name
    if room.against:
        return StepFreeForm(number=number, name=name, against=room.against)
    points, normals = room.points[:WANTED], room.normals[:WANTED]
    ways, turns = np.empty(0), np.empty((0, 3))
    if reach is not None:
        asked = reach.evaluate(room.points, room.normals, [number - 1])
        can, turns = reached_places(room.points, asked)
        if not len(can):
            return StepFreeForm(number=number, name=name, against=reach.why_not(asked))
        points, normals, ways = room.points[can], room.normals[can], asked.ways_mm[can]
    return StepFreeForm(
        number=number, name=name, face=room.face, targets=triples(points),
        normals=triples(normals), held=triples(turns), ways=tuple(ways.tolist()),
    )  # fmt: skip


_MOST_BYTES = 1_500_000_000
_IN_PARTS = "tolerances in part files of an assembly are not read; import the part file itself"
_MOST_ASKED = 1000
"""Faces; the search of attitudes for as many takes up to half a minute."""
_TOLD_S = 0.03
_NAMED = 10
_LARGE_COUNT = re.compile(r"of \d{4,}$")
_NO_DIGITS = str.maketrans("", "", "0123456789")


@dataclass(frozen=True, slots=True)
class Wanted:
    """Requested contents."""

    ball_mm: float = 0.0
    """Diameter of the ball; zero for no features."""
    setting: Setting | None = None
    """Probe, cameras and placement; None for the ball alone."""
    source_sha256: str = ""
    """Hash of the file, for the part; empty for no part."""
    source_name: str = ""
    """Name of the file without its folder: the reader may get a copy."""
    parts: tuple[str, ...] = ()
    """Part files that it names, relative to its folder."""
    tolerances_in_parts: bool = False
    """A part file may contain tolerances, which are not read."""
    papers: tuple[str, ...] = ()
    """Documents without geometry named by the file."""
    limit_s: float = 120.0


def read_step(path: str, wanted: Wanted, to: Connection) -> None:
    """Send progress, then surfaces or a fault, then the part if requested (`StepAnswer`)."""
    _be_silent()
    # The process ends with its answer: garbage collection would be wasted.
    gc.disable()
    HOST.limit_memory(_MOST_BYTES)

    def tell(answer: StepAnswer) -> None:
        to.send_bytes(msgspec.json.encode(answer, enc_hook=brep.as_numbers))

    doing, stage, told_s = "the start of the library", "", 0.0

    def now(what: str) -> None:
        nonlocal doing, stage, told_s
        doing = what
        words, at = what.translate(_NO_DIGITS), time.monotonic()
        # Report only some of thousands of faces.
        if words != stage or at - told_s >= _TOLD_S or not _LARGE_COUNT.search(what):
            stage, told_s = words, at
            tell(StepAnswer(doing=what))

    part = b""
    try:
        answer, part = _read(path, wanted, now)
    except ImportError:
        answer = StepAnswer(fault="MISSING")
    except brep.UnusableModelError as error:
        answer = StepAnswer(fault=error.what, remedy=error.remedy)
    except InputError as error:
        answer = StepAnswer(fault=error.what.rstrip("."), remedy=error.remedy)
    except ValueError as error:
        answer = StepAnswer(fault=str(error))
    except MemoryError:
        answer = StepAnswer(
            fault=f"reading it takes more than {_MOST_BYTES / 1e9:.1f} GB of memory (at {doing})",
            remedy=brep.LESS,
        )
    except Exception as error:
        told = contained(error, f"Reading the STEP file (at {doing})")
        answer = StepAnswer(error=(told.code, told.what, told.remedy))
    try:
        tell(answer)
        if answer.part_bytes:
            to.send_bytes(part)
    finally:
        to.close()


def _read(path: str, wanted: Wanted, doing: Callable[[str], None]) -> tuple[StepAnswer, bytes]:
    document = brep.read_document(path, doing, wanted.parts)
    source = (wanted.source_name, wanted.source_sha256) if wanted.source_sha256 else None
    if not wanted.ball_mm:
        made = b"" if source is None else model_to_bytes(brep.part_of(document, source, doing))
        return StepAnswer(part_bytes=len(made)), made
    with_surface, others = brep.faces_with_surface(document.shape)
    if brep.ENDLESS in others:
        document = document.of_faces(with_surface)
    # Another process meshes meanwhile: for targets, and the displayed part.
    aside = brep.MeshAside(document, with_surface, source, wanted.limit_s)
    try:
        found = brep.faces_of(with_surface, doing, document.steps)
        faces = found.faces
        pmi, entities, words = brep.tolerances_of(
            read_bytes(Path(path)).decode("utf-8", "replace"), document.reader.Reader(),
            with_surface, faces, doing,
        )  # fmt: skip
        if wanted.tolerances_in_parts:
            pmi, entities, words = Pmi(fault=_IN_PARTS), {}, {}
        wanted, remark = _bounded(wanted, len(faces))
        surfaces, free_forms = _with_targets(document, found, with_surface, wanted, aside, doing)
        part = aside.part(doing)
    finally:
        aside.end()
    answer = StepAnswer(
        remark=" ".join(
            filter(None, (remark, _empty_words(document.empty), _paper_words(wanted.papers)))
        ),
        surfaces=surfaces,
        free_forms=free_forms,
        others=dict(others + found.others),
        faults=dict(Counter(found.faults.values())),
        face_count=len(with_surface) + others.total(),
        pmi=pmi,
        face_entities=entities,
        face_words=words,
        part_bytes=len(part),
        face_names={
            number: name
            for number, face in enumerate(with_surface, start=1)
            if (name := document.about(face).name)
        },
    )
    return answer, part


def _empty_words(names: Sequence[str]) -> str:
    return f"Components without geometry in the file: {_listed(names)}." if names else ""


def _paper_words(names: Sequence[str]) -> str:
    return (
        f"Documents that the file names and that are not read: {_listed(names)}." if names else ""
    )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:_NAMED]) + (" ..." if len(names) > _NAMED else "")


def _bounded(wanted: Wanted, faces: int) -> tuple[Wanted, str]:
    """Return the checks that are feasible for so many faces, and a remark on omitted ones."""
    if wanted.setting is None or faces <= _MOST_ASKED:
        return wanted, ""
    remark = (
        f"The model has more than {_MOST_ASKED} faces: whether stylus and body reach the targets "
        "and cameras see them is asked for the surfaces that are chosen."
    )
    return replace(wanted, setting=None), remark


def _with_targets(
    document: brep.StepDocument,
    found: brep.FoundFaces,
    with_surface: Sequence[Any],
    wanted: Wanted,
    aside: brep.MeshAside,
    doing: Callable[[str], None],
) -> tuple[tuple[StepSurface, ...], tuple[StepFreeForm, ...]]:
    # Steps without the mesh come first: the other process makes it meanwhile.
    radius = 0.5 * wanted.ball_mm
    rooms = rooms_of(found.faces, radius, doing)
    known = frozenset(one.number for one in found.faces) | found.faults.keys()
    others = free_form_rooms(document, with_surface, known, radius, doing)
    doing("the mesh to find targets by")
    mesh = aside.mesh()
    reach = None
    # The extent of a damaged face is unknown: it must not obstruct all others.
    sound = ~np.isin(mesh.owners, np.array([*found.faults], dtype=np.int64) - 1)
    if sound.any():
        part = make_obstacle(
            mesh.triangles[sound], mesh.owners[sound], len(with_surface), mesh.deflection_mm
        )
        reach = Reach(part, radius, wanted.setting, bore_axes([one.face for one in found.faces]))
    check = brep.FaceCheck(with_surface)
    surfaces = surfaces_of(rooms, reach, doing, check.inside)
    return tuple(surfaces), tuple(free_forms_of(others, reach, doing, check.inside))


def _be_silent() -> None:
    nothing = os.open(os.devnull, os.O_WRONLY)
    for descriptor in (1, 2):
        os.dup2(nothing, descriptor)
    os.close(nothing)
