from __future__ import annotations

from time import perf_counter

from PySide6.QtCore import QObject, QTimer, Signal

from ocmm_gui.scene._scene import Orbit

EASE_S = 0.4
_FRAME_MS = 25


class Easing(QObject):
    """Transition between two views, slow at both ends."""

    moved = Signal(object)
    """Emits the current view, an `Orbit`."""

    def __init__(self, parent: QObject, *, animated: bool) -> None:
        super().__init__(parent)
        self._animated = animated
        self._start: Orbit | None = None
        self.goal: Orbit | None = None
        """Target; None while at rest."""
        self._began_s = 0.0
        self._timer = QTimer(self)
        self._timer.setInterval(_FRAME_MS)
        self._timer.timeout.connect(self._go_on)

    def is_running(self) -> bool:
        return self.goal is not None

    def begin(self, start: Orbit, goal: Orbit) -> None:
        """Start a transition, replacing a running one."""
        self._start, self.goal, self._began_s = start, goal, perf_counter()
        if self._animated and not start.is_like(goal):
            self._timer.start()
        else:
            self.finish()

    def finish(self) -> None:
        goal = self.goal
        self.stop()
        if goal is not None:
            self.moved.emit(goal)

    def stop(self) -> None:
        self._timer.stop()
        self._start = self.goal = None

    def _go_on(self) -> None:
        if self._start is None or self.goal is None:
            return
        share = (perf_counter() - self._began_s) / EASE_S
        if share >= 1.0:
            self.finish()
        else:
            # Smoothstep: zero speed at both ends.
            self.moved.emit(self._start.toward(self.goal, share * share * (3.0 - 2.0 * share)))
