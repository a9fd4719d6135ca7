"""Probe design document, optional: structure between LEDs and ball, for bending and growth.

LEDs obstructed by the body: hidden if any ray of the emission cone meets a section of the body, as
the cameras' position is unknown. Rays are sampled; a section is a trapezium of uniform thickness,
or a cone.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.calibration.probe_design._beam import (
    HIGHEST_C,
    LOWEST_C,
    Bar,
    Beam,
    Layer,
    LayerChain,
    MaterialExpansion,
    Panel,
    Section,
    make_beam,
)
from ocmm_core.camera import Vector3
from ocmm_core.documents import Document, load_document, read_text, resource
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, perpendicular_pair, unit
from ocmm_core.tracking import ProbeBody

SCHEMA = "ocmm.probe-design/1"
_TOUCH_MM = 1e-6
_PPM = 1e-6
_GPA = 1e3


class _Entry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    pass


class MaterialEntry(_Entry, frozen=True, kw_only=True):
    """A material: kg/m^3, GPa, and the expansion with its standard uncertainty, 1e-6/K."""

    name: str
    density: float
    modulus_gpa: float
    expansion_ppm: float
    expansion_sigma_ppm: float


class BarEntry(_Entry, frozen=True, kw_only=True, tag="bar", tag_field="shape"):
    """A round section; diameters at its start and its end."""

    material: str
    start: float
    end: float
    diameter: tuple[float, float]
    bore: tuple[float, float] = (0.0, 0.0)


class PanelEntry(_Entry, frozen=True, kw_only=True, tag="panel", tag_field="shape"):
    """A sandwich panel; ``offset``: distance of its middle from the axis, along ``soft``."""

    material: str
    start: float
    end: float
    width: tuple[float, float]
    core: float
    face: float
    core_density: float
    offset: float = 0.0


class LayerEntry(_Entry, frozen=True, kw_only=True):
    """A thermally growing piece of the chain."""

    material: str
    length: float


class DesignDocument(Document, frozen=True, kw_only=True):
    """Document of a probe design; lengths in mm from the ball's centre."""

    name: str
    probe: str
    """`name`, `probe`: Of the design, and of the probe in the probe document."""
    axis: Vector3
    """From the ball along the probe, probe frame."""
    soft: Vector3
    """Direction of least bending stiffness, probe frame; across the axis."""
    handle: float
    contact_force_n: float
    """Largest force of the hand."""
    temperature_range_k: float
    """Largest difference from its calibration temperature, if not measured."""
    ball: str
    materials: list[MaterialEntry]
    sections: list[BarEntry | PanelEntry]
    """`materials`, `sections`, `ball`: Materials, bending sections, and the material of the ball.
    """
    chain_start: float
    chain: list[LayerEntry]
    """`chain_start`, `chain`: Growing pieces in order, and the start of the first."""
    reference_temperature_c: float | None = None
    """At its calibration, if not in a record."""


@dataclass(frozen=True, slots=True)
class ProbeDesign:
    """A checked probe design."""

    name: str
    probe: str
    axis_probe: Float
    soft_probe: Float
    """`axis_probe`, `soft_probe`: (3,), unit, probe frame: along it; across, of least stiffness."""
    sections: tuple[Section, ...]
    """Sections along the axis, from the ball on."""
    beam: Beam
    """Bending model: the sections on a grid."""
    chain: LayerChain
    """Thermal growth model."""
    ball: MaterialExpansion
    handle_mm: float
    """Position of the grip, from the ball's centre."""
    contact_force_n: float
    temperature_range_k: float
    """Largest difference from its calibration temperature, if not measured."""
    reference_temperature_c: float | None
    """At its calibration by this document, or None."""
    text: str
    """The document, for the job file."""


def load_design(path: Path | str, body: ProbeBody) -> ProbeDesign:
    """Return the design of a probe by the document at ``path``.

    InputError: malformed, of another probe, undefined material, gaps or implausible values.
    """
    path = Path(path)
    document = load_document(path, DesignDocument, SCHEMA)
    if document.probe != body.name:
        raise InputError(
            "design.probe",
            f"{path}: field 'probe' is {document.probe!r}, but the probe is {body.name!r}.",
            "Give the design of this probe.",
        )
    materials = {entry.name: entry for entry in document.materials}
    _check(path, document, materials)
    expansions = {
        name: MaterialExpansion(name, _PPM * entry.expansion_ppm, _PPM * entry.expansion_sigma_ppm)
        for name, entry in materials.items()
    }
    axis = unit(np.array(document.axis))
    across = np.array(document.soft) - (np.array(document.soft) @ axis) * axis
    ends = document.chain_start + np.cumsum([entry.length for entry in document.chain])
    starts = [document.chain_start, *ends[:-1].tolist()]
    layers = tuple(
        Layer(start, float(end), expansions[entry.material])
        for start, end, entry in zip(starts, ends, document.chain, strict=True)
    )
    sections = tuple(_section(entry, materials[entry.material]) for entry in document.sections)
    return ProbeDesign(
        name=document.name, probe=document.probe, axis_probe=axis, soft_probe=unit(across),
        sections=sections, beam=make_beam(sections), chain=LayerChain(axis, layers),
        ball=expansions[document.ball], handle_mm=document.handle,
        contact_force_n=document.contact_force_n, temperature_range_k=document.temperature_range_k,
        reference_temperature_c=document.reference_temperature_c, text=read_text(path),
    )  # fmt: skip


def shipped_design(body: ProbeBody) -> Path | None:
    """Return the shipped design of a probe, or None."""
    if any(mark in body.name for mark in "/\\\0"):
        return None
    path = resource("designs", f"{body.name}.toml")
    return path if path.is_file() else None


def _section(entry: BarEntry | PanelEntry, material: MaterialEntry) -> Section:
    modulus = _GPA * material.modulus_gpa
    if isinstance(entry, BarEntry):
        return Bar(entry.start, entry.end, entry.diameter, entry.bore, material.density, modulus)
    return Panel(
        entry.start, entry.end, entry.width, entry.core, entry.face, material.density,
        entry.core_density, modulus, _PPM * material.expansion_ppm, entry.offset,
    )  # fmt: skip


def _check(path: Path, document: DesignDocument, materials: dict[str, MaterialEntry]) -> None:
    def wrong(field: str, fault: str, remedy: str = "Correct that field.") -> InputError:
        return InputError("design.field", f"{path}: field '{field}' {fault}.", remedy)

    if not document.sections or not document.chain:
        raise wrong("sections" if not document.sections else "chain", "is empty")
    named = [("ball", document.ball)]
    named += [(f"sections[{i}].material", s.material) for i, s in enumerate(document.sections)]
    named += [(f"chain[{i}].material", layer.material) for i, layer in enumerate(document.chain)]
    for field, name in named:
        if name not in materials:
            raise wrong(field, f"names {name!r}", "Describe that material under [[materials]].")
    positive = [
        (f"materials[{i}].{field}", getattr(entry, field))
        for i, entry in enumerate(document.materials)
        for field in ("density", "modulus_gpa")
    ]
    positive += [(f"chain[{i}].length", layer.length) for i, layer in enumerate(document.chain)]
    for i, entry in enumerate(document.sections):
        positive.append((f"sections[{i}].end", entry.end - entry.start))
        if isinstance(entry, BarEntry):
            walls = zip(entry.diameter, entry.bore, strict=True)
            positive += [(f"sections[{i}].diameter", outer - inner) for outer, inner in walls]
            if min(entry.bore) < 0.0:
                raise wrong(f"sections[{i}].bore", "is below zero")
        else:
            positive += [(f"sections[{i}].width", width) for width in entry.width]
            positive += [(f"sections[{i}].{f}", getattr(entry, f)) for f in ("core", "face")]
            if entry.core_density < 0.0:
                raise wrong(f"sections[{i}].core_density", "is below zero")
        expected = document.sections[i - 1].end if i else 0.0
        if abs(entry.start - expected) > _TOUCH_MM:
            raise wrong(
                f"sections[{i}].start",
                f"is {entry.start:g} mm, but the section before ends at {expected:g} mm"
                if i
                else f"is {entry.start:g} mm, but the first section starts at the ball, at 0",
                "Sections must follow each other without gaps.",
            )
    for field, value in positive:
        if not value > 0.0:
            raise wrong(field, "leaves no material: it must be greater than zero")
    for i, material in enumerate(document.materials):
        if abs(material.expansion_ppm) > 200.0 or not 0.0 <= material.expansion_sigma_ppm < 100.0:
            raise wrong(
                f"materials[{i}].expansion_ppm",
                f"is {material.expansion_ppm:g} ± {material.expansion_sigma_ppm:g}",
                "Give the growth in micrometres per metre and kelvin, e.g. 11.5 for steel.",
            )
    if len(materials) != len(document.materials):
        raise wrong("materials", "names a material twice")
    if min(document.contact_force_n, document.temperature_range_k) < 0.0:
        raise wrong("contact_force_n or temperature_range_k", "is below zero")
    if document.chain_start > 0.0:
        raise wrong("chain_start", "lies behind the ball centre; the chain starts at the ball")
    if not 0.0 < document.handle <= document.sections[-1].end:
        raise wrong("handle", f"is {document.handle:g} mm, which is not on the probe")
    axis, soft = np.array(document.axis), np.array(document.soft)
    if np.linalg.norm(np.cross(axis, soft)) < 1e-6:
        raise wrong("soft", "does not lie across 'axis'")
    known = document.reference_temperature_c
    if known is not None and not LOWEST_C <= known <= HIGHEST_C:
        raise wrong(
            "reference_temperature_c", f"is {known:g}, outside the range of probe calibration"
        )


_RINGS, _ROUND = 9, 24
"""Rays: rings from the axis of the cone to its rim, and number on each."""
_STEP_MM, _FAR_MM = 1.0, 300.0
"""No body is thinner than a step, or larger than the path."""
_LENS_MM = 1.0
"""An LED is embedded in its carrier: start of the rays above it."""


def leds_behind_body(body: ProbeBody, design: ProbeDesign) -> tuple[int, ...]:
    """Return the LEDs, from 0, with light partly or fully blocked by the body."""
    leds = body.leds_probe - body.tip_probe
    ways = np.arange(_LENS_MM, _FAR_MM, _STEP_MM)
    hidden = []
    for number, (led, looks) in enumerate(zip(leds, body.led_directions_probe, strict=True)):
        rays = _cone(unit(looks), body.emission_half_angle)
        places = led + ways[:, None] * rays[:, None, :]
        if any(_inside(section, design, places.reshape(-1, 3)) for section in design.sections):
            hidden.append(number)
    return tuple(hidden)


def _cone(axis: Float, half: float) -> Float:
    """Return unit vectors (n, 3) of a cone, its axis first."""
    first, second = perpendicular_pair(axis)
    turn = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
    across = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
    angles = half * np.arange(1, _RINGS + 1) / _RINGS
    rings = [np.cos(angle) * axis + np.sin(angle) * across for angle in angles]
    return np.concatenate([axis[None], *rings])


def _inside(section: Section, design: ProbeDesign, places: Float) -> bool:
    """Return whether any of the places (n, 3), from the ball's centre, is in a section."""
    along = places @ design.axis_probe
    soft = places @ design.soft_probe
    across = places @ np.cross(design.soft_probe, design.axis_probe)
    share = (along - section.start_mm) / (section.end_mm - section.start_mm)
    within = (share >= 0.0) & (share <= 1.0)
    if isinstance(section, Bar):
        first, last = section.diameter_mm
        radius = 0.5 * (first + share * (last - first))
        return bool(np.any(within & (np.hypot(soft, across) < radius)))
    first, last = section.width_mm
    half = 0.5 * (first + share * (last - first))
    thick = 0.5 * section.core_mm + section.face_mm
    in_it = (np.abs(across) < half) & (np.abs(soft - section.offset_mm) < thick)
    return bool(np.any(within & in_it))
