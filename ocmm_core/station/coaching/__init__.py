"""The coach of a running station: looks a few times a second, and tells changes only.

In: the latest pose of the probe and which LEDs are seen. Out: the ellipsoid of the ball, a steady
hint, or while the probe is lost one remedy with a picture, as a signal when one of them changes.

Read `_watch` (a thread of its own, started by whoever shows it) and `_view` (what it tells).
What a hint is, `ocmm_core.coach` says; it must not know a screen, nor the other rooms of a station.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.station.coaching._view import NOTHING, CoachView, LastPose, ProbeNow
    from ocmm_core.station.coaching._watch import CoachWatch
else:
    __getattr__ = door(__name__, _view="CoachView LastPose NOTHING ProbeNow", _watch="CoachWatch")

__all__ = ["NOTHING", "CoachView", "CoachWatch", "LastPose", "ProbeNow"]
