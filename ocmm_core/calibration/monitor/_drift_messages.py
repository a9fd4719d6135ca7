"""Changes of cameras and probe in words for people."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.calibration.monitor._drift_design_matrix import CAMERA_CHANGES, N_MOTIONS
from ocmm_core.calibration.monitor._drift_statistic import PossibleChange, Scores

_SHARE, _BY_CHANCE = 0.9, 15.0
"""One axis is named alone where it explains this share of what all of them explain, or all but what
five more free numbers explain by chance in 99 of 100 cases."""

_TEXTS = (
    ("pitch about", 1e6, "µrad"), ("yaw about", 1e6, "µrad"), ("roll about", 1e6, "µrad"),
    ("moved sideways about", 1e3, "µm"), ("moved up or down about", 1e3, "µm"),
    ("moved along its view about", 1e3, "µm"), ("focal length changed about", 1e3, "µm"),
    ("image shifted sideways about", 1.0, "px"), ("image shifted up or down about", 1.0, "px"),
)  # fmt: skip


def describe_motion(scores: Scores, camera: int) -> str:
    """Return how a camera probably moved: about one axis where that explains it, else about all."""
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
    """Return what probably happened to the lens of a camera."""
    lens = scores.lenses[camera]
    best = N_MOTIONS + int(np.argmax(scores.axes[camera, N_MOTIONS:]))
    if _alone(scores, camera, best, lens):
        return _amount(best, float(scores.axis_sizes[camera, best]))
    texts = [_amount(N_MOTIONS + i, float(size)) for i, size in enumerate(lens.size)]
    return join_words(texts, "and")


def _alone(scores: Scores, camera: int, axis: int, change: PossibleChange) -> bool:
    return bool(scores.axes[camera, axis] >= min(_SHARE * change.score, change.score - _BY_CHANCE))


def describe_led(led: int, change: PossibleChange) -> str:
    """Return the sentence about an LED that left its place on the probe."""
    far = 1e3 * float(np.linalg.norm(change.size))
    return (
        f"LED {led + 1} of the probe is {far:.0f} µm off its position: the probe is bent or loose."
    )


def describe_common(change: PossibleChange) -> str:
    """Return the sentence about nests that stand elsewhere for all cameras."""
    turn = 1e6 * float(np.linalg.norm(change.size[:3]))
    shift = 1e3 * float(np.linalg.norm(change.size[3:]))
    return (
        f"The frame with all cameras, or the part with its nests, has moved by about {shift:.0f} "
        f"µm and {turn:.0f} µrad."
    )


def join_words(words: Sequence[str], last: str) -> str:
    """Return the words as a list with ``last`` before the last one."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"


def _amount(axis: int, size: float) -> str:
    text, scale, unit = _TEXTS[axis]
    value = abs(size) * scale
    return f"{text} {value:.3f} {unit}" if unit == "px" else f"{text} {value:.0f} {unit}"
