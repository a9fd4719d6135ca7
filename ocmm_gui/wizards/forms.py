"""What the wizards are called, what they are for, and what is filled in before they begin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ocmm_core.calibration.procedure import Kind
from ocmm_core.documents import resource


@dataclass(frozen=True, slots=True)
class Field:
    """One thing to be filled in before a session begins.

    Attributes
    ----------
    key
        Stable name.
    label, tip
        For people.
    proposal
        What stands there at first.
    choices
        Values with their words, where only these are possible; the first one is proposed.
    """

    key: str
    label: str
    tip: str
    proposal: str = ""
    choices: tuple[tuple[str, str], ...] = ()


TITLES = {
    Kind.KNOWN_POINTS: "Calibrate cameras",
    Kind.RELOCATION: "Relocate",
    Kind.VERIFICATION: "Verify",
}

PURPOSES = {
    Kind.KNOWN_POINTS: "A machine that knows its position brings one bright target to every point "
    "of a list, through the whole depth of the volume. From what the cameras see there follow "
    "their lenses and where they stand.",
    Kind.RELOCATION: "After the frame or a camera was moved: wave the probe through the volume, "
    "show the length bar, touch the control points. No measuring machine is needed.",
    Kind.VERIFICATION: "An independent check: put the ball into the nests of a certified length "
    "bar along seven lines, and touch a certified sphere. Only a calibration that passed may be "
    "used.",
}

WHO = Field("who", "Done by", "Your name; it goes into the record")
_WARMTH = Field(
    "temperature", "Temperature, °C", "Of the room; leave it empty if nobody measured it", ""
)
_BAR = Field(
    "bar", "Length bar", "Its document with the certificate", str(resource("artefacts", "bar.toml"))
)

FIELDS: Mapping[Kind, tuple[Field, ...]] = {
    Kind.KNOWN_POINTS: (
        WHO,
        _WARMTH,
        Field("points", "Reference points", "The list of positions: unit, uncertainty, points"),
    ),
    Kind.RELOCATION: (
        WHO,
        _WARMTH,
        _BAR,
        Field(
            "world", "World frame", "What the coordinates refer to afterwards",
            choices=(
                ("cameras", "stays with the cameras"),
                ("points", "kept by known control points"),
                ("set", "set anew by three points"),
            ),
        ),
        Field("control", "Control points", "Their list, if the world is kept by known points"),
        Field(
            "lens", "Lenses", "What happens to the lenses",
            choices=(
                ("prior", "refined from what is known"),
                ("fixed", "kept as they are"),
                ("free", "found anew"),
            ),
        ),
        Field(
            "geometry", "Probe", "How the LEDs of the probe are known",
            choices=(
                ("uncertain", "known to its uncertainty"),
                ("known", "known exactly"),
                ("unknown", "not known: the bar alone gives the scale"),
            ),
        ),
    ),
    Kind.VERIFICATION: (
        WHO,
        _WARMTH,
        _BAR,
        Field(
            "sphere", "Sphere", "Its document; leave it empty for none",
            str(resource("artefacts", "sphere.toml")),
        ),
    ),
}  # fmt: skip
