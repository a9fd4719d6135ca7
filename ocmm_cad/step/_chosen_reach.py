"""Surfaces offered by a model, their selection, and their reach and sight.

For command line, window and scripts. All faces of the model are accounted for, each imported or
omitted with its reason. Models with too many faces to check all are checked when selected.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

import msgspec
import numpy as np

from ocmm_cad.reach import Reach, Setting, make_obstacle
from ocmm_cad.step._asking import given_up_error
from ocmm_cad.step._joined import bore_axes
from ocmm_cad.step._model import LeftOut, StepModel
from ocmm_cad.step._placed import bore_axis, reached_places, taken_of, triples
from ocmm_cad.step._profiled import NOT_EXACT, FreeForm
from ocmm_cad.step.brep import RECOGNISED_MM, StepFace, Triple, normals_of
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.part_model import PartModel

FREE_FORM = "free form"
"""Kind of faces measured as a profile against the model."""


@dataclass(frozen=True, slots=True)
class Offer:
    """A surface of a model that can become a feature."""

    feature: NominalFeature
    """Without targets if there is a reason against it; a free form: one point per target."""
    faces: tuple[int, ...]
    """Numbers of its faces, see `ModelFace`."""
    against: str = ""
    """Why it is not selected by default, as a part of a sentence; empty if it is."""
    free_form: FreeForm | None = None
    """The face, if measured as a profile."""

    @property
    def kind(self) -> str:
        """Return the word of its shape, or `FREE_FORM`."""
        return self.feature.shape.value if self.free_form is None else FREE_FORM

    @property
    def size_mm(self) -> float:
        """Return the diameter, or the longer side of a plane."""
        return self.feature.diameter or max(self.feature.length, self.feature.width)


@dataclass(frozen=True, slots=True)
class Choice:
    """Filters of surfaces; empty ones select everything."""

    only: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    """`only`, `without`: Names, with wildcards ``*`` and ``?``, or numbers of faces. ``only`` also
    selects surfaces that are not selected by default."""
    kinds: tuple[str, ...] = ()
    """Words of shapes, such as Cylinder; case-insensitive."""
    least_mm: float = 0.0
    most_mm: float = float("inf")
    """`least_mm`, `most_mm`: Of the diameter, or the longer side of a plane."""
    everything: bool = False
    """Also surfaces not selected by default, except free forms."""
    profiles: bool = False
    """Free forms also: the width of their zone is known."""


def offers_of(model: StepModel) -> tuple[Offer, ...]:
    """Return all offers of a model, default ones first."""
    good = [Offer(one, how.faces) for one, how in zip(model.features, model.reached, strict=True)]
    free = [Offer(one.feature, (one.face.number,), free_form=one) for one in model.free_forms]
    return (*good, *free, *(Offer(one.feature, one.faces, one.why) for one in model.left_out))


def chosen(offers: Sequence[Offer], choice: Choice) -> tuple[Offer, ...]:
    """Return the selected offers; InputError if a word matches nothing, or nothing is left."""
    for word in (*choice.only, *choice.without):
        if not any(_named(offer, (word,)) for offer in offers):
            raise _error(f"no surface has the name or the face number '{word}'")
    known = {offer.kind.lower() for offer in offers}
    for kind in choice.kinds:
        if kind.lower() not in known:
            raise _error(
                f"no surface is of the kind '{kind}'; there are {', '.join(sorted(known))}"
            )
    taken = tuple(offer for offer in offers if _fits(offer, choice))
    if not taken:
        raise _error(_why_none(offers, choice))
    return taken


def _why_none(offers: Sequence[Offer], choice: Choice) -> str:
    whys = Counter(
        offer.against or "it is a free form, which needs the zone of its profile"
        for offer in offers
        if not choice.only and _is_asked_for(offer, choice)
    )
    if not whys:
        return "no surface has the name, kind and size of the choice"
    (why, often), *_ = whys.most_common(1)
    return f"no surface fits the choice; most often ({often} of {whys.total()}), {why}"


def _fits(offer: Offer, choice: Choice) -> bool:
    if choice.only:
        wanted = _named(offer, choice.only)
    elif offer.free_form is not None:
        wanted = choice.profiles
    else:
        wanted = choice.everything or not offer.against
    return wanted and _is_asked_for(offer, choice)


def _is_asked_for(offer: Offer, choice: Choice) -> bool:
    kinds = {kind.lower() for kind in choice.kinds}
    return (
        not _named(offer, choice.without)
        and (not kinds or offer.kind.lower() in kinds)
        and choice.least_mm <= offer.size_mm <= choice.most_mm
    )


def _named(offer: Offer, words: Sequence[str]) -> bool:
    name = offer.feature.name.upper()
    return any(
        (word.isdecimal() and int(word) in offer.faces) or fnmatchcase(name, word.upper())
        for word in words
    )


def _error(what: str) -> InputError:
    return InputError(
        "plan.choice",
        f"Of the model {what}.",
        "Look at what it offers: Import lists it, as does ocmm plan import.",
    )


_NO_ZONE = "it is a free form, and no zone of a profile is given"
_NOT_CHOSEN = "it is not among the chosen surfaces"


@dataclass(frozen=True, slots=True)
class FacesAccount:
    """How many faces of a model became features, and why the others did not."""

    faces: int
    """Of the file, of all components of an assembly."""
    taken: int
    left_out: tuple[tuple[str, int], ...]
    """Reasons, parts of a sentence, and numbers, most first; with ``taken``, all faces."""
    recognised: tuple[tuple[str, float], ...] = ()
    """Features that are splines in the file, and their largest distance from these, mm."""

    def sentence(self) -> str:
        rest = self.faces - self.taken
        return f"{self.faces} faces in the model: {self.taken} taken, {rest} left out."

    def recognised_sentence(self) -> str:
        """Return the number of recognised surfaces and their accuracy; empty for none."""
        if not self.recognised:
            return ""
        most = max(deviation for _, deviation in self.recognised)
        return (
            f"{len(self.recognised)} of the features are splines in the file and were recognised: "
            f"deviation up to {1000.0 * most:.3f} \N{MICRO SIGN}m, limit "
            f"{1000.0 * RECOGNISED_MM:g} \N{MICRO SIGN}m."
        )


def faces_account(
    model: StepModel, taken: Sequence[Offer], refused: Iterable[LeftOut] = ()
) -> FacesAccount:
    """Return the result of each face; ``refused``: after selection, see `ask_for_chosen`."""
    names = {one.feature.name for one in taken}
    whys = {one.feature.name: one.why for one in refused}
    counts: Counter[str] = Counter(model.not_measured)
    counts.update({f"its surface is of the kind {kind}": number
                   for kind, number in model.others.items() if kind in NOT_EXACT})  # fmt: skip
    faces = 0
    for offer in offers_of(model):
        name, number = offer.feature.name, len(offer.faces)
        if name in names:
            faces += number
        else:
            usual = _NOT_CHOSEN if offer.free_form is None else _NO_ZONE
            counts[whys.get(name) or offer.against or usual] += number
    recognised = tuple((name, off) for name, off in model.recognised.items() if name in names)
    return FacesAccount(model.face_count, faces, tuple(counts.most_common()), recognised)


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
    reached = reach.evaluate(points, normals_of(face, points), own, bore_axis(face))
    found = taken_of(
        face, points, reached, len(points), feature.points, lambda: reach.why_not(reached)
    )
    if found.against:
        return LeftOut(msgspec.structs.replace(feature, targets=()), found.against, offer.faces)
    return replace(offer, feature=msgspec.structs.replace(feature, targets=triples(found.points)))


def _free_form_asked(offer: Offer, form: FreeForm, reach: Reach) -> Offer | LeftOut:
    points, normals = np.array(form.targets), np.array(form.normals)
    reached = reach.evaluate(points, normals, [number - 1 for number in offer.faces])
    can, held = reached_places(points, reached)
    if not len(can):
        return LeftOut(offer.feature, reach.why_not(reached), offer.faces)
    kept = replace(
        form, targets=triples(points[can]), normals=triples(normals[can]), held=triples(held),
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
