"""Probe body: LEDs and ball in the probe frame, and its document.

LEDs and orientation rules in documents, with their checks, are common to all bodies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import MAX_LEDS, ThermalShare, Vector3
from ocmm_core.documents import Document, load_with_text, text_digest
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, unit
from ocmm_core.tracking._ambiguity import AMBIGUITY_LIMIT_MM as AMBIGUITY_LIMIT_MM
from ocmm_core.tracking._ambiguity import Ambiguity as Ambiguity
from ocmm_core.tracking._ambiguity import check_distinct as check_distinct
from ocmm_core.tracking._ambiguity import confused, nearest
from ocmm_core.tracking._strobe import StrobeCode, StrobeEntry, strobe_code

MIN_LEDS = 3

MIN_WIDTH_MM = 5.0
"""LEDs closer to one line (RMS) leave the rotation about it undetermined."""


class LedEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One LED: its place and the direction of its light, probe frame."""

    position: Vector3
    direction: Vector3


class OrientationRule(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An orientation constraint: a probe axis stays on one side of a world direction.

    ``probe_axis`` mapped to the world must have a positive component along ``world_direction``.
    """

    probe_axis: Vector3
    world_direction: Vector3


def check_leds(
    path: Path, what: str, leds: Sequence[LedEntry], rules: Sequence[tuple[str, Vector3]] = ()
) -> None:
    """Refuse too few or too many, coincident or collinear LEDs, and zero directions by InputError.

    ``what`` is ``"probe"`` or ``"reference"``; ``rules`` are directions by field.
    """
    count = len(leds)
    if not MIN_LEDS <= count <= MAX_LEDS:
        raise InputError(
            f"{what}.leds",
            f"{path}: field 'leds' of the {what} has {count} LED(s).",
            f"Give {MIN_LEDS} to {MAX_LEDS} LEDs.",
        )
    directions = [(f"leds[{i}].direction", led.direction) for i, led in enumerate(leds)]
    for field, direction in (*directions, *rules):
        if np.linalg.norm(direction) < 1e-9:
            raise InputError(
                f"{what}.direction",
                f"{path}: field '{field}' is a zero vector, which has no direction.",
                "Give the direction; the length is ignored.",
            )
    positions = np.array([led.position for led in leds])
    distances = np.linalg.norm(positions[:, None] - positions, axis=2) + 1e9 * np.eye(count)
    if distances.min() < 5.0:
        first, second = np.unravel_index(int(distances.argmin()), distances.shape)
        raise InputError(
            f"{what}.leds",
            f"{path}: leds[{min(first, second)}] and leds[{max(first, second)}] are "
            f"{distances.min():.2f} mm apart.",
            "Place LEDs at least 5 mm apart, so that each gives its own spot.",
        )
    # RMS distance of the LEDs from their best-fit line.
    spread = np.linalg.svd(positions - positions.mean(axis=0))[1]
    width = float(np.linalg.norm(spread[1:])) / np.sqrt(count)
    if width < MIN_WIDTH_MM:
        raise InputError(
            f"{what}.leds",
            f"{path}: the LEDs stand within {width:.2f} mm (RMS) of one line.",
            (
                f"Place them at least {MIN_WIDTH_MM:g} mm from it, or the rotation about it "
                "stays unknown."
            ),
        )


def rule_directions(rules: Sequence[OrientationRule]) -> list[tuple[str, Vector3]]:
    """Return the directions of orientation rules by field, for `check_leds`."""
    return [
        (f"orientation_rules[{index}].{name}", direction)
        for index, rule in enumerate(rules)
        for name, direction in (
            ("probe_axis", rule.probe_axis),
            ("world_direction", rule.world_direction),
        )
    ]


def unit_rules(rules: Sequence[OrientationRule]) -> tuple[tuple[Float, Float], ...]:
    """Return orientation rules as pairs of unit vectors, in the form of the bodies."""
    return tuple(
        (unit(np.array(rule.probe_axis)), unit(np.array(rule.world_direction))) for rule in rules
    )


SCHEMA = "ocmm.probe/1"
UNKNOWN_EXPANSION = (12e-6, 7e-6)
"""Expansion of an unknown material and its standard uncertainty, 1/K: evenly from none to 24e-6."""


class ProbeDocument(Document, frozen=True, kw_only=True):
    """Document of a probe; lengths in mm."""

    name: str
    tip: Vector3
    tip_diameter: float
    tip_diameter_sigma: float
    tip_sigma: Vector3
    led_sigma: float
    emission_half_angle_deg: float
    leds: list[LedEntry]
    orientation_rules: tuple[OrientationRule, ...] = ()
    strobe: StrobeEntry | None = None
    expansion: float | None = None
    expansion_sigma: float | None = None
    """`expansion`, `expansion_sigma`: of the whole probe, 1/K; without: `UNKNOWN_EXPANSION`."""


@dataclass(frozen=True, slots=True)
class LedBody:
    """Rigid set of LEDs: the identification data of a probe or reference body."""

    name: str
    leds_body: Float
    led_directions_body: Float
    """`leds_body`: (L, 3), mm, body frame; `led_directions_body`: (L, 3), unit."""
    emission_half_angle: float
    """rad; outside this cone an LED is not visible."""
    rules: tuple[tuple[Float, Float], ...] = ()
    """``(body_axis, world_direction)`` pairs, each (3,)."""
    code: StrobeCode | None = None
    """Strobe code of the LEDs; None if always lit."""

    @property
    def n_leds(self) -> int:
        return len(self.leds_body)


@dataclass(frozen=True, slots=True)
class ProbeBody:
    """A probe body with unambiguous labels."""

    name: str
    leds_probe: Float
    led_directions_probe: Float
    """`leds_probe`: (L, 3), mm, probe frame; `led_directions_probe`: (L, 3), unit."""
    emission_half_angle: float
    """rad; outside this cone an LED is not visible."""
    tip_probe: Float
    """(3,), mm, probe frame: ball centre."""
    tip_radius: float
    tip_radius_sigma: float
    """`tip_radius`: mm; `tip_radius_sigma`: mm, standard uncertainty."""
    geometry_covariance: Float
    """(3 L + 3, 3 L + 3), mm^2: LED coordinates, then the tip."""
    rules: tuple[tuple[Float, Float], ...]
    """``(probe_axis, world_direction)`` pairs, each (3,)."""
    identity: str
    code: StrobeCode | None = None
    """Strobe code of the LEDs; None if always lit."""
    expansion: tuple[float, float] = UNKNOWN_EXPANSION
    """Thermal expansion as a whole and its standard uncertainty, 1/K."""
    thermal: ThermalShare | None = None
    """Of the thermometer by which its geometry is compensated; None if it is not."""

    @property
    def n_leds(self) -> int:
        return len(self.leds_probe)

    @property
    def led_body(self) -> LedBody:
        return LedBody(
            self.name,
            self.leds_probe,
            self.led_directions_probe,
            self.emission_half_angle,
            self.rules,
            self.code,
        )


def load_probe(path: Path | str) -> ProbeBody:
    """Return the probe of the document at ``path``.

    InputError if it is malformed, has too few or too many LEDs, LEDs in one place or on one line, a
    tip diameter that is not positive, or labels that can be confused.
    """
    return read_probe(path)[0]


def read_probe(path: Path | str) -> tuple[ProbeBody, str]:
    """Return the probe of a document, and the text it was read from; InputError as `load_probe`."""
    document, text = load_with_text(path, ProbeDocument, SCHEMA)
    return body_of(document, path, text_digest(text)), text


def body_of(document: ProbeDocument, path: Path | str, identity: str) -> ProbeBody:
    """Return the probe of a document, perhaps not yet in a file; errors as `load_probe`.

    ``path`` is for error messages; ``identity`` is the SHA-256 of the file.
    """
    _check(Path(path), document)
    leds = np.array([led.position for led in document.leds])
    body = ProbeBody(
        name=document.name,
        leds_probe=leds,
        led_directions_probe=unit(np.array([led.direction for led in document.leds])),
        emission_half_angle=float(np.radians(document.emission_half_angle_deg)),
        tip_probe=np.array(document.tip),
        tip_radius=0.5 * document.tip_diameter,
        tip_radius_sigma=0.5 * document.tip_diameter_sigma,
        geometry_covariance=np.diag(
            np.concatenate(
                [np.full(leds.size, document.led_sigma**2), np.square(document.tip_sigma)]
            )
        ),
        rules=unit_rules(document.orientation_rules),
        identity=identity,
        code=strobe_code(Path(path), document.strobe, len(leds)),
        expansion=_expansion(Path(path), document),
    )
    check_labels(path, "probe", body)
    return body


def _expansion(path: Path, document: ProbeDocument) -> tuple[float, float]:
    """Return the expansion of a document; raise InputError if half given or implausible."""
    per_k, sigma = document.expansion, document.expansion_sigma
    if per_k is None and sigma is None:
        return UNKNOWN_EXPANSION
    if per_k is None or sigma is None or not abs(per_k) < 1e-4 or not 0.0 < sigma < 1e-4:
        raise InputError(
            "probe.expansion",
            f"{path}: 'expansion' is {per_k} and 'expansion_sigma' {sigma}.",
            "Give both in 1/K, e.g. 23.1e-6 and 1e-6 for aluminium, or neither.",
        )
    return per_k, sigma


def satisfies_rules(
    body: ProbeBody | LedBody, rotations_world_from_probe: Float
) -> NDArray[np.bool_]:
    """Return which attitudes (..., 3, 3) satisfy every orientation rule of the body, (...)."""
    kept = np.ones(rotations_world_from_probe.shape[:-2], dtype=np.bool_)
    for axis, world in body.rules:
        kept &= (rotations_world_from_probe @ axis) @ world > 0.0
    return kept


def nearest_ambiguity(
    body: ProbeBody | LedBody, seen: Sequence[int] | None = None
) -> Ambiguity | None:
    """Return the wrong labelling of the LEDs ``seen``, or all, of smallest residual.

    See `ambiguity.nearest`. For a body without a tip, the error is that of the middle of its LEDs.
    """
    return nearest(*_shape(body), seen)


def check_labels(path: Path | str, what: str, body: ProbeBody | LedBody) -> None:
    """Refuse a body with ambiguous labels; a strobe code makes all labels certain.

    ``what``: ``"probe"`` or ``"reference"``. InputError if labels are ambiguous with all LEDs
    visible, with one hidden, or for three.
    """
    if body.code is not None:
        return
    point = "tip" if isinstance(body, ProbeBody) else "body"
    remedy = "Move one LED by 10 mm, or add an orientation rule that excludes that order."
    worst = confused(*_shape(body), hidden=0)
    if worst is not None:
        raise InputError(
            f"{what}.ambiguous",
            f"{path}: LEDs taken in the order {worst.labels} fit the body to "
            f"{worst.residual_mm:.3f} mm and would put the {point} {worst.tip_error_mm:.1f} mm "
            "off.",
            remedy,
        )
    if body.n_leds == MIN_LEDS:
        raise InputError(
            f"{what}.leds",
            f"{path}: the {what} has {MIN_LEDS} LEDs, of which a reflection could be one.",
            "Add a fourth LED, or give the LEDs a strobe code.",
        )
    worst = confused(*_shape(body), hidden=1)
    if worst is not None:
        hidden = worst.labels.index(-1)
        raise InputError(
            f"{what}.ambiguous",
            f"{path}: with one LED hidden, LEDs taken in the order {worst.labels} (-1: LED "
            f"{hidden} is not seen) fit the body to {worst.residual_mm:.3f} mm and would put "
            f"the {point} {worst.tip_error_mm:.1f} mm off.",
            remedy,
        )


def _shape(body: ProbeBody | LedBody) -> tuple[Float, Float, tuple[tuple[Float, Float], ...]]:
    if isinstance(body, ProbeBody):
        return body.leds_probe, body.tip_probe, body.rules
    return body.leds_body, body.leds_body.mean(axis=0), body.rules


_MOST = {
    "led_sigma": 10.0, "tip_sigma": 100.0, "tip_diameter_sigma": 10.0,
    "emission_half_angle_deg": 180.0,
}  # fmt: skip
"""Largest plausible uncertainties, mm, and angle of light."""


def check_stated(path: Path, kind: str, document: Document) -> None:
    """Raise InputError unless stated uncertainties and the angle are above zero and plausible."""
    for field, most in _MOST.items():
        for value in np.atleast_1d(getattr(document, field, ())).tolist():
            if not 0.0 < value <= most:
                raise InputError(
                    f"{kind}.value",
                    f"{path}: field '{field}' is {value:g}, not above 0 and up to {most:g}.",
                    "Correct that field.",
                )


def _check(path: Path, document: ProbeDocument) -> None:
    check_leds(path, "probe", document.leds, rule_directions(document.orientation_rules))
    if not 0.0 < document.tip_diameter < 100.0:
        raise InputError(
            "probe.tip_diameter",
            f"{path}: field 'tip_diameter' is {document.tip_diameter} mm.",
            "Give the calibrated ball diameter in millimetres.",
        )
    check_stated(path, "probe", document)
    leds = np.array([led.position for led in document.leds])
    if float(np.linalg.norm(leds - np.array(document.tip), axis=1).max()) > 1000.0:
        raise InputError(
            "probe.size",
            f"{path}: an LED is more than 1 m from the tip.",
            "Check that the positions are in millimetres.",
        )
