"""What the reading process tells the program that asked, as JSON."""

from __future__ import annotations

import msgspec

from ocmm_core.inspection.pmi import Pmi
from ocmm_core.inspection.step.brep import StepFace, Triple
from ocmm_core.part_model import NominalFace

OPEN = "its edges do not go round"
"""Stands against a face of which nobody knows what is inside."""


class StepSurface(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A surface with the places on it where a ball can touch.

    Attributes
    ----------
    face
        Its shape, place and size.
    targets
        mm, on the trimmed faces, each as far as can be from those before it.
    held
        How the probe is held at each target: rotation vector, rad, frame of the model from that of
        the probe. Empty where nobody asked.
    ways
        mm: straight way along the normal that is free at each target.
    against
        Why it is no feature to begin with, as a part of a sentence; empty where it is one.
    numbers
        Of the faces that it is made of, see `ModelFace`.
    """

    face: StepFace
    targets: tuple[Triple, ...] = ()
    held: tuple[Triple, ...] = ()
    ways: tuple[float, ...] = ()
    against: str = ""
    numbers: tuple[int, ...] = ()


class StepFreeForm(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A free-form face with the places on it where a ball can touch.

    Attributes
    ----------
    number
        See `ModelFace`.
    name
        What the file calls it.
    face
        The face itself; None where something stands against it.
    targets, normals, held, ways
        As those of `StepSurface`, and the normals out of the material.
    against
        Why it cannot be measured, as a part of a sentence; empty where it can.
    """

    number: int
    name: str = ""
    face: NominalFace | None = None
    targets: tuple[Triple, ...] = ()
    normals: tuple[Triple, ...] = ()
    held: tuple[Triple, ...] = ()
    ways: tuple[float, ...] = ()
    against: str = ""


class StepAnswer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the reading sends: nothing that a damaged process sends becomes more than that.

    Attributes
    ----------
    doing
        What is being read now; more answers follow. It says where a reader ended that ended badly.
    surfaces
        Those of the model; none where there is a fault.
    free_forms
        Faces of other kinds.
    others
        How many faces have another kind of surface, by its word.
    pmi
        What the file says of tolerances.
    face_entities
        Number in the file of faces, by their own number.
    face_names
        What the file calls faces, by number; faces without a name are not in it.
    face_words
        Kind of surface of all faces of the file, by their number there.
    fault
        What is wrong with the file, as a part of a sentence; "MISSING" where the extra is.
    remedy
        What to do about a fault, where that is not to export the model again.
    remark
        What was not asked about targets, as a sentence; empty where all was.
    part_bytes
        Length of the part, which is sent next, in the form of `ocmm_core.part_model`; 0 for none.
    error
        Code, what and remedy of what is wrong with the program.
    """

    doing: str = ""
    surfaces: tuple[StepSurface, ...] = ()
    free_forms: tuple[StepFreeForm, ...] = ()
    others: dict[str, int] = msgspec.field(default_factory=dict)
    pmi: Pmi | None = None
    face_entities: dict[int, int] = msgspec.field(default_factory=dict)
    face_names: dict[int, str] = msgspec.field(default_factory=dict)
    face_words: dict[int, str] = msgspec.field(default_factory=dict)
    fault: str = ""
    remedy: str = ""
    remark: str = ""
    part_bytes: int = 0
    error: tuple[str, str, str] | None = None
