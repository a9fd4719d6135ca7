"""Who holds the probe of a virtual rig: mouse and keys on one side, the core on the other.

Mouse and keys over the 3-D view while they lead the ball, not the view.
"""

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
from ocmm_gui.kit import NoticeCentre, tr
from ocmm_gui.led._hand_strip import HandStrip
from ocmm_gui.led._tour import TOUR, Tour, TourLook
from ocmm_gui.scene import OrbitView
from ocmm_gui.views import PointView

_LEAN = float(np.radians(5.0))
_WHEEL_MM = 1.5
"""For each notch of a wheel, which is 120."""
_NOTCH = 120.0


class BallLead(QObject):
    """Turn what is done in a view into where the ball shall be.

    Moving leads, the left button touches, the wheel brings nearer, the arrow keys lean the probe.
    The right button turns the view and the middle one moves it, as long as this leads.

    Parameters
    ----------
    view
        Whose mouse and keys.
    parent
        Outlives neither the view nor the window.
    """

    pointed = Signal(object, object)
    """Emits a ray of the eye: (3,), mm, and (3,), unit, world."""
    touched = Signal(object, object)
    """Emits the same where somebody pressed."""
    nearer = Signal(float)
    """Emits how much nearer to the surface, mm."""
    leaned = Signal(float, float)
    """Emits how far to the right and back, rad."""

    def __init__(self, view: OrbitView, parent: QObject) -> None:
        super().__init__(parent)
        self._view = view
        self._leads = False
        self._turned: QPointF | None = None

    def set_leading(self, leads: bool) -> None:
        """Lead the ball from now on, or the view."""
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
        """Take what leads the ball; leave the rest to the view."""
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
            # Two clicks are two touches; the second comes while the first is made.
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
        leans = {
            Qt.Key.Key_Left: (-_LEAN, 0.0),
            Qt.Key.Key_Right: (_LEAN, 0.0),
            Qt.Key.Key_Up: (0.0, _LEAN),
            Qt.Key.Key_Down: (0.0, -_LEAN),
        }
        lean = leans.get(Qt.Key(event.key()))
        if lean is None:
            return False
        self.leaned.emit(*lean)
        return True


class HandSeen(Protocol):
    """What a led hand does (`ocmm_core.simulation.hand.HandView`)."""

    @property
    def aim_world(self) -> Float | None:
        """Return the place that is meant on the part, (3,), mm; None over nothing."""
        ...

    @property
    def normal_world(self) -> Float | None:
        """Return the way out of the part there, (3,), unit."""
        ...


class LedSeen(Protocol):
    """How the probe is held (`ocmm_core.simulation.hand.LedView`)."""

    @property
    def taken(self) -> bool:
        """Return whether somebody leads it."""
        ...

    @property
    def hand(self) -> HandSeen:
        """Return what the hand does."""
        ...

    @property
    def turn(self) -> tuple[float, float]:
        """Return how the probe is leaned, rad."""
        ...


class LedProbe(Protocol):
    """The probe of a virtual rig (`ocmm_core.simulation.hand.HandAtRig`)."""

    @property
    def taken(self) -> bool:
        """Return whether somebody else than the robot holds it."""
        ...

    def take_over(self) -> None:
        """Take it; raise OcmmError where that is not possible."""
        ...

    def hand_back(self) -> None:
        """Give it to the robot."""
        ...

    def point_at(self, origin_world: Float, toward_world: Float) -> None:
        """Lead the ball over what is seen along a ray."""
        ...

    def touch_at(self, origin_world: Float, toward_world: Float) -> bool:
        """Touch what is seen along a ray once."""
        ...

    def nearer(self, step_mm: float) -> None:
        """Lead the ball nearer to the surface."""
        ...

    def lean(self, right_rad: float, back_rad: float) -> None:
        """Lean the probe."""
        ...

    def press(self) -> None:
        """Press its button."""
        ...

    def view(self) -> LedSeen:
        """Return how it is held."""
        ...

    def part(self) -> PlacedPart:
        """Return what is touched; raise OcmmError where it looks like nothing."""
        ...


class HandControl(QObject):
    """Join the strip, the 3-D view and the keys to the hand of the virtual rig.

    Parameters
    ----------
    hand
        None where the probe is real.
    actions
        By key.
    notices
        Where errors go.
    to_desk
        Shows the view.
    page
        Returns the name of the page that is shown.
    """

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
            # Once the window is there: whoever watches the robot sees what it touches.
            QTimer.singleShot(0, self, self._show_part)

    @property
    def taken(self) -> bool:
        """Return whether whoever sits here holds the probe."""
        return self._hand is not None and self._hand.taken

    def calls(self) -> dict[str, Callable[[], None]]:
        """Return what the keys do, by key of the action."""
        return {"hand": self.toggle, "tour": self.toggle_tour, "take": self.take}

    def toggle(self) -> None:
        """Take the probe, or hand it back."""
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
        self._look()

    def close(self) -> None:
        """Let mouse and keys go; call it before the window goes."""
        self.tour.end()
        self.lead.set_leading(False)

    def take(self) -> None:
        """Take a point: with the button of the probe that is held here, or as the key does."""
        if self._hand is not None and self._hand.taken:
            self._hand.press()
        else:
            self._bridge.job.take()

    def toggle_tour(self) -> None:
        """Begin the tour, or end it."""
        if self._hand is None:
            self._tell_real()
            return
        if self.tour.runs:
            self.tour.end()
        else:
            self._to_desk()
            self.tour.begin()
        self._show_step()

    def show_live(self, _live: LiveView) -> None:
        """Show what is meant on the part, and see what was done of the tour."""
        if self._hand is None:
            return
        if self._waits:
            self._waits = False
            self.strip.show_hand(taken=self._hand.taken)
        seen = self._hand.view()
        if seen.taken:
            self._view.show_aim(seen.hand.aim_world, seen.hand.normal_world)
        self._look()

    def show_practice(self, *, practises: bool) -> None:
        """Say that nothing counts, as long as a wizard is practised; the strip stands above all."""
        self.strip.show_practice(practises=practises)
        self.strip.setVisible(practises or self._hand is not None)

    def _show_part(self) -> None:
        if self._hand is None or self._hand.taken:
            return
        # A part of places only looks like nothing; what its plan knows of it is shown as ever.
        with contextlib.suppress(OcmmError):
            self._view.lead(led=False, part=self._hand.part())

    def _touch(self, origin: object, toward: object) -> None:
        if self._hand is not None:
            self._hand.touch_at(origin, toward)  # type: ignore[arg-type]  # arrays, by a signal

    def _look(self) -> None:
        if self._hand is None or not self.tour.runs:
            return
        job = self._bridge.shown.job
        live = self._bridge.station.looks.live()
        now = TourLook(
            self._hand.taken, sum(len(one.points) for one in job.features), live.tip_world,
            self._hand.view().turn, self._page(), job,
        )  # fmt: skip
        last = self.tour.number == len(TOUR)
        if self.tour.look(now):
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
