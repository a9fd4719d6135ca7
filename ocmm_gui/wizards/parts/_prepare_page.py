"""Page with the facts of a session before it continues."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime

from PySide6.QtWidgets import QVBoxLayout

from ocmm_core.calibration.guided import KnownPointsView, ProcedureView, VerificationView
from ocmm_core.camera import Rig
from ocmm_gui.kit import panel, said, said_word, sentence_label, time_words, tr
from ocmm_gui.wizards.parts._facts import Facts
from ocmm_gui.wizards.parts._pages import SIDE_PX, StepPage, beside
from ocmm_gui.wizards.parts._picture import (
    Contents,
    ScenePicture,
    bar_places,
    bars,
    reference_points,
)
from ocmm_gui.wizards.parts._shown import Seen


@dataclass(frozen=True, slots=True)
class Planned:
    """The plan: a picture, its description, and advice that could not be followed."""

    contents: Contents
    description: str
    notes: tuple[str, ...] = ()


def planned_points(seen: Seen) -> Planned:
    points = seen.view_as(KnownPointsView).points
    return Planned(
        reference_points(points, None), tr("%n reference points", "1 reference point", len(points))
    )


def planned_lines(seen: Seen) -> Planned:
    view = seen.view_as(VerificationView)
    places = bar_places(view.lines)
    return Planned(
        bars(places, None), tr("%n measuring lines", "1 measuring line", len(places)), view.notes
    )


class PreparePage(StepPage):
    """Fixed facts of the session, next to a picture of the plan."""

    def __init__(self, rig: Rig, planned: Callable[[Seen], Planned] | None = None) -> None:
        super().__init__()
        self._planned = planned
        self.picture = ScenePicture(tr("Volume in front of the cameras"), rig)
        self.facts = Facts(tr("The session"))
        column = QVBoxLayout()
        self.notes = sentence_label(tr("Deviations from the recommended plan"), 14)
        column.addWidget(self.facts)
        column.addWidget(self.notes)
        column.addStretch(1)
        layout = beside(self, self.picture)
        side = panel(column)
        side.setFixedWidth(SIDE_PX)
        layout.addWidget(side)

    def show_seen(self, seen: Seen) -> None:
        self.facts.show_facts(session_facts(seen.view.base))
        if self._planned is not None:
            planned = self._planned(seen)
            self.picture.show_contents(planned.contents, planned.description)
            self.notes.setText("\n".join(f"▲ {said(note)}" for note in planned.notes))


def session_facts(base: ProcedureView) -> list[tuple[str, str]]:
    begun = datetime.fromisoformat(base.begun_utc).astimezone()
    # Permits line breaks within the file name.
    file = base.session.name.replace("-", "-\u200b").replace("T", "T\u200b")
    return [
        (tr("Rig"), base.rig),
        (tr("Done by"), base.who),
        (tr("Begun"), time_words(begun)),
        *(
            (said_word(step.title), tr("{wanted} wanted").format(wanted=step.wanted))
            for step in base.steps
            if step.wanted
        ),
        (tr("Session file"), file),
    ]
