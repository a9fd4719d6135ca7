"""Reference body: LEDs fixed on the part or its table, and its document."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ocmm_core.camera import MAX_LEDS
from ocmm_core.documents import Document, digest, load_document, read_text
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, unit
from ocmm_core.tracking._ambiguity import check_distinct
from ocmm_core.tracking._body import (
    LedBody,
    LedEntry,
    OrientationRule,
    ProbeBody,
    check_labels,
    check_leds,
    check_stated,
    rule_directions,
    unit_rules,
)
from ocmm_core.tracking._strobe import StrobeEntry, strobe_code

SCHEMA = "ocmm.reference/1"


class ReferenceDocument(Document, frozen=True, kw_only=True):
    """Document of a reference body; lengths in mm, reference frame."""

    name: str
    led_sigma: float
    emission_half_angle_deg: float
    leds: list[LedEntry]
    orientation_rules: tuple[OrientationRule, ...] = ()
    strobe: StrobeEntry | None = None


@dataclass(frozen=True, slots=True)
class ReferenceBody:
    """A reference body with unambiguous labels."""

    leds: LedBody
    """Its body frame is the reference frame."""
    geometry_covariance: Float
    """(3 R, 3 R), mm^2: LED coordinates."""
    text: str
    """The document, for the job file."""
    identity: str

    @property
    def name(self) -> str:
        return self.leds.name

    @property
    def label(self) -> str:
        """Return name and shortened hash, for reports; pure ASCII, no commas."""
        kept = (sign if sign.isascii() and sign.isprintable() else "?" for sign in self.name)
        return f"{''.join(kept).replace(',', ' ')} {self.identity[:12]}"

    @property
    def n_leds(self) -> int:
        return self.leds.n_leds

    @property
    def middle(self) -> Float:
        """Return the middle of its LEDs (3,), mm, reference frame."""
        middle: Float = self.leds.leds_body.mean(axis=0)
        return middle


def load_reference(path: Path | str) -> ReferenceBody:
    """Return the reference body of the document at ``path``.

    InputError if malformed, or LEDs are too few, too many, in one place, in line or confusable.
    """
    path = Path(path)
    document = load_document(path, ReferenceDocument, SCHEMA)
    check_leds(path, "reference", document.leds, rule_directions(document.orientation_rules))
    check_stated(path, "reference", document)
    positions = np.array([led.position for led in document.leds])
    leds = LedBody(
        name=document.name,
        leds_body=positions,
        led_directions_body=unit(np.array([led.direction for led in document.leds])),
        emission_half_angle=float(np.radians(document.emission_half_angle_deg)),
        rules=unit_rules(document.orientation_rules),
        code=strobe_code(path, document.strobe, len(document.leds)),
    )
    check_labels(path, "reference", leds)
    return ReferenceBody(
        leds=leds,
        geometry_covariance=document.led_sigma**2 * np.eye(positions.size),
        text=read_text(path),
        identity=digest(path),
    )


def check_together(probe: ProbeBody, reference: ReferenceBody) -> None:
    """Refuse a probe and a reference body that are confusable in the same images.

    InputError if they have more LEDs than a camera follows, or three LEDs of both look alike.
    """
    count = probe.n_leds + reference.n_leds
    if count > MAX_LEDS:
        raise InputError(
            "reference.slots",
            f"The probe '{probe.name}' has {probe.n_leds} LEDs and the reference body "
            f"'{reference.name}' has {reference.n_leds}: OCMM follows {MAX_LEDS}, not "
            f"{count}.",
            f"Choose a probe or a reference body with fewer LEDs, together at most {MAX_LEDS}.",
        )
    check_distinct((probe.led_body, reference.leds))
