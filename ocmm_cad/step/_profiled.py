"""Free-form faces of a model for a plan, and their names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_cad.step._answer import StepFreeForm
from ocmm_cad.step._names import feature_names
from ocmm_cad.step.brep import ENDLESS, Triple
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.part_model import NominalFace

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
        places = np.array(self.targets)
        sizes = np.sort(np.ptp(places, axis=0))[::-1]
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
