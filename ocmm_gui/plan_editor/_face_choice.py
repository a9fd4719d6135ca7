"""Faces of the model that a part is aligned by: chosen on the part or in the list, by name."""

from __future__ import annotations

from ocmm_core.alignment import ModelBestFit
from ocmm_core.inspection.plan import Plan
from ocmm_core.part_model import ModelFace, PartModel
from ocmm_gui.kit import tr
from ocmm_gui.plan_editor._part_choice import ChoiceLine, ChoiceWords, PartChoice


class FaceChoice(PartChoice):
    """All faces that have an exact surface; emits the chosen `ModelFace`s, a tuple."""

    def __init__(self) -> None:
        self._faces: tuple[ModelFace, ...] = ()
        super().__init__(
            ChoiceWords(
                choice=tr("Faces to align by"),
                list=tr("Faces of the model"),
                take=tr("Align by these  [Return]"),
                take_long=tr("Align the part by a best fit to the chosen faces"),
                back_long=tr("Go back without faces"),
                about=tr("The selected face"),
            )
        )

    def show_faces(self, part: PartModel, plan: Plan) -> None:
        """Show the faces of a part; those that the plan is aligned by are chosen."""
        rule = plan.alignment
        before = {one.number for one in rule.faces} if isinstance(rule, ModelBestFit) else set()
        exact = [(place, face) for place, face in enumerate(part.faces) if face.spline is not None]
        self._faces = tuple(face for _, face in exact)
        self.show_lines(
            part,
            [
                ChoiceLine(face_words(face), (place,), face.number in before)
                for place, face in exact
            ],
        )

    def chosen(self) -> tuple[ModelFace, ...]:
        """Return the chosen faces, in the order of the model."""
        return tuple(self._faces[row] for row in self.chosen_rows())

    def said(self) -> str:
        """Return how many faces are chosen, or what they have to do."""
        if not self._faces:
            return tr("The model has no face with an exact surface.")
        count = len(self.chosen_rows())
        if not count:
            return tr("Choose faces that leave no motion of the part open.")
        words = tr("%n of {all} faces are chosen.", "1 of {all} faces is chosen.", count)
        return words.format(all=len(self._faces))

    def about(self, row: int) -> str:
        """Return the whole line: the list may cut it."""
        return face_words(self._faces[row])


def face_words(face: ModelFace) -> str:
    """Return a line: what the model or the import calls a face, its number, its kind."""
    number = tr("face {number}").format(number=face.number)
    named = face.name or face.feature
    kind = {
        "Plane": tr("Plane"), "Cylinder": tr("Cylinder"), "Cone": tr("Cone"),
        "Sphere": tr("Sphere"), "Torus": tr("Torus"),
    }.get(face.kind, tr("Free form"))  # fmt: skip
    return f"{named}   {number}   {kind}" if named else f"{number}   {kind}"
