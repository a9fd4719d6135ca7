"""Irreversible actions of the Maintain mode; the key must be pressed twice."""

from __future__ import annotations

import time
from collections.abc import Callable

from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import NoticeCentre, tr
from ocmm_gui.maintain._probe_page import ProbePage

TWICE_S = 8.0
"""Time limit of the second press."""


class ConfirmedActions:
    """Write intrinsics to the cameras, and record a tip change."""

    def __init__(
        self,
        bridge: StationBridge,
        notices: NoticeCentre,
        probe: ProbePage,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._bridge = bridge
        self._notices = notices
        self._probe = probe
        self._clock = clock
        self._asked = ("", -float("inf"))

    def write_cameras(self) -> None:
        """Store the intrinsics of the calibration in the cameras."""
        asked = tr(
            "This overwrites the intrinsics stored in the cameras with those of the active "
            "calibration. Press W again to confirm."
        )
        if self._is_meant("cameras", asked):
            self._bridge.maintenance.write_to_cameras()

    def mount_tip(self) -> None:
        tip = self._probe.tips.chosen()
        if tip is None:
            self._notices.inform(tr("No tip calibrated yet: calibrate the probe with this tip."))
            return
        asked = tr(
            "Confirm that tip '{tip}' is now mounted? It must be checked before points "
            "are taken. Press N again to confirm."
        ).format(tip=tip)
        if self._is_meant(tr("tip {tip}").format(tip=tip), asked):
            self._bridge.maintenance.mount_tip(tip)
            self._probe.forget()

    def _is_meant(self, what: str, asked: str) -> bool:
        """Return whether the same was requested a moment before; otherwise request it."""
        now = self._clock()
        before, when = self._asked
        if before == what and now - when <= TWICE_S:
            self._asked = ("", -float("inf"))
            return True
        self._asked = (what, now)
        self._notices.inform(asked)
        return False
