"""The steps of qualification and quick check: what to do in each."""

from __future__ import annotations

from ocmm_core.calibration.guided import OPEN, Gate, Step
from ocmm_core.calibration.tip._state import TouchState

PREPARE, SPHERE, CONE, RESULT = "prepare", "sphere", "cone", "result"
TAKING = (SPHERE, CONE)
"""Steps in which observations are taken."""


def steps_of(state: TouchState, on_sphere: Gate, in_cone: Gate) -> tuple[Step, ...]:
    """Return the steps; the gates out of those in which observations are taken are given."""
    use, next_words = state.begun.sphere.artefact.use, state.next_words()
    attitude = state.cone.next_attitude
    hold = "more" if attitude is None else state.cone.attitudes[attitude].name
    return (
        Step(
            PREPARE,
            "Prepare",
            f"Clamp sphere '{use.name}' (serial {use.serial}) and a cone where the cameras see "
            f"them well; clean sphere, cone and ball. Tip '{state.begun.tip}' must be mounted.",
            OPEN,
        ),
        Step(
            SPHERE,
            "Sphere",
            f"Touch the sphere {next_words}." if next_words else "Enough points on the sphere.",
            on_sphere,
            len(state.on_sphere),
            state.wanted.points,
        ),
        Step(
            CONE,
            "Cone",
            f"Put the ball into the cone and hold the probe {hold}."
            if not in_cone.open
            else "Enough attitudes taken.",
            in_cone,
            len(state.in_cone),
            len(state.wanted.attitudes.names),
        ),
        Step(
            RESULT,
            "Result",
            "Review the result and store it.",
            Gate(False, "This is the last step.", "Store the result."),
        ),
    )
