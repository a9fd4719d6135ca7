"""The steps of a pivot calibration: what to do in each, and what its gate waits for."""

from __future__ import annotations

import numpy as np

from ocmm_core.calibration.guided import OPEN, Gate, Step
from ocmm_core.calibration.pivot import OTHER_ATTITUDE, OTHER_PLACE_MM, attitude_between
from ocmm_core.calibration.sweeping._progress import SweepProgress
from ocmm_core.calibration.sweeping._session import (
    AGAIN,
    FIRST,
    PREPARE,
    RESULT,
    SECOND,
    PivotBegun,
)


def steps_of(
    begun: PivotBegun,
    poses: tuple[int, int],
    gates: tuple[Gate, Gate],
    again: Gate,
    *,
    visited: bool,
) -> tuple[Step, ...]:
    """Return the steps with their gates, as things are.

    Parameters
    ----------
    poses, gates
        Of both sweeps.
    again, visited
        Gate of the visit of the first cone at the end, and whether it was taken.
    """
    cone = "the cone" if begun.cone is None else f"cone '{begun.cone.name}'"
    return (
        Step(
            PREPARE,
            "Prepare",
            f"Clamp {cone} where all cameras see it well, and clean it. Tighten tip "
            f"'{begun.tip}' on probe '{begun.probe}' and clean its ball.",
            OPEN,
        ),
        Step(
            FIRST,
            "First sweep",
            "Put the ball into the cone and sweep the probe to all sides, 20 degrees or more, "
            "along different paths; turn it about its handle too.",
            gates[0],
            poses[0],
            begun.poses_wanted,
        ),
        Step(
            SECOND,
            "Second sweep",
            "Leave the first cone in place. Sweep again in another one, 30 mm or more away, or "
            "in the same one with the probe leaning another way: the tip must be the same.",
            gates[1],
            poses[1],
            begun.poses_wanted,
        ),
        Step(
            AGAIN,
            "First cone again",
            "Put the ball back into the first cone and hold the probe still, as at the start."
            if begun.again
            else "Nothing to do: the recording has no such visit.",
            again,
            int(visited),
            int(begun.again or False),
        ),
        Step(
            RESULT,
            "Result",
            "Review the tip, the changes and the second sweep, then accept the new calibration "
            "or keep the old one.",
            Gate(
                False, "This is the last step.", "Accept the new calibration, or keep the old one."
            ),
        ),
    )


def apart(first: SweepProgress, second: SweepProgress) -> tuple[float, float]:
    """Return how far two sweeps are apart: places of the ball, mm, and attitudes, rad."""
    if first.coverage is None or second.coverage is None:
        return np.nan, np.nan
    place = float(np.linalg.norm(second.centre_world - first.centre_world))
    return place, attitude_between(
        first.coverage.directions_world, second.coverage.directions_world
    )


def second_gate(gate: Gate, first: SweepProgress, second: SweepProgress) -> Gate:
    """Return the gate out of the second sweep, which must be another one than the first."""
    if not gate.open:
        return gate
    place, attitude = apart(first, second)
    if place < OTHER_PLACE_MM and attitude < OTHER_ATTITUDE:
        return Gate(
            False,
            f"The second sweep is only {place:.0f} mm and {np.degrees(attitude):.0f} degrees "
            "from the first: it would repeat the first one's errors.",
            "Repeat it in another cone, 30 mm or more away, or with the probe leaning 15 "
            "degrees another way; leave the first cone in place.",
        )
    return gate
