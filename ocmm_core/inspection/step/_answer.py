"""What the reading process tells the program that asked, as JSON."""

from __future__ import annotations

import msgspec

from ocmm_core.inspection.pmi import Pmi
from ocmm_core.inspection.step.brep import StepFace, Triple
from ocmm_core.part_model import NominalFace

OPEN = "its edges do not go round"
"""Stands against a face of which nobody knows what is inside."""


class StepSurface(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A surface with the places on it where a ball can touch."""

    face: StepFace
    """Its shape, place and size."""
    targets: tuple[Triple, ...] = ()
    """mm, on the trimmed faces, each as far as can be from those before it."""
    held: tuple[Triple, ...] = ()
    """How the probe is held at each target: rotation vector, rad, frame of the model from that of
    the probe. Empty where nobody asked."""
    ways: tuple[float, ...] = ()
    """mm: straight way along the normal that is free at each target."""
    against: str = ""
    """Why it is no feature to begin with, as a part of a sentence; empty where it is one."""
    numbers: tuple[int, ...] = ()
    """Of the faces that it is made of, see `ModelFace`."""


class StepFreeForm(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A free-form face with the places on it where a ball can touch."""

    number: int
    name: str = ""
    """What the file calls it."""
    face: NominalFace | None = None
    """The face itself; None where something stands against it."""
    targets: tuple[Triple, ...] = ()
    normals: tuple[Triple, ...] = ()
    held: tuple[Triple, ...] = ()
    ways: tuple[float, ...] = ()
    """`targets`, `normals`, `held`, `ways`: As those of `StepSurface`, and the normals out of the
    material."""
    against: str = ""
    """Why it cannot be measured, as a part of a sentence; empty where it can."""


class StepAnswer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the reading sends: nothing that a damaged process sends becomes more than that."""

    doing: str = ""
    """What is being read now; more answers follow. It says where a reader ended that ended badly.
    """
    surfaces: tuple[StepSurface, ...] = ()
    """Those of the model; none where there is a fault."""
    free_forms: tuple[StepFreeForm, ...] = ()
    """Faces of other kinds."""
    others: dict[str, int] = msgspec.field(default_factory=dict)
    """How many faces have another kind of surface, by its word."""
    faults: dict[str, int] = msgspec.field(default_factory=dict)
    """Reasons why faces cannot be used, and how many have each."""
    face_count: int = 0
    """All faces of the file, with those that have no surface or belong to no solid."""
    pmi: Pmi | None = None
    """What the file says of tolerances."""
    face_entities: dict[int, int] = msgspec.field(default_factory=dict)
    """Number in the file of faces, by their own number."""
    face_names: dict[int, str] = msgspec.field(default_factory=dict)
    """What the file calls faces, by number; faces without a name are not in it."""
    face_words: dict[int, str] = msgspec.field(default_factory=dict)
    """Kind of surface of all faces of the file, by their number there."""
    fault: str = ""
    """What is wrong with the file, as a part of a sentence; "MISSING" where the extra is."""
    remedy: str = ""
    """What to do about a fault, where that is not to export the model again."""
    remark: str = ""
    """What was not asked about targets, as a sentence; empty where all was."""
    part_bytes: int = 0
    """Length of the part, which is sent next, in the form of `ocmm_core.part_model`; 0 for none."""
    error: tuple[str, str, str] | None = None
    """Code, what and remedy of what is wrong with the program."""
