"""What is filled in before a session of a wizard begins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ocmm_core.calibration.guided import Kind
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


WHO = Field("who", "Done by", "Your name; it goes into the record")
TEMPERATURE = Field(
    "temperature", "Temperature, °C", "Of the room; leave it empty if nobody measured it", ""
)
_BAR = Field(
    "bar", "Length bar", "Its document with the certificate", str(resource("artefacts", "bar.toml"))
)

FIELDS: Mapping[Kind, tuple[Field, ...]] = {
    Kind.KNOWN_POINTS: (
        WHO,
        TEMPERATURE,
        Field("points", "Reference points", "The list of positions: unit, uncertainty, points"),
    ),
    Kind.RELOCATION: (
        WHO,
        TEMPERATURE,
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
        TEMPERATURE,
        Field(
            "bar", "Length bar", "Not the one that the cameras were calibrated with",
            str(resource("artefacts", "verification_bar.toml")),
        ),
        Field(
            "sphere", "Sphere", "Its document; leave it empty for none",
            str(resource("artefacts", "sphere.toml")),
        ),
        Field(
            "places", "Sphere in", "How many places of the volume",
            choices=(("one", "one place"), ("two", "near and far third")),
        ),
    ),
}  # fmt: skip
