"""Decide from residual samples whether a calibration has changed, and its cause.

Two cameras that see one probe determine only their relative pose: the moved camera is identified
with three cameras, after a lens change, or if the ball rests in nests with known places.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import scipy

from ocmm_core.calibration.monitor._drift_statistic import (
    CAMERA_CHANGES,
    N_MOTIONS,
    PossibleChange,
    Scores,
    score_changes,
)
from ocmm_core.calibration.monitor._residual_samples import Belief, ResidualSample
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody

_SHARE, _BY_CHANCE = 0.9, 15.0
"""One axis is named alone if it explains this share of the gain of all, or all but the amount that
five more free parameters explain by chance in 99 of 100 cases."""

_TEXTS = (
    ("pitch about", 1e6, "µrad"), ("yaw about", 1e6, "µrad"), ("roll about", 1e6, "µrad"),
    ("moved sideways about", 1e3, "µm"), ("moved up or down about", 1e3, "µm"),
    ("moved along its view about", 1e3, "µm"), ("focal length changed about", 1e3, "µm"),
    ("image shifted sideways about", 1.0, "px"), ("image shifted up or down about", 1.0, "px"),
)  # fmt: skip


def describe_motion(scores: Scores, camera: int) -> str:
    """Return the probable motion of a camera: about one axis if that explains it, else all."""
    motion = scores.motions[camera]
    best = int(np.argmax(scores.axes[camera, :N_MOTIONS]))
    if _alone(scores, camera, best, motion):
        return _amount(best, float(scores.axis_sizes[camera, best]))
    turn = 1e6 * float(np.linalg.norm(motion.size[:3]))
    shift = 1e3 * float(np.linalg.norm(motion.size[3:]))
    return (
        f"it rotated and moved about several axes, about {turn:.0f} µrad and {shift:.0f} µm, "
        f"most clearly in {CAMERA_CHANGES[best]}"
    )


def describe_lens(scores: Scores, camera: int) -> str:
    lens = scores.lenses[camera]
    best = N_MOTIONS + int(np.argmax(scores.axes[camera, N_MOTIONS:]))
    if _alone(scores, camera, best, lens):
        return _amount(best, float(scores.axis_sizes[camera, best]))
    texts = [_amount(N_MOTIONS + i, float(size)) for i, size in enumerate(lens.size)]
    return join_words(texts, "and")


def _alone(scores: Scores, camera: int, axis: int, change: PossibleChange) -> bool:
    return bool(scores.axes[camera, axis] >= min(_SHARE * change.score, change.score - _BY_CHANCE))


def describe_led(led: int, change: PossibleChange) -> str:
    far = 1e3 * float(np.linalg.norm(change.size))
    return (
        f"LED {led + 1} of the probe is {far:.0f} µm off its position: the probe is bent or loose."
    )


def describe_common(change: PossibleChange) -> str:
    """Return the sentence on nests displaced for all cameras."""
    turn = 1e6 * float(np.linalg.norm(change.size[:3]))
    shift = 1e3 * float(np.linalg.norm(change.size[3:]))
    return (
        f"The frame with all cameras, or the part with its nests, has moved by about {shift:.0f} "
        f"µm and {turn:.0f} µrad."
    )


def join_words(words: Sequence[str], last: str) -> str:
    """Return the words as a list with ``last`` before the last one."""
    return "".join(words) if len(words) < 2 else f"{', '.join(words[:-1])} {last} {words[-1]}"


def _amount(axis: int, size: float) -> str:
    text, scale, unit = _TEXTS[axis]
    value = abs(size) * scale
    return f"{text} {value:.3f} {unit}" if unit == "px" else f"{text} {value:.0f} {unit}"


_PLACES, _APART_MM = 5, 10.0
"""A good check needs this number of probe places with this distance."""

_DECISIVE = 12.0
"""Twice the logarithm of a likelihood ratio of 400: less likely alternatives are excluded."""


class ChangeCause(Enum):
    """Kind of change since the calibration."""

    NOTHING = "nothing"
    CAMERA = "camera"
    PROBE = "probe"
    COMMON = "common"
    """All cameras together, or the part with its nests."""
    UNKNOWN = "unknown"


LOOK_NS = 50_000_000
"""Bus time of one look."""
LOOKS = 40
EVERY = 10
"""`LOOKS`, `EVERY`: Number of latest looks examined together, at every so many new ones."""
SPARSE = 30
"""Every n-th look is kept for slow changes; ``LOOKS`` of them are examined together."""
FLOOR_PX = 0.0004
FALSE_ALARM = 1e-7
"""Probability of an alarm of one kind in one examination of an unchanged rig."""
GOOD = 0.01
"""A check with a chance probability above this is good."""
WORST_CHI2 = 2.0
"""Squared residuals per degree of freedom that indicate a fault of unknown kind."""
UNFIT_NS = 2_000_000_000
"""Bus time with visible spots that fit no pose, after which a fault is reported."""


@dataclass(frozen=True, slots=True)
class DriftReport:
    """Verdict of an examination on the calibration."""

    time_ns: int
    """Bus time of the last frame included."""
    cause: ChangeCause
    cameras: tuple[str, ...]
    """Names of possibly changed cameras, the likeliest first."""
    what: str
    """One sentence for people, or empty."""
    good: bool
    """Unchanged, with sufficient looks."""
    since_ns: int | None
    """Last bus time without a change; None if never checked."""
    scores: Scores | None
    """None if the spots fit no pose."""

    @property
    def alarm(self) -> bool:
        return self.cause is not ChangeCause.NOTHING


def examine(
    looks: Sequence[ResidualSample],
    rig: Rig,
    body: ProbeBody,
    belief: Belief,
    pixel_px: float = 0.0,
) -> DriftReport:
    """Return the verdict from looks (``since_ns`` open); the element if three have known tips.

    ``pixel_px``: error of spots fixed to the pixels.
    """
    scores = score_changes(list(looks), rig, body, belief, FLOOR_PX, pixel_px)
    cause, cameras, what = _judge(scores, rig)
    enough = len(looks) >= LOOKS // 2 and _places(looks) >= _PLACES
    calm = all(_chance(item) > GOOD for item in _changes(scores))
    return DriftReport(
        time_ns=max(look.last_ns for look in looks), cause=cause, cameras=cameras, what=what,
        good=cause is ChangeCause.NOTHING and enough and calm, since_ns=None, scores=scores,
    )  # fmt: skip


def _judge(scores: Scores, rig: Rig) -> tuple[ChangeCause, tuple[str, ...], str]:
    if min(_chance(item) for item in _changes(scores)) > FALSE_ALARM:
        if scores.chi2 > WORST_CHI2 * scores.dof:
            return (
                ChangeCause.UNKNOWN,
                (),
                "The spots fit the probe much worse than the calibration predicts; no single "
                "moved camera or LED explains it.",
            )
        return ChangeCause.NOTHING, (), ""
    motions = [_worth(item) for item in scores.motions]
    lenses = [_worth(item) for item in scores.lenses]
    leds = [_worth(item) for item in scores.leds]
    common = -np.inf if scores.common is None else _worth(scores.common)
    best = max(*motions, *lenses, *leds, common)
    if common == best:
        assert scores.common is not None  # noqa: S101 - it is the best one
        return ChangeCause.COMMON, (), describe_common(scores.common)
    if max(leds) == best:
        led = int(np.argmax(leds))
        return ChangeCause.PROBE, (), describe_led(led, scores.leds[led])
    # Looks from before and after the change fit no hypothesis well; small leads then mean less.
    misfit = max(1.0, (scores.chi2 - best) / scores.dof)
    decisive = _DECISIVE * misfit
    lens = max(lenses) > max(motions) + decisive
    worths = lenses if lens else motions
    order = sorted(range(len(worths)), key=lambda c: -worths[c])
    suspects = [c for c in order if worths[c] > worths[order[0]] - decisive]
    names = tuple(rig.cameras[c].name for c in suspects)
    who = join_words([f"camera {name}" for name in names], "or")
    how = describe_lens(scores, suspects[0]) if lens else describe_motion(scores, suspects[0])
    sentence = f"{who[0].upper()}{who[1:]} has changed since the calibration: {how}."
    return ChangeCause.CAMERA, names, sentence


def _changes(scores: Scores) -> tuple[PossibleChange, ...]:
    common = () if scores.common is None else (scores.common,)
    return (*scores.cameras, *scores.leds, *common)


def _chance(change: PossibleChange) -> float:
    return float(scipy.special.chdtrc(change.dof, change.score))


def _worth(change: PossibleChange) -> float:
    """Return the score less the chance gain of parameters (H. Akaike, IEEE TAC 19, 1974)."""
    return change.score - 2.0 * change.dof


def _places(looks: Sequence[ResidualSample]) -> int:
    """Return the number of probe places at least `_APART_MM` apart, up to `_PLACES`."""
    places: list[Float] = []
    for look in looks:
        if len(places) == _PLACES:
            break
        if all(np.linalg.norm(look.origin_world - place) > _APART_MM for place in places):
            places.append(look.origin_world)
    return len(places)
