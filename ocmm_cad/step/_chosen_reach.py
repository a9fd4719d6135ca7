"""Reach and sight of selected surfaces, for models with too many faces to check all."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from ocmm_cad.reach import Reach, Setting, make_obstacle
from ocmm_cad.step._asking import given_up_error
from ocmm_cad.step._choice import Offer
from ocmm_cad.step._joined import bore_axes
from ocmm_cad.step._model import LeftOut, StepModel
from ocmm_cad.step._placed import bore_axis, reached_places, taken_of
from ocmm_cad.step._profiled import FreeForm
from ocmm_cad.step.brep import StepFace, Triple, normals_of
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.part_model import PartModel

LIMIT_S = 60.0
"""s of CPU time: a target takes some milliseconds, and plans do not have thousands."""
_COARSEST_MM = 0.5
"""mm: gaps grow with the deflection of the mesh; a coarser one would refuse good targets."""
_NAMED = 10


@dataclass(frozen=True, slots=True)
class ChosenReach:
    """Results of the selected surfaces."""

    taken: tuple[Offer, ...]
    """Kept surfaces, with the targets that can be touched and are seen."""
    refused: tuple[LeftOut, ...] = ()
    """Surfaces with too few targets, and why."""
    unasked: tuple[str, ...] = ()
    """Kept surfaces that were not checked."""
    why: str = ""
    """Why not, as a part of a sentence."""

    def sentences(self) -> tuple[str, ...]:
        """Return remarks for the user, a sentence each."""
        said = []
        if self.refused:
            names = _listed([one.feature.name for one in self.refused])
            why = Counter(one.why for one in self.refused).most_common(1)[0][0]
            said.append(f"Left out, too few targets within reach: {names}. Most often, {why}.")
        if self.unasked:
            names = _listed(self.unasked)
            said.append(
                f"Not known whether stylus and body reach and cameras see ({self.why}): {names}."
            )
        return tuple(said)


def ask_for_chosen(
    model: StepModel,
    taken: Sequence[Offer],
    given_up: Callable[[], bool] = lambda: False,
    progress: Callable[[str], None] = lambda _: None,
    limit_s: float = LIMIT_S,
) -> ChosenReach:
    """Check selected surfaces that were not checked when their (large) model was read.

    ``limit_s``: CPU time of this thread, after which the rest is not checked. InputError if
    cancelled, or none of them can be measured.
    """
    with_targets = [one for one in taken if one.feature.targets]
    if model.unasked is None or not with_targets:
        return ChosenReach(tuple(taken))
    names = tuple(one.feature.name for one in with_targets)
    if model.part is None:
        return ChosenReach(tuple(taken), (), names, "the part was not read")
    if model.part.deflection_mm > _COARSEST_MM:
        return ChosenReach(tuple(taken), (), names, "the mesh of the part is too coarse")
    progress("the mesh in the way of the probe")
    reach = _reach_on(model.part, model.unasked, with_targets)
    begun = time.thread_time()
    stays: list[Offer] = []
    refused: list[LeftOut] = []
    unasked: list[str] = []
    for number, offer in enumerate(taken, start=1):
        if given_up():
            raise given_up_error(model.part.source_name)
        asked: Offer | LeftOut = offer
        if time.thread_time() - begun > limit_s:
            unasked += [offer.feature.name] if offer.feature.targets else []
        elif offer.feature.targets:
            progress(f"reach of surface {number} of {len(taken)}")
            asked = _asked(offer, reach)
        if isinstance(asked, LeftOut):
            refused.append(asked)
        else:
            stays.append(asked)
    if not stays:
        raise _none_of(refused)
    return ChosenReach(
        tuple(stays), tuple(refused), tuple(unasked), "they are too many to ask for all"
    )


def _reach_on(part: PartModel, setting: Setting, offers: Sequence[Offer]) -> Reach:
    mesh = make_obstacle(
        part.vertices[part.triangles], part.triangle_faces.astype(np.int64), len(part.faces),
        part.deflection_mm,
    )  # fmt: skip
    axes = bore_axes([_face_of(one.feature) for one in offers])
    return Reach(mesh, setting.ball_radius, setting, axes)


def _asked(offer: Offer, reach: Reach) -> Offer | LeftOut:
    feature, own = offer.feature, [number - 1 for number in offer.faces]
    points = np.array(feature.targets)
    if offer.free_form is not None:
        return _free_form_asked(offer, offer.free_form, reach)
    face = _face_of(feature)
    reached = reach.of(points, normals_of(face, points), own, bore_axis(face))
    found = taken_of(
        face, points, reached, len(points), feature.points, lambda: reach.why_not(reached)
    )
    if found.against:
        bare = msgspec.structs.replace(feature, targets=())
        return LeftOut(bare, found.against, offer.faces)
    kept = msgspec.structs.replace(feature, targets=_triples(found.points))
    return replace(offer, feature=kept)


def _free_form_asked(offer: Offer, form: FreeForm, reach: Reach) -> Offer | LeftOut:
    points, normals = np.array(form.targets), np.array(form.normals)
    reached = reach.of(points, normals, [number - 1 for number in offer.faces])
    can, held = reached_places(points, reached)
    if not len(can):
        return LeftOut(offer.feature, reach.why_not(reached), offer.faces)
    kept = replace(
        form, targets=_triples(points[can]), normals=_triples(normals[can]), held=_triples(held),
        ways=tuple(reached.ways_mm[can].tolist()),
    )  # fmt: skip
    return replace(offer, feature=kept.feature, free_form=kept)


def _face_of(feature: NominalFeature) -> StepFace:
    return StepFace(
        shape=feature.shape.value, point=_triple(feature.point),
        direction=_triple(feature.direction), radius=0.5 * feature.diameter,
        half_angle=float(np.radians(0.5 * feature.angle_deg)), inner=feature.side == "inner",
    )  # fmt: skip


def _triple(values: Sequence[float]) -> Triple:
    x, y, z = values
    return (float(x), float(y), float(z))


def _triples(rows: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> tuple[Triple, ...]:
    return tuple(_triple(row) for row in rows.tolist())


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" (+{more})" if more > 0 else "")


def _none_of(refused: Sequence[LeftOut]) -> InputError:
    why, often = Counter(one.why for one in refused).most_common(1)[0]
    return InputError(
        "plan.choice",
        f"None of the {len(refused)} chosen surfaces can be measured; most often ({often} of "
        f"them), {why}.",
        "Name another axis that points up, or choose other surfaces.",
    )
