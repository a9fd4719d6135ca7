"""Pages of steps that prepare and collect observations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Protocol

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QListWidget, QListWidgetItem, QWidget

from ocmm_core.calibration.guided import KnownPoint, KnownPointsView, VerificationView
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_gui.kit import dressed, fill, hbox, panel, said_word, text_font, tr, vbox
from ocmm_gui.wizards.pages._live_panel import LivePanel, Score
from ocmm_gui.wizards.pages._picture import ScenePicture, bar_places, bars, reference_points, seats
from ocmm_gui.wizards.pages._shown import StepSnapshot

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
        live = seen.view.base.live
        self.live.show_live(live, automatic=seen.automatic, complete=seen.complete)


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
