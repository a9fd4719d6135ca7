"""The coach: present uncertainty of the ball, and the turn that reduces it.

In: rig, probe, its pose and which camera sees which LED. Out: the ellipsoid of the ball, the turn
of the probe that reduces its uncertainty, one remedy while it is lost, and the flat probe from the
view of the inspector.

Read `_stance` (position of the inspector), `_turns` (possible turns), `_prediction` (visible LEDs
and the resulting U), `_advice` (the best turn), `_steady` (no flicker), `_ellipsoid`, then
`_remedy` and `_picture`. The package is independent of stations, threads and screens.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.coach._advice import LEAST_LEDS, REAL_SHARE, Advice, Hint, advise, uncertainty_of
    from ocmm_core.coach._ellipsoid import Ellipsoid, ellipsoid_of
    from ocmm_core.coach._picture import ProbePicture, picture_of
    from ocmm_core.coach._prediction import Held, Sensitivities, covariance_of
    from ocmm_core.coach._remedy import ProbeHelp, help_when_lost
    from ocmm_core.coach._stance import Stance, stance_at
    from ocmm_core.coach._steady import SteadyHint
    from ocmm_core.coach._turns import TURNS, Turn, Way
else:
    __getattr__ = door(
        __name__,
        _advice="Advice Hint LEAST_LEDS REAL_SHARE advise uncertainty_of",
        _ellipsoid="Ellipsoid ellipsoid_of",
        _picture="ProbePicture picture_of",
        _prediction="Held Sensitivities covariance_of",
        _remedy="ProbeHelp help_when_lost",
        _stance="Stance stance_at",
        _steady="SteadyHint",
        _turns="TURNS Turn Way",
    )

__all__ = [
    "LEAST_LEDS", "REAL_SHARE", "TURNS", "Advice", "Ellipsoid", "Held", "Hint", "ProbeHelp",
    "ProbePicture", "Sensitivities", "Stance", "SteadyHint", "Turn", "Way", "advise",
    "covariance_of", "ellipsoid_of", "help_when_lost", "picture_of", "stance_at", "uncertainty_of",
]  # fmt: skip
