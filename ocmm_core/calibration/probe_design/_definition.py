"""Definition of a new probe: its document as text, its check, and its file."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ocmm_core import tracking
from ocmm_core.calibration.probe_design._layout import WrongLabels, wrong_labels
from ocmm_core.documents import load_document, text_digest, write_atomic
from ocmm_core.errors import InputError, StorageError
from ocmm_core.geometry import triple


@dataclass(frozen=True, slots=True)
class DefinitionCheck:
    """Check of a usable definition."""

    body: tracking.ProbeBody
    labels: tuple[WrongLabels, ...]
    """The nearest wrong labelling with all LEDs, and with each of them hidden."""

    @property
    def nearest_hidden(self) -> WrongLabels | None:
        """Return the nearest wrong labelling with one LED hidden, or None."""
        found = [one for one in self.labels if one.hidden and one.ambiguity is not None]
        return min(
            found,
            key=lambda one: np.inf if one.ambiguity is None else one.ambiguity.residual_mm,
            default=None,
        )


def probe_text(document: tracking.ProbeDocument) -> str:
    """Return a document as TOML; numbers keep all their digits."""
    lines = [
        f"schema = {_text(tracking.SCHEMA)}",
        'unit = "mm"',
        f"name = {_text(document.name)}",
        f"tip = {_vector(document.tip)}",
        f"tip_diameter = {_number(document.tip_diameter)}",
        f"tip_diameter_sigma = {_number(document.tip_diameter_sigma)}",
        f"tip_sigma = {_vector(document.tip_sigma)}",
        f"led_sigma = {_number(document.led_sigma)}",
        f"emission_half_angle_deg = {_number(document.emission_half_angle_deg)}",
    ]
    for led in document.leds:
        position, direction = _vector(led.position), _vector(led.direction)
        lines += ["", "[[leds]]", f"position = {position}", f"direction = {direction}"]
    for rule in document.orientation_rules:
        axis, world = _vector(rule.probe_axis), _vector(rule.world_direction)
        lines += ["", "[[orientation_rules]]", f"probe_axis = {axis}", f"world_direction = {world}"]
    if document.strobe is not None:
        dark = ", ".join(str(frame) for frame in document.strobe.dark)
        lines += ["", "[strobe]", f"period = {document.strobe.period}", f"dark = [{dark}]"]
    return "\n".join([*lines, ""])


def read_definition(path: Path) -> tracking.ProbeDocument:
    """Return a document as template, maybe unusable; InputError if missing or malformed."""
    return load_document(path, tracking.ProbeDocument, tracking.SCHEMA)


def definition_of(body: tracking.ProbeBody) -> tracking.ProbeDocument:
    """Return the document of a probe, as a template for another one."""
    sigmas = np.sqrt(np.diag(body.geometry_covariance))
    return tracking.ProbeDocument(
        schema=tracking.SCHEMA,
        unit="mm",
        name=body.name,
        tip=triple(body.tip_probe),
        tip_diameter=2.0 * body.tip_radius,
        tip_diameter_sigma=2.0 * body.tip_radius_sigma,
        tip_sigma=triple(sigmas[-3:]),
        led_sigma=float(sigmas[:-3].max()),
        emission_half_angle_deg=float(np.degrees(body.emission_half_angle)),
        leds=[
            tracking.LedEntry(position=triple(led), direction=triple(direction))
            for led, direction in zip(body.leds_probe, body.led_directions_probe, strict=True)
        ],
        orientation_rules=tuple(
            tracking.OrientationRule(probe_axis=triple(axis), world_direction=triple(world))
            for axis, world in body.rules
        ),
        strobe=None
        if body.code is None
        else tracking.StrobeEntry(
            period=body.code.period, dark=[int(one) for one in body.code.dark]
        ),
    )


def examine(
    document: tracking.ProbeDocument, path: Path, tell: Callable[[str, float], None]
) -> DefinitionCheck:
    """Return the check of a definition; InputError if unusable. Eight LEDs take some seconds.

    ``tell`` is called with the name of the next check, and the share that is done.
    """
    tell("labels", 0.0)
    body = tracking.body_of(document, path, _identity(document))
    tell("hidden LEDs", 0.5)
    return DefinitionCheck(body, wrong_labels(body))


def save_definition(path: Path, document: tracking.ProbeDocument) -> tracking.ProbeBody:
    """Write a definition as a new file, and return the probe.

    InputError if unusable, or if the file exists: documents never change, because records name
    them. StorageError if it cannot be written.
    """
    body = tracking.body_of(document, path, _identity(document))
    if path.exists():
        raise InputError(
            "definition.exists",
            f"{path}: this file already exists.",
            "Give the probe its own name; a used document is never changed.",
        )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomic(path, probe_text(document).encode("utf-8"))
    except OSError as error:
        raise StorageError(
            "definition.write",
            f"{path}: the file cannot be written ({error.strerror}).",
            "Choose a writable folder.",
        ) from error
    return body


def _identity(document: tracking.ProbeDocument) -> str:
    return text_digest(probe_text(document))


def _vector(values: Sequence[float]) -> str:
    return f"[{', '.join(_number(value) for value in values)}]"


def _number(value: float) -> str:
    return repr(float(value))


def _text(value: str) -> str:
    # A JSON string is a basic string of TOML, except for DEL.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
