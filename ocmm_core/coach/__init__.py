"""The coach: present uncertainty of the ball, and the turn that reduces it.

In: rig, probe, its pose and which camera sees which LED. Out: the ellipsoid of the ball, the turn
of the probe that reduces its uncertainty, one remedy while it is lost, and the flat probe from the
view of the inspector.

Read `_turns` (position of the inspector, turns, ellipsoid, picture, and the predicted U of the
visible LEDs), `_advice` (the best turn, no flicker, the remedy).
The package is independent of stations, threads and screens.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.coach._advice import (
        LEAST_LEDS, REAL_SHARE, Advice, Hint, ProbeHelp, SteadyHint, advise, help_when_lost,
    )  # fmt: skip
    from ocmm_core.coach._turns import (
        TURNS, Ellipsoid, Held, ProbePicture, Sensitivities, Stance, Turn, Way, covariance_of,
        ellipsoid_of, picture_of, stance_at,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "LEAST_LEDS", "REAL_SHARE", "TURNS", "Advice", "Ellipsoid", "Held", "Hint", "ProbeHelp",
    "ProbePicture", "Sensitivities", "Stance", "SteadyHint", "Turn", "Way", "advise",
    "covariance_of", "ellipsoid_of", "help_when_lost", "picture_of", "stance_at",
]  # fmt: skip
