"""The probe body: LEDs and ball in the probe frame, and the document that describes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, permutations
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera.rig import MAX_SLOTS, Vector3
from ocmm_core.documents import Document, digest, load_document
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, unit

SCHEMA = "ocmm.probe/1"
MIN_LEDS = 3
AMBIGUITY_LIMIT_MM = 1.0
"""A wrong labelling must leave at least this rigid residual (RMS), or the labels are in doubt."""

MIN_WIDTH_MM = 5.0
"""LEDs nearer to one line than this (RMS) leave the turn about it open."""


class LedEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One LED: its place and the direction of its light, probe frame."""

    position: Vector3
    direction: Vector3


class OrientationRule(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A promise of how the probe is held: an axis of it stays on one side of a world direction.

    ``probe_axis`` mapped to the world must have a positive component along ``world_direction``.
    """

    probe_axis: Vector3
    world_direction: Vector3


class ProbeDocument(Document, frozen=True, kw_only=True):
    """A probe as it is written down; lengths in mm."""

    name: str
    tip: Vector3
    tip_diameter: float
    tip_diameter_sigma: float
    tip_sigma: Vector3
    led_sigma: float
    emission_half_angle_deg: float
    leds: list[LedEntry]
    orientation_rules: tuple[OrientationRule, ...] = ()


@dataclass(frozen=True, slots=True)
class LedBody:
    """LEDs that move as one: all that identification knows of a probe or of a reference body.

    Attributes
    ----------
    name
        Name of the body.
    leds_body
        (L, 3), mm, body frame.
    led_directions_body
        (L, 3), unit.
    emission_half_angle
        rad; outside this cone an LED is not seen.
    rules
        ``(body_axis, world_direction)`` pairs, each (3,).
    """

    name: str
    leds_body: Float
    led_directions_body: Float
    emission_half_angle: float
    rules: tuple[tuple[Float, Float], ...] = ()

    @property
    def n_leds(self) -> int:
        """Return the number of LEDs."""
        return len(self.leds_body)


@dataclass(frozen=True, slots=True)
class ProbeBody:
    """A probe body with labels that cannot be confused.

    Attributes
    ----------
    name
        Name of the probe.
    leds_probe
        (L, 3), mm, probe frame.
    led_directions_probe
        (L, 3), unit.
    emission_half_angle
        rad; outside this cone an LED is not seen.
    tip_probe
        (3,), mm, probe frame: ball centre.
    tip_radius
        mm.
    tip_radius_sigma
        mm, standard uncertainty.
    geometry_covariance
        (3 L + 3, 3 L + 3), mm^2: LED coordinates, then the tip.
    rules
        ``(probe_axis, world_direction)`` pairs, each (3,).
    identity
        SHA-256 of the document.
    """

    name: str
    leds_probe: Float
    led_directions_probe: Float
    emission_half_angle: float
    tip_probe: Float
    tip_radius: float
    tip_radius_sigma: float
    geometry_covariance: Float
    rules: tuple[tuple[Float, Float], ...]
    identity: str

    @property
    def n_leds(self) -> int:
        """Return the number of LEDs."""
        return len(self.leds_probe)

    @property
    def led_body(self) -> LedBody:
        """Return the LEDs without the tip."""
        return LedBody(
            self.name,
            self.leds_probe,
            self.led_directions_probe,
            self.emission_half_angle,
            self.rules,
        )


@dataclass(frozen=True, slots=True)
class Ambiguity:
    """A wrong labelling that fits the body nearly as well as the right one.

    Attributes
    ----------
    labels
        LED number that stands at the place of LED 0, 1, 2 ...
    residual_mm
        RMS distance of the LEDs after the best rigid motion.
    tip_error_mm
        How far the tip would be wrong.
    """

    labels: tuple[int, ...]
    residual_mm: float
    tip_error_mm: float


def load_probe(path: Path | str) -> ProbeBody:
    """Return the probe of the document at ``path``.

    Raises
    ------
    InputError
        The document is malformed, has too few or too many LEDs, LEDs in one place or on one line,
        a tip diameter that is not positive, or labels that can be confused.
    """
    return body_of(load_document(path, ProbeDocument, SCHEMA), path, digest(path))


def body_of(document: ProbeDocument, path: Path | str, identity: str) -> ProbeBody:
    """Return the probe of a document; see `load_probe`.

    Parameters
    ----------
    document
        Also one that is not in a file yet.
    path
        Of its file; named in errors.
    identity
        SHA-256 of the file.

    Raises
    ------
    InputError
        As `load_probe`.
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
    )
    worst = nearest_ambiguity(body)
    if worst is not None and worst.residual_mm < AMBIGUITY_LIMIT_MM:
        raise InputError(
            "probe.ambiguous",
            f"{path}: LEDs taken in the order {worst.labels} fit the body to "
            f"{worst.residual_mm:.3f} mm and would put the tip {worst.tip_error_mm:.1f} mm off.",
            "Move one LED by 10 mm, or add an orientation rule that excludes that order.",
        )
    return body


def rigid_fit(reference: Float, measured: Float) -> tuple[Float, Float]:
    """Return rotation (3, 3) and translation (3,) that take ``reference`` to ``measured``.

    Orthogonal Procrustes (thesis 1.3.2) with the determinant, so that it never is a reflection.
    Both arrays are (n, 3).
    """
    a, b = reference.mean(axis=0), measured.mean(axis=0)
    u, _, vt = np.linalg.svd((measured - b).T @ (reference - a))
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation: Float = u @ sign @ vt
    return rotation, b - rotation @ a


def satisfies_rules(
    body: ProbeBody | LedBody, rotations_world_from_probe: Float
) -> NDArray[np.bool_]:
    """Return which attitudes (..., 3, 3) keep every orientation rule of the body, (...)."""
    kept = np.ones(rotations_world_from_probe.shape[:-2], dtype=np.bool_)
    for axis, world in body.rules:
        kept &= (rotations_world_from_probe @ axis) @ world > 0.0
    return kept


def nearest_ambiguity(body: ProbeBody | LedBody) -> Ambiguity | None:
    """Return the wrong labelling with the smallest rigid residual that the rules do not exclude.

    Where the body has no tip, the error is that of the middle of its LEDs. A rule excludes a
    labelling if the body, turned by that labelling's motion, breaks the rule in every attitude that
    keeps it; that is so when the motion reverses the rule's axis.
    """
    worst: Ambiguity | None = None
    leds = body.leds_probe if isinstance(body, ProbeBody) else body.leds_body
    tip = body.tip_probe if isinstance(body, ProbeBody) else leds.mean(axis=0)
    identity = tuple(range(body.n_leds))
    distances = np.linalg.norm(leds[:, None] - leds[None], axis=2)
    for labels in permutations(identity):
        if labels == identity:
            continue
        spread = np.abs(distances[np.ix_(labels, labels)] - distances).max()
        # A rigid residual of r (RMS) changes no distance by more than 2 r sqrt(n), n at most 8.
        if worst is not None and spread > 6.0 * worst.residual_mm + 1e-9:
            continue
        rotation, translation = rigid_fit(leds, leds[list(labels)])
        if any(float(axis @ rotation @ axis) < -0.99 for axis, _ in body.rules):
            continue
        miss = leds @ rotation.T + translation - leds[list(labels)]
        residual = float(np.sqrt(np.mean(np.sum(miss**2, axis=1))))
        if worst is None or residual < worst.residual_mm:
            moved = rotation @ tip + translation
            worst = Ambiguity(labels, residual, float(np.linalg.norm(moved - tip)))
    return worst


def check_distinct(bodies: Sequence[LedBody]) -> None:
    """Refuse bodies of which three LEDs of one look like three LEDs of another.

    Raises
    ------
    InputError
        Two of the bodies could be taken for each other where some of their LEDs are hidden.
    """
    for one, other in combinations(bodies, 2):
        mine, theirs = _distances(one.leds_body), _distances(other.leds_body)
        for leds in combinations(range(one.n_leds), MIN_LEDS):
            for alike in permutations(range(other.n_leds), MIN_LEDS):
                spread = np.abs(mine[np.ix_(leds, leds)] - theirs[np.ix_(alike, alike)]).max()
                if spread < AMBIGUITY_LIMIT_MM:
                    raise InputError(
                        "bodies.alike",
                        f"LEDs {leds} of '{one.name}' look like LEDs {alike} of '{other.name}': "
                        f"their distances agree to {spread:.2f} mm.",
                        "Use another reference body, or move one of these LEDs by 5 mm.",
                    )


def _distances(leds: Float) -> Float:
    between: Float = np.linalg.norm(leds[:, None] - leds[None], axis=2)
    return between


def check_leds(
    path: Path, what: str, leds: Sequence[LedEntry], rules: Sequence[tuple[str, Vector3]] = ()
) -> None:
    """Refuse LEDs of which no body can be made.

    Parameters
    ----------
    path, what
        The document and what it describes, ``"probe"`` or ``"reference"``.
    leds
        As written down.
    rules
        Directions of orientation rules by field.

    Raises
    ------
    InputError
        They are too few or too many, in one place, on one line, or a direction is a zero vector.
    """
    count = len(leds)
    if not MIN_LEDS <= count <= MAX_SLOTS:
        raise InputError(
            f"{what}.leds",
            f"{path}: the {what} has {count} LED(s).",
            f"Give {MIN_LEDS} to {MAX_SLOTS} LEDs.",
        )
    directions = [(f"leds[{i}].direction", led.direction) for i, led in enumerate(leds)]
    for field, direction in (*directions, *rules):
        if np.linalg.norm(direction) < 1e-9:
            raise InputError(
                f"{what}.direction",
                f"{path}: field '{field}' is a zero vector, which has no direction.",
                "Give the direction; its length does not matter.",
            )
    positions = np.array([led.position for led in leds])
    distances = _distances(positions) + 1e9 * np.eye(count)
    if distances.min() < 5.0:
        first, second = np.unravel_index(int(distances.argmin()), distances.shape)
        raise InputError(
            f"{what}.leds",
            f"{path}: leds[{min(first, second)}] and leds[{max(first, second)}] are "
            f"{distances.min():.2f} mm apart.",
            "Place LEDs at least 5 mm apart, so that each gives its own spot.",
        )
    # RMS distance of the LEDs from the line that fits them best.
    spread = np.linalg.svd(positions - positions.mean(axis=0))[1]
    width = float(np.linalg.norm(spread[1:])) / np.sqrt(count)
    if width < MIN_WIDTH_MM:
        raise InputError(
            f"{what}.leds",
            f"{path}: the LEDs stand within {width:.2f} mm (RMS) of one line.",
            f"Place them at least {MIN_WIDTH_MM:g} mm from it, or the turn about it stays unknown.",
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
    """Return orientation rules as pairs of unit vectors, as the bodies hold them."""
    return tuple(
        (unit(np.array(rule.probe_axis)), unit(np.array(rule.world_direction))) for rule in rules
    )


def _check(path: Path, document: ProbeDocument) -> None:
    check_leds(path, "probe", document.leds, rule_directions(document.orientation_rules))
    if not 0.0 < document.tip_diameter < 100.0:
        raise InputError(
            "probe.tip_diameter",
            f"{path}: field 'tip_diameter' is {document.tip_diameter} mm.",
            "Give the calibrated ball diameter in millimetres.",
        )
    leds = np.array([led.position for led in document.leds])
    if float(np.linalg.norm(leds - np.array(document.tip), axis=1).max()) > 1000.0:
        raise InputError(
            "probe.size",
            f"{path}: an LED is more than 1 m from the tip.",
            "Check that the positions are in millimetres.",
        )
