"""Pages of steps that prepare and collect observations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QListWidget, QListWidgetItem, QVBoxLayout, QWidget

from ocmm_core.calibration.guided import (
    KnownPoint,
    KnownPointsView,
    Live,
    ProcedureView,
    TrackerView,
    VerificationView,
)
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody
from ocmm_gui.charts import SphereMap
from ocmm_gui.kit import (
    dressed,
    fill,
    hbox,
    panel,
    said,
    said_word,
    sentence_label,
    text_font,
    time_words,
    tr,
    vbox,
)
from ocmm_gui.wizards.pages import _picture as picture
from ocmm_gui.wizards.pages._live_panel import CameraRow, FarBanner, LivePanel, Score
from ocmm_gui.wizards.pages._picture import ScenePicture, bar_places, bars, reference_points, seats
from ocmm_gui.wizards.pages._shown import Facts, StepSnapshot

SIDE_PX = 360
Command = Callable[[datetime], None]


class StepPage(QWidget):
    """One step of a procedure."""

    commanded = Signal(object)
    """Emits a page-specific `Command` for the procedure."""
    sounded = Signal(object)

    keys: tuple[str, ...] = ("back", "next")
    """Its actions in `keys.WIZARD_ACTIONS`."""
    hands_are_full = False
    """Take automatically from the start."""
    goes_on_by_itself = False
    """Enter the next step automatically after a delay."""

    def show_seen(self, seen: StepSnapshot) -> None:
        raise NotImplementedError

    def show_plot(self, number: int) -> None:
        """Show one of several plots; does nothing on pages without plots."""

    def allows(self, key: str) -> bool:
        """Return whether the result on the page permits one of its actions."""
        return True

    def must_say_why(self) -> str:
        """Return what must be explained before accepting; empty if nothing."""
        return ""


class CollectPage(StepPage):
    """Picture of the target on the left; score and live view on the right."""

    keys: tuple[str, ...] = ("back", "drop", "automatic", "take", "next")

    def __init__(self, rig: Rig, counted: str) -> None:
        super().__init__()
        self.picture = ScenePicture(tr("Where to go"), rig)
        self.score = Score(counted)
        self.live = LivePanel(rig)
        self.beside = beside(self, self.picture)
        self.side = vbox(spacing=8)
        self.scores = vbox(self.score)
        fill(self.side, (panel(self.scores), 2), (self.live, 4))
        holder = QWidget()
        self.side.setContentsMargins(0, 0, 0, 0)
        holder.setLayout(self.side)
        holder.setFixedWidth(SIDE_PX)
        self.beside.addWidget(holder)

    def show_seen(self, seen: StepSnapshot) -> None:
        step = seen.view.base.step
        share = step.done / step.wanted if step.wanted else 0.0
        left = step.wanted - step.done
        note = tr("%n more", "", left) if left > 0 else tr("complete")
        self.score.show_score(f"{step.done} / {step.wanted}", note, share)
        self.live.show_live(seen.view.base.live, automatic=seen.automatic, complete=seen.complete)


class PointTargets(Protocol):
    """A procedure with selectable next point."""

    def aim(self, point: str | None) -> None: ...


class KnownPointsPage(CollectPage):
    """List of reference points, the next one in the picture."""

    keys = ("back", "drop", "skip", "automatic", "take", "next")

    def __init__(self, rig: Rig, procedure: PointTargets) -> None:
        super().__init__(rig, tr("Points taken"))
        self._procedure = procedure
        self._points: tuple[KnownPoint, ...] = ()
        self._aim: int | None = -1
        self.list = dressed(
            QListWidget(), tr("Reference points"), tr("Select the next point"), font=text_font(15)
        )
        self.list.setFixedWidth(150)
        self.list.setUniformItemSizes(True)
        self.list.currentRowChanged.connect(self._choose)
        self.beside.insertWidget(0, self.list)

    def show_seen(self, seen: StepSnapshot) -> None:
        super().show_seen(seen)
        view = seen.view_as(KnownPointsView)
        if _states(view.points) == _states(self._points) and view.next_point == self._aim:
            return
        self._points, self._aim = view.points, view.next_point
        self._fill()
        where = tr("none") if self._aim is None else view.points[self._aim].name
        self.picture.show_contents(
            reference_points(view.points, self._aim), tr("Next: {where}").format(where=where)
        )

    def _fill(self) -> None:
        self.list.blockSignals(True)
        if self.list.count() != len(self._points):
            self.list.clear()
            for _ in self._points:
                QListWidgetItem(self.list)
        for row, point in enumerate(self._points):
            mark = "  " if point.views is None else "✓ " if point.views else "– "
            self.list.item(row).setText(f"{mark}{point.name}")
        if self._aim is not None:
            self.list.setCurrentRow(self._aim)
            self.list.scrollToItem(self.list.item(self._aim))
        self.list.blockSignals(False)

    def _choose(self, row: int) -> None:
        if 0 <= row < len(self._points) and row != self._aim:
            name = self._points[row].name
            self.commanded.emit(lambda _now: self._procedure.aim(name))


class LinesPage(CollectPage):
    """The bar along its lines, with the next nest of the current one."""

    keys = ("back", "drop", "repeat", "automatic", "take", "next")

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig, tr("Nests taken"))
        self._shown: object = None

    def show_seen(self, seen: StepSnapshot) -> None:
        super().show_seen(seen)
        view = seen.view_as(VerificationView)
        state = (view.current_line, tuple(line.taken for line in view.lines))
        if state != self._shown:
            self._shown = state
            current = view.current_line
            where = (
                tr("all lines taken") if current is None else said_word(view.lines[current].name)
            )
            self.picture.show_contents(bars(bar_places(view.lines), current), where)


class SeatsView(Protocol):
    """Snapshot of a procedure that visits two seats first and last."""

    @property
    def seats_world(self) -> tuple[Float, ...]:
        """Return the seats that were visited, (3,), mm."""
        ...

    @property
    def next_seat(self) -> int | None:
        """Return the next seat; None if both were visited."""
        ...


class SeatsPage(CollectPage):
    """The two seats visited first and last, the next one in the picture."""

    def __init__(self, rig: Rig, view: type[SeatsView], *, again: bool) -> None:
        super().__init__(rig, tr("Seats visited"))
        self._view = view
        self._again = again
        self._shown: object = None

    def show_seen(self, seen: StepSnapshot) -> None:
        super().show_seen(seen)
        view = seen.view_as(self._view)
        state = (view.next_seat, len(view.seats_world))
        if state != self._shown:
            self._shown = state
            number = view.next_seat
            where = (
                tr("both seats visited")
                if number is None
                else tr("seat {number}").format(number=number + 1)
            )
            known = view.seats_world
            self.picture.show_contents(seats(known, number if self._again else None), where)


def _states(points: Sequence[KnownPoint]) -> tuple[tuple[str, int | None], ...]:
    return tuple((point.name, point.views) for point in points)


def beside(page: QWidget, first: QWidget) -> QHBoxLayout:
    """Lay out a widget on a page, with room at its side."""
    return hbox((first, 1), parent=page, spacing=8, margins=0)


class TrackerPage(CollectPage):
    """Places of the ball in the volume of a tracker."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig, tr("Recorded"))

    def show_seen(self, seen: StepSnapshot) -> None:
        super().show_seen(seen)
        tips = seen.view_as(TrackerView).tips_world
        points = [KnownPoint("", tip, 1) for tip in tips]
        self.picture.show_contents(
            reference_points(points, None), tr("Recorded places: %n", "", len(tips))
        )


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
        self.facts.show_facts((*self._about, *session_facts(seen.view.base)))


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
