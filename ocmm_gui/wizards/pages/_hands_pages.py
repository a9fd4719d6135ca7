"""Pages before a session continues, with its facts, and while both hands hold the probe."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime

from PySide6.QtWidgets import QVBoxLayout, QWidget

from ocmm_core.calibration.guided import KnownPointsView, Live, ProcedureView, VerificationView
from ocmm_core.camera import Rig
from ocmm_core.tracking import ProbeBody
from ocmm_gui.charts import SphereMap
from ocmm_gui.kit import fill, hbox, panel, said, said_word, sentence_label, time_words, tr, vbox
from ocmm_gui.wizards.pages import _picture as picture
from ocmm_gui.wizards.pages._live_panel import CameraRow, FarBanner
from ocmm_gui.wizards.pages._pages import SIDE_PX, StepPage, beside
from ocmm_gui.wizards.pages._shown import Facts, StepSnapshot


@dataclass(frozen=True, slots=True)
class StepPlan:
    """The plan: a picture, its description, and advice that could not be followed."""

    contents: picture.Contents
    description: str
    notes: tuple[str, ...] = ()


def planned_points(seen: StepSnapshot) -> StepPlan:
    points = seen.view_as(KnownPointsView).points
    return StepPlan(
        picture.reference_points(points, None),
        tr("%n reference points", "1 reference point", len(points)),
    )


def planned_lines(seen: StepSnapshot) -> StepPlan:
    view = seen.view_as(VerificationView)
    places = picture.bar_places(view.lines)
    return StepPlan(
        picture.bars(places, None),
        tr("%n measuring lines", "1 measuring line", len(places)),
        view.notes,
    )


class PreparePage(StepPage):
    """Fixed facts of the session, next to a picture of the plan."""

    def __init__(self, rig: Rig, planned: Callable[[StepSnapshot], StepPlan] | None = None) -> None:
        super().__init__()
        self._planned = planned
        self.picture = picture.ScenePicture(tr("Volume in front of the cameras"), rig)
        self.facts = Facts(tr("The session"))
        column = QVBoxLayout()
        self.notes = sentence_label(tr("Deviations from the recommended plan"), 14)
        fill(column, self.facts, self.notes)
        column.addStretch(1)
        layout = beside(self, self.picture)
        side = panel(column)
        side.setFixedWidth(SIDE_PX)
        layout.addWidget(side)

    def show_seen(self, seen: StepSnapshot) -> None:
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


_SIDE_PX = 360


class ProbePreparePage(StepPage):
    """Fixed facts of a probe session, next to a picture of the probe."""

    def __init__(self, design: ProbeBody, facts: Sequence[tuple[str, str]]) -> None:
        super().__init__()
        self._about = tuple(facts)
        self.picture = picture.ProbeDrawing()
        self.picture.show_probe(design.leds_probe, design.led_directions_probe, design.tip_probe)
        self.facts = Facts(tr("The session"))
        column = vbox(self.facts)
        column.addStretch(1)
        side = panel(column)
        side.setFixedWidth(_SIDE_PX)
        hbox((self.picture, 1), side, parent=self, spacing=8, margins=0)

    def show_seen(self, seen: StepSnapshot) -> None:
        base = seen.view.base
        self.facts.show_facts((*self._about, *session_facts(base)))


class HandsPage(StepPage):
    """Far banner, map below, scores and cameras at the right; steps are automatic."""

    hands_are_full = True
    goes_on_by_itself = True

    def __init__(self, rig: Rig, told: str, mapped: str) -> None:
        super().__init__()
        self.banner = FarBanner(told)
        self.map = SphereMap(mapped, rig)
        self.cameras = CameraRow(rig)
        self.scores = vbox(spacing=4)
        side = vbox((panel(self.scores), 3), spacing=8, margins=0)
        side.addWidget(panel(vbox(self.cameras)), 1)
        holder = QWidget()
        holder.setLayout(side)
        holder.setFixedWidth(_SIDE_PX)
        self.beside = hbox((self.map, 1), holder, spacing=8)
        vbox((self.banner, 3), (self.beside, 5), parent=self, spacing=8, margins=0)

    def show_cameras(self, live: Live) -> None:
        self.cameras.show_cameras(live.cameras)
