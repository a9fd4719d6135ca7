"""Free-form faces of a model as a plan can take them, and what they are called."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.step._answer import StepFreeForm
from ocmm_core.inspection.step._names import feature_names
from ocmm_core.inspection.step.brep import ENDLESS, Triple
from ocmm_core.part_model import NominalFace

NOT_EXACT = ("construction geometry", "tessellated", ENDLESS)
"""Of faces without a feature those that are no free forms either."""
_LONGEST = 50
"""Of a name: the number of a place comes behind it."""


@dataclass(frozen=True, slots=True)
class FreeForm:
    """A free-form face that can be measured: single points, and their profile against the model."""

    name: str
    """Of the profile; no surface of the model has the same."""
    face: NominalFace
    """The face, with its outline."""
    targets: tuple[Triple, ...]
    normals: tuple[Triple, ...]
    """`targets`, `normals`: mm and unit, out of the material: places on it, each as far as can be
    from those before."""
    held: tuple[Triple, ...] = ()
    ways: tuple[float, ...] = ()
    """`held`, `ways`: As in `Reached`."""

    @property
    def feature(self) -> NominalFeature:
        """Return the face as lists show it: its middle place, and how far its places reach."""
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
    """Return the free forms that can be measured, and reasons against the others.

    Parameters
    ----------
    names
        That are taken.
    """
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
