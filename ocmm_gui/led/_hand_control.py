"""Control of the virtual probe: while leading, mouse and keys move the ball, not the view."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Protocol

import numpy as np
from PySide6.QtCore import QEvent, QObject, QPointF, Qt, QTimer, Signal
from PySide6.QtGui import QAction, QKeyEvent, QMouseEvent, QWheelEvent

from ocmm_core.errors import OcmmError
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import LiveView
from ocmm_core.part_model import PlacedPart
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import ARROWS, NoticeCentre, tr
from ocmm_gui.led._hand_strip import TOUR, HandStrip, Tour, TourInputs
from ocmm_gui.scene import OrbitView
from ocmm_gui.views import PointView

_LEAN = float(np.radians(5.0))
_WHEEL_MM = 1.5
"""Per wheel notch, which is 120."""
_NOTCH = 120.0


class BallLead(QObject):
    """Translate input of a view to ball targets.

    Moving leads, the left button touches, the wheel approaches, the arrow keys lean the probe.
    While leading, the right button turns the view and the middle one pans.
    """

    pointed = Signal(object, object)
    """Emits the viewing ray: (3,), mm, and (3,), unit, world."""
    touched = Signal(object, object)
    """Emits the ray of a click."""
    nearer = Signal(float)
    """Emits the approach to the surface, mm."""
    leaned = Signal(float, float)
    """Emits the lean to the right and back, rad."""

    def __init__(self, view: OrbitView, parent: QObject) -> None:
        super().__init__(parent)
        self._view = view
        self._leads = False
        self._turned: QPointF | None = None

    def set_leading(self, leads: bool) -> None:
        if leads is self._leads:
            return
        self._leads, self._turned = leads, None
        self._view.setMouseTracking(leads)
        if leads:
            self._view.installEventFilter(self)
            self._view.setCursor(Qt.CursorShape.CrossCursor)
        else:
            self._view.removeEventFilter(self)
            self._view.unsetCursor()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Handle leading input; leave the rest to the view."""
        kind = event.type()
        if isinstance(event, QWheelEvent):
            self.nearer.emit(_WHEEL_MM * event.angleDelta().y() / _NOTCH)
            return True
        if isinstance(event, QMouseEvent):
            return self._mouse(kind, event)
        if isinstance(event, QKeyEvent) and kind is QEvent.Type.KeyPress:
            return self._key(event)
        return super().eventFilter(watched, event)

    def _mouse(self, kind: QEvent.Type, event: QMouseEvent) -> bool:
        place, button = event.position(), event.button()
        if kind is QEvent.Type.MouseMove:
            if self._turned is not None:
                way = place - self._turned
                self._turned = place
                self._view.turn(-0.008 * way.x(), 0.008 * way.y())
                return True
            if event.buttons() & Qt.MouseButton.MiddleButton:
                return False
            self.pointed.emit(*self._view.ray_at(place))
            return True
        if kind is QEvent.Type.MouseButtonDblClick and button is Qt.MouseButton.LeftButton:
            # Two clicks are two touches; the second is queued.
            return True
        if kind is QEvent.Type.MouseButtonPress and button is Qt.MouseButton.LeftButton:
            self._view.setFocus()
            self.touched.emit(*self._view.ray_at(place))
            return True
        if button is Qt.MouseButton.RightButton:
            self._turned = place if kind is QEvent.Type.MouseButtonPress else None
            return True
        return button is not Qt.MouseButton.MiddleButton

    def _key(self, event: QKeyEvent) -> bool:
        right, up = ARROWS.get(Qt.Key(event.key()), (0.0, 0.0))
        if not right and not up:
            return False
        self.leaned.emit(_LEAN * right, _LEAN * up)
        return True


class HandState(Protocol):
    """State of a led hand (`ocmm_sim.hand.HandView`)."""

    @property
    def aim_world(self) -> Float | None:
        """Return the target on the part, (3,), mm; None off the part."""
        ...

    @property
    def normal_world(self) -> Float | None:
        """Return the outward normal there, (3,), unit."""
        ...


class ProbeHandState(Protocol):
    """State of the probe (`ocmm_sim.hand.LedView`)."""

    @property
    def taken(self) -> bool: ...

    @property
    def hand(self) -> HandState: ...

    @property
    def turn(self) -> tuple[float, float]:
        """Return the lean of the probe, rad."""
        ...


class LedProbe(Protocol):
    """Probe of a virtual rig (`ocmm_sim.hand.HandAtRig`)."""

    @property
    def taken(self) -> bool: ...

    def take_over(self) -> None:
        """Take it; raise OcmmError if impossible."""
        ...

    def hand_back(self) -> None: ...

    def point_at(self, origin_world: Float, toward_world: Float) -> None: ...

    def touch_at(self, origin_world: Float, toward_world: Float) -> bool: ...

    def nearer(self, step_mm: float) -> None: ...

    def lean(self, right_rad: float, back_rad: float) -> None: ...

    def press(self) -> None: ...

    def view(self) -> ProbeHandState: ...

    def part(self) -> PlacedPart:
        """Return the part; raise OcmmError if it has no shape."""
        ...


class HandControl(QObject):
    """Connect strip, 3-D view and keys to the hand; `hand` is None for real probes."""

    def __init__(
        self,
        hand: LedProbe | None,
        bridge: StationBridge,
        view: PointView,
        actions: dict[str, QAction],
        notices: NoticeCentre,
        to_desk: Callable[[], None],
        page: Callable[[], str],
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._hand, self._bridge, self._view = hand, bridge, view
        self._notices, self._to_desk, self._page = notices, to_desk, page
        self.tour = Tour()
        self.strip = HandStrip(actions["hand"], actions["tour"])
        self.strip.setVisible(hand is not None)
        self.strip.show_waiting()
        self._waits = True
        self.strip.skip_button.clicked.connect(self._skip)
        self.lead = BallLead(view, self)
        if hand is not None:
            self.lead.pointed.connect(hand.point_at)
            self.lead.touched.connect(self._touch)
            self.lead.nearer.connect(hand.nearer)
            self.lead.leaned.connect(hand.lean)
            # After the window is ready: show the part for the robot's touches.
            QTimer.singleShot(0, self, self._show_part)

    @property
    def taken(self) -> bool:
        return self._hand is not None and self._hand.taken

    def calls(self) -> dict[str, Callable[[], None]]:
        """Return the commands by action key."""
        return {"hand": self.toggle, "tour": self.toggle_tour, "take": self.record_point}

    def toggle(self) -> None:
        hand = self._hand
        if hand is None:
            self._tell_real()
            return
        try:
            if hand.taken:
                hand.hand_back()
            else:
                hand.take_over()
        except OcmmError as error:
            self._notices.error(error)
            return
        if hand.taken:
            self._to_desk()
        self.lead.set_leading(hand.taken)
        self._view.lead(led=hand.taken, part=hand.part())
        self._waits = False
        self.strip.show_hand(taken=hand.taken)
        if hand.taken:
            self._view.setFocus()
        self._poll()

    def close(self) -> None:
        """Stop filtering input; call before the window closes."""
        self.tour.end()
        self.lead.set_leading(False)

    def record_point(self) -> None:
        """Take a point: with the button of the led probe, or as the key does."""
        if self._hand is not None and self._hand.taken:
            self._hand.press()
        else:
            self._bridge.job.record_point()

    def toggle_tour(self) -> None:
        if self._hand is None:
            self._tell_real()
            return
        if self.tour.runs:
            self.tour.end()
        else:
            self._to_desk()
            self.tour.start()
        self._show_step()

    def show_live(self, _live: LiveView) -> None:
        """Show the aim on the part, and check the tour step."""
        if self._hand is None:
            return
        if self._waits:
            self._waits = False
            self.strip.show_hand(taken=self._hand.taken)
        seen = self._hand.view()
        if seen.taken:
            self._view.show_aim(seen.hand.aim_world, seen.hand.normal_world)
        self._poll()

    def show_practice(self, *, practises: bool) -> None:
        """Show that a practised wizard does not count; the strip is above all pages."""
        self.strip.show_practice(practises=practises)
        self.strip.setVisible(practises or self._hand is not None)

    def _show_part(self) -> None:
        if self._hand is None or self._hand.taken:
            return
        # A part without shape cannot be shown; its nominals still are.
        with contextlib.suppress(OcmmError):
            self._view.lead(led=False, part=self._hand.part())

    def _touch(self, origin: object, toward: object) -> None:
        if self._hand is not None:
            self._hand.touch_at(origin, toward)  # type: ignore[arg-type]  # arrays, by a signal

    def _poll(self) -> None:
        if self._hand is None or not self.tour.runs:
            return
        job = self._bridge.shown.job
        live = self._bridge.station.looks.live()
        now = TourInputs(
            self._hand.taken, sum(len(one.points) for one in job.features), live.tip_world,
            self._hand.view().turn, self._page(), job,
        )  # fmt: skip
        last = self.tour.number == len(TOUR)
        if self.tour.poll(now):
            self._show_step()
            if last and not self.tour.runs:
                self._notices.inform(
                    tr("Tour done. Everything you did went the way of a real probe.")
                )
        else:
            self._show_step()

    def _skip(self) -> None:
        self.tour.skip()
        self._show_step()

    def _show_step(self) -> None:
        active = self._bridge.shown.job.active
        sentence = self.tour.sentence(active or tr("the part"))
        self.strip.show_step(sentence, self.tour.number, len(TOUR))

    def _tell_real(self) -> None:
        self._notices.warn(
            tr("Take over is for the virtual rig: this probe is in your hands already."),
            tr("Choose Demo on the Start page."),
        )
