"""What the wizards are called, what they are for, and what they say when they end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ocmm_core.calibration.guided import Kind


@dataclass(frozen=True, slots=True)
class KindTexts:
    """The words of one wizard.

    Attributes
    ----------
    title, purpose
        A few words, and what it is for.
    accept, keep
        On the buttons that end it.
    accepts, keeps
        What is asked before it ends.
    accepted
        What is so after the result was accepted.
    """

    title: str
    purpose: str
    accept: str
    keep: str
    accepts: str
    keeps: str
    accepted: str


_NEW, _OLD = "Accept the new", "Keep the old"
_IN_FORCE, _AS_IT_WAS = "Put this calibration in force?", "End, and keep the old calibration?"
_STORE, _DISCARD = "Store the verdict", "Discard"
_STORES, _DISCARDS = "Store this verdict?", "End without a verdict?"
_VERIFY = (
    "The new calibration is in force. Verify it: until then it is SUSPECT and no points are taken."
)

TEXTS: Mapping[Kind, KindTexts] = {
    Kind.KNOWN_POINTS: KindTexts(
        "Calibrate cameras",
        "A machine that knows its position brings one bright target to every point of a list, "
        "through the whole depth of the volume. From what the cameras see there follow their "
        "lenses and where they stand.",
        _NEW, _OLD, _IN_FORCE, _AS_IT_WAS, _VERIFY,
    ),
    Kind.RELOCATION: KindTexts(
        "Relocate",
        "After the frame or a camera was moved: visit two seats, wave the probe through the "
        "volume, show the length bar, touch the control points, and visit the seats again. No "
        "measuring machine is needed.",
        _NEW, _OLD, _IN_FORCE, _AS_IT_WAS, _VERIFY,
    ),
    Kind.VERIFICATION: KindTexts(
        "Verify",
        "An independent check: visit two seats, put the ball into the nests of a certified length "
        "bar along seven lines, touch a certified sphere, and visit the seats again. Only a "
        "calibration that passed may be used.",
        _STORE, _DISCARD, _STORES, _DISCARDS, "The verdict is stored.",
    ),
    Kind.PIVOT: KindTexts(
        "Calibrate probe",
        "Rest the ball in a cone and sweep the probe about it, then once more in another cone or "
        "leaning another way, and come back to the first cone. From the sweeps follow where the "
        "tip is and where the LEDs stand.",
        _NEW, _OLD, _IN_FORCE, _AS_IT_WAS,
        "The new calibration of the probe is in force. Qualify the tip: until then it is SUSPECT "
        "and no points are taken.",
    ),
    Kind.QUALIFICATION: KindTexts(
        "Qualify tip",
        "Touch a certified sphere all around, then rest the ball in a cone in five attitudes. From "
        "that follow the diameter of the ball, its form, and whether the tip stays where it is.",
        _STORE, _DISCARD, _STORES, _DISCARDS, "The verdict on the tip is stored.",
    ),
    Kind.TIP_CHECK: KindTexts(
        "Check tip",
        "One minute on the sphere and in the cone: is the tip on the probe still the one that was "
        "qualified?",
        _STORE, _DISCARD, _STORES, _DISCARDS, "The verdict on the tip is stored.",
    ),
}  # fmt: skip
