"""Surfaces offered by a model, and their selection, for command line, window and scripts.

All faces of the model are accounted for, each imported or omitted with its reason.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from ocmm_cad.step._model import LeftOut, StepModel
from ocmm_cad.step._profiled import NOT_EXACT, FreeForm
from ocmm_cad.step.brep import RECOGNISED_MM
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature

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
    wanted = _named(offer, choice.only) if choice.only else _to_begin_with(offer, choice)
    return wanted and _is_asked_for(offer, choice)


def _is_asked_for(offer: Offer, choice: Choice) -> bool:
    kinds = {kind.lower() for kind in choice.kinds}
    return (
        not _named(offer, choice.without)
        and (not kinds or offer.kind.lower() in kinds)
        and choice.least_mm <= offer.size_mm <= choice.most_mm
    )


def _to_begin_with(offer: Offer, choice: Choice) -> bool:
    if offer.free_form is not None:
        return choice.profiles
    return choice.everything or not offer.against


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
