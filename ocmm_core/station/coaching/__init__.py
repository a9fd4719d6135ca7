"""Coach of a running station: samples a few times a second, and reports changes only.

In: the latest pose of the probe and its visible LEDs. Out: the ellipsoid of the ball, a steady
hint, or while the probe is lost one remedy with a picture, as a signal of changes.

Read `_watch`: a thread started by the display, and its reports.
`ocmm_core.coach` defines hints; it must not know a screen, nor the other packages of a station.
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_core.station.coaching._watch import NOTHING, CoachView, CoachWatch, LastPose, ProbeNow
else:
    __getattr__ = door(__name__)

__all__ = ["NOTHING", "CoachView", "CoachWatch", "LastPose", "ProbeNow"]
