"""Compiled decision among all valid poses: selection and certainty."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.kernels._kernel import Bool

FOUND, FEW, NO_FIT, AMBIGUOUS, CONFUSED, THIN, NEAR_RULE = range(7)
"""Outcomes: labelled; fewer than three targets; no fit; several labellings fit; too many
candidates; too few LEDs for certainty; too close to the limit of an orientation rule.
"""

# Squared standard deviations of the pose: a single false LED may have moved it by up to seven of
# them, and the ball, carried by the pose, by at most as much. Beyond that a tip counts as wrong
# (`benchmarks.labels`): at nine, one of 1.2 million tips was.
MAX_DOUBT = 49.0
"""Largest ambiguity (`doubt_kernel.ambiguity_score`). Three LEDs may be two LEDs and a reflection
that matches by chance in one of some ten thousand such scenes; so every LED must be confirmed by
the others. Three identified by a strobe code suffice.
"""


@compiled()
def merge(poses: Int, start: int, held: int, certain: Bool, doubt: Float) -> int:
    """Keep the last pose unless already held; return the number held."""
    for pose in range(start, held):
        same, conflicts, more = 0, 0, 0
        for c in range(poses.shape[1]):
            for led in range(poses.shape[2]):
                one, other = poses[pose, c, led], poses[held, c, led]
                same += one >= 0 and one == other
                conflicts += one >= 0 and other >= 0 and one != other
                more += int(other >= 0) - int(one >= 0)
        # The same three LEDs at the same spots without contradiction: one pose grown from two
        # triples. The one that explains more spots is kept, with its own ambiguity.
        if conflicts == 0 and same >= 6:
            if more > 0:
                copy_labels(poses[held], poses[pose])
                certain[pose], doubt[pose] = certain[held], doubt[held]
            return held
    return held + 1


@compiled()
def decide(
    poses: Int, owner: Int, certain: Bool, doubt: Float, held: int, body: int, coded: bool,
    weak: int, status: NDArray[np.uint8], labels: Int,
) -> None:  # fmt: skip
    """Choose among all poses; write the status of ``body`` and its labels (C, 8).

    The best one must explain more than any other, of this body or of one that claims its spots, by
    more than one light in space could add; ``weak`` is the most explained by one not held.
    """
    n_cameras = poses.shape[1]
    best, most = -1, -1
    for pose in range(held):
        if owner[pose] == body and spots_of(poses[pose]) > most:
            best, most = pose, spots_of(poses[pose])
    # Poses with too few LEDs to be held may still explain as much.
    if weak > 0 and weak >= most - n_cameras:
        status[body] = AMBIGUOUS
        return
    for pose in range(held):
        # A single light in space gives at most one spot in every camera, so n_cameras additional
        # spots can be due to one reflection. A rival close in number makes the result ambiguous.
        if pose == best or spots_of(poses[pose]) < most - n_cameras:
            continue
        if owner[pose] == body or _share(poses[best], poses[pose]):
            status[body] = AMBIGUOUS
            return
    # A strobe code identifies each LED; three LEDs with it need no fourth for confirmation.
    if doubt[best] > MAX_DOUBT and not (coded and in_sight(poses[best]) == 3):
        status[body] = THIN
    elif not certain[best]:
        status[body] = NEAR_RULE
    else:
        copy_labels(poses[best], labels)


@compiled()
def in_sight(labels: Int) -> int:
    """Return the number of labelled LEDs."""
    count = 0
    for led in range(labels.shape[1]):
        seen = False
        for c in range(labels.shape[0]):
            seen = seen or labels[c, led] >= 0
        count += int(seen)
    return count


@compiled()
def clear(labels: Int) -> None:
    """Mark all LEDs as unlabelled."""
    for c in range(labels.shape[0]):
        for led in range(labels.shape[1]):
            labels[c, led] = -1


@compiled()
def copy_labels(labels: Int, to: Int) -> None:
    """Copy labels to an array for as many LEDs or more."""
    for c in range(labels.shape[0]):
        for led in range(labels.shape[1]):
            to[c, led] = labels[c, led]


@compiled()
def spots_of(labels: Int) -> int:
    """Return the number of labelled spots."""
    count = 0
    for c in range(labels.shape[0]):
        for led in range(labels.shape[1]):
            count += int(labels[c, led] >= 0)
    return count


@compiled()
def _share(one: Int, other: Int) -> bool:
    for c in range(one.shape[0]):
        for led in range(one.shape[1]):
            for second in range(other.shape[1]):
                # A slot claimed by both poses, for any LED.
                if one[c, led] >= 0 and one[c, led] == other[c, second]:
                    return True
    return False
