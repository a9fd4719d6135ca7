"""Results of the reading process: its JSON message, names of features, free-form faces.

Names come from the model if it has some, else from shape and place.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from ocmm_cad.pmi import Pmi
from ocmm_cad.step.brep import ENDLESS, StepFace, Triple
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.names import LONGEST_NAME, usable_name
from ocmm_core.part_model import NominalFace

OPEN = "its edges do not go round"
"""Reason against a face whose inside is undefined."""


class StepSurface(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A surface with places for a ball."""

    face: StepFace
    targets: tuple[Triple, ...] = ()
    """mm, on the trimmed faces, each as far as possible from the earlier ones."""
    held: tuple[Triple, ...] = ()
    """Attitude of the probe at each target: rotation vector, rad, model from probe; or empty."""
    ways: tuple[float, ...] = ()
    """mm: free straight way along the normal at each target."""
    against: str = ""
    """Why it is not selected by default, as a part of a sentence; empty if it is."""
    numbers: tuple[int, ...] = ()
    """Its faces, see `ModelFace`."""


class StepFreeForm(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A free-form face with places for a ball."""

    number: int
    name: str = ""
    face: NominalFace | None = None
    """The face itself; None if refused."""
    targets: tuple[Triple, ...] = ()
    normals: tuple[Triple, ...] = ()
    held: tuple[Triple, ...] = ()
    ways: tuple[float, ...] = ()
    """These four as in `StepSurface`, with normals out of the material."""
    against: str = ""
    """Why it cannot be measured, as a part of a sentence; empty if it can."""


class StepAnswer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Result of the reading, limited to this form even if the process is corrupted."""

    doing: str = ""
    """Current step, if more answers follow; locates a crash of the reader."""
    surfaces: tuple[StepSurface, ...] = ()
    """Empty if there is a fault."""
    free_forms: tuple[StepFreeForm, ...] = ()
    others: dict[str, int] = msgspec.field(default_factory=dict)
    """Number of faces with another kind of surface, by its word."""
    faults: dict[str, int] = msgspec.field(default_factory=dict)
    """Reasons against faces, and number of faces each."""
    face_count: int = 0
    """All faces of the file, also without surface or outside of solids."""
    pmi: Pmi | None = None
    face_entities: dict[int, int] = msgspec.field(default_factory=dict)
    """Number in the file of faces, by their own number."""
    face_names: dict[int, str] = msgspec.field(default_factory=dict)
    """Names of faces in the file, by number; unnamed ones are missing."""
    face_words: dict[int, str] = msgspec.field(default_factory=dict)
    """Kind of surface of all faces of the file, by their number there."""
    fault: str = ""
    """Fault of the file, as a part of a sentence; "MISSING" if the extra is."""
    remedy: str = ""
    """Remedy for a fault, if other than exporting the model again."""
    remark: str = ""
    """Omitted checks of targets, as a sentence; empty if none."""
    part_bytes: int = 0
    """Length of the part, which is sent next, in the form of `ocmm_core.part_model`; 0 for none."""
    error: tuple[str, str, str] | None = None
    """Code, what and remedy of an internal error."""


_ROOM_FOR_NUMBER = 5
_ALONG = 1.0 - 1e-9
_WORDS = {Shape.PLANE: "PLANE", Shape.CONE: "CONE", Shape.SPHERE: "SPHERE", Shape.TORUS: "TORUS"}


def feature_names(features: Sequence[NominalFeature], said: Sequence[str]) -> list[str]:
    """Return a unique valid name for each feature, from its name in the model if any."""
    own = [usable_name(word, LONGEST_NAME - _ROOM_FOR_NUMBER) for word in said]
    short = [name or _what(one, fully=False) for name, one in zip(own, features, strict=True)]
    often = Counter(short)
    wanted = [
        name if own[place] or often[name] == 1 else _what(features[place], fully=True)
        for place, name in enumerate(short)
    ]
    taken: set[str] = set()
    names = []
    for name in wanted:
        number, free = 1, name
        while free in taken:
            number += 1
            free = f"{name[: LONGEST_NAME - _ROOM_FOR_NUMBER]} {number}"
        taken.add(free)
        names.append(free)
    return names


def _what(feature: NominalFeature, *, fully: bool) -> str:
    """Return shape and place, such as ``BORE 12.5 X40 Y20``; `fully`: all coordinates."""
    shape = feature.shape
    size = feature.angle_deg if shape is Shape.CONE else feature.diameter
    word = _WORDS.get(shape) or ("BORE" if feature.side == "inner" else "SHAFT")
    told = [word] if shape is Shape.PLANE else [word, _number(size, 2)]
    along = np.abs(np.array(feature.direction))
    axis = int(np.argmax(along)) if along.max() >= _ALONG else -1
    # A plane is located along its normal; round shapes where their axis passes.
    kept = [0, 1, 2]
    if not fully and axis >= 0 and shape is not Shape.SPHERE:
        kept = [axis] if shape is Shape.PLANE else [place for place in kept if place != axis]
    told += [f"{'XYZ'[place]}{_number(feature.point[place], 1)}" for place in kept]
    return " ".join(told)


def _number(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".") or "0"
    return "0" if text == "-0" else text


NOT_EXACT = ("construction geometry", "tessellated", ENDLESS)
"""Kinds of faces that are neither features nor free forms."""
_LONGEST = 50
"""Of a name, before the number of a place."""


@dataclass(frozen=True, slots=True)
class FreeForm:
    """A free-form face that can be measured: single points, and their profile against the model."""

    name: str
    """Of the profile; unique among the surfaces of the model."""
    face: NominalFace
    targets: tuple[Triple, ...]
    normals: tuple[Triple, ...]
    """`targets`, `normals`: mm; unit, out: places, each as far as possible from earlier ones."""
    held: tuple[Triple, ...] = ()
    ways: tuple[float, ...] = ()
    """`held`, `ways`: As in `Reached`."""

    @property
    def feature(self) -> NominalFeature:
        """Return the face for lists: its middle place, and the extent of its places."""
        sizes = np.sort(np.ptp(np.array(self.targets), axis=0))[::-1]
        return NominalFeature(
            name=self.name, shape=Shape.POINT, points=1, point=self.targets[0],
            direction=self.normals[0], length=float(sizes[0]), width=float(sizes[1]),
            targets=self.targets,
        )  # fmt: skip


def free_forms_of(
    said: Iterable[StepFreeForm], names: Sequence[str]
) -> tuple[tuple[FreeForm, ...], Counter[str]]:
    """Return measurable free forms, and reasons against others; `names` are in use."""
    good = [one for one in said if not one.against and one.face is not None]
    bad = Counter(f"it is a free form, and {one.against}" for one in said if one.against)
    nobody = NominalFeature(name="", shape=Shape.POINT, points=1, point=(0.0, 0.0, 0.0))
    words = [(one.name or f"FREE FORM {one.number}")[:_LONGEST] for one in good]
    own = feature_names([nobody] * (len(names) + len(good)), [*names, *words])[len(names) :]
    return tuple(
        FreeForm(name, one.face, one.targets, one.normals, one.held, one.ways)
        for name, one in zip(own, good, strict=True)
        if one.face is not None
    ), bad
