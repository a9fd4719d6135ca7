"""JSON message of the reading process."""

from __future__ import annotations

import msgspec

from ocmm_cad.pmi import Pmi
from ocmm_cad.step.brep import StepFace, Triple
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
