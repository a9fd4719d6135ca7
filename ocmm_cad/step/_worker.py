"""Reading of a STEP file in a separate process.

The geometry kernel is C++ that reads untrusted files: if it crashes or hangs, the caller continues,
and knows what was being read.
"""

from __future__ import annotations

import gc
import os
import re
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ocmm_cad.pmi import Pmi
from ocmm_cad.reach import Reach, Setting, make_obstacle
from ocmm_cad.step._free_forms import free_form_rooms, free_forms_of
from ocmm_cad.step._joined import bore_axes, rooms_of, surfaces_of
from ocmm_cad.step._profiled import StepAnswer, StepFreeForm, StepSurface
from ocmm_cad.step.brep import (
    ENDLESS,
    LESS,
    FaceCheck,
    FoundFaces,
    MeshAside,
    StepDocument,
    UnusableModelError,
    as_numbers,
    faces_of,
    faces_with_surface,
    part_of,
    read_document,
    tolerances_of,
)
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.failure import contained
from ocmm_core.host import HOST
from ocmm_core.part_model import model_to_bytes

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
        to.send_bytes(msgspec.json.encode(answer, enc_hook=as_numbers))

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
    except UnusableModelError as error:
        answer = StepAnswer(fault=error.what, remedy=error.remedy)
    except InputError as error:
        answer = StepAnswer(fault=error.what.rstrip("."), remedy=error.remedy)
    except ValueError as error:
        answer = StepAnswer(fault=str(error))
    except MemoryError:
        answer = StepAnswer(
            fault=f"reading it takes more than {_MOST_BYTES / 1e9:.1f} GB of memory (at {doing})",
            remedy=LESS,
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
    document = read_document(path, doing, wanted.parts)
    source = (wanted.source_name, wanted.source_sha256) if wanted.source_sha256 else None
    if not wanted.ball_mm:
        made = b"" if source is None else model_to_bytes(part_of(document, source, doing))
        return StepAnswer(part_bytes=len(made)), made
    with_surface, others = faces_with_surface(document.shape)
    if ENDLESS in others:
        document = document.of_faces(with_surface)
    # Another process meshes meanwhile: for targets, and the displayed part.
    aside = MeshAside(document, with_surface, source, wanted.limit_s)
    try:
        found = faces_of(with_surface, doing, document.steps)
        faces = found.faces
        pmi, entities, words = tolerances_of(
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
    document: StepDocument,
    found: FoundFaces,
    with_surface: Sequence[Any],
    wanted: Wanted,
    aside: MeshAside,
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
    check = FaceCheck(with_surface)
    surfaces = surfaces_of(rooms, reach, doing, check.inside)
    return tuple(surfaces), tuple(free_forms_of(others, reach, doing, check.inside))


def _be_silent() -> None:
    nothing = os.open(os.devnull, os.O_WRONLY)
    for descriptor in (1, 2):
        os.dup2(nothing, descriptor)
    os.close(nothing)
