"""Account of all faces of a model, each imported or omitted with its reason."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ocmm_cad.step._choice import Offer, offers_of
from ocmm_cad.step._model import LeftOut, StepModel
from ocmm_cad.step._profiled import NOT_EXACT
from ocmm_cad.step.brep import RECOGNISED_MM

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
