"""Bending of stylus and probe body as a stepped, tapered beam (thesis, appendix B).

Along the probe, the ball's centre at zero. Sections are solid or hollow bars, or sandwich panels
whose core carries no load. The grid has a point on both sides of every step, exact except for the
taper (trapezia, below 1e-5). Lengths are mm, forces N, stiffness N mm^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ocmm_core.geometry import Float

GRAVITY = 9.80665
"""m/s^2; the thesis uses 9.8."""

_STEPS = 400
"""Per section."""
_MM3_PER_M3 = 1e9


@dataclass(frozen=True, slots=True)
class Bar:
    """A round bar between two places; diameters vary linearly."""

    start_mm: float
    end_mm: float
    diameter_mm: tuple[float, float]
    bore_mm: tuple[float, float]
    """`diameter_mm`, `bore_mm`: Outside and inside, at the start and at the end."""
    density: float
    """kg/m^3."""
    modulus: float
    """Young's modulus, N/mm^2."""


@dataclass(frozen=True, slots=True)
class Panel:
    """A sandwich of two faces and a core; its width varies linearly."""

    start_mm: float
    end_mm: float
    width_mm: tuple[float, float]
    """At the start and at the end."""
    core_mm: float
    face_mm: float
    """`core_mm`, `face_mm`: Thickness of the core, and of one face."""
    density: float
    core_density: float
    """`density`, `core_density`: kg/m^3: of the faces and of the core."""
    modulus: float
    """Young's modulus of the faces, N/mm^2."""
    expansion_per_k: float = 0.0
    """Thermal expansion of the faces, 1/K."""
    offset_mm: float = 0.0
    """Offset of its middle from the axis of the probe, along the soft direction. It bends about its
    own middle, whose place does not matter for a transverse force."""


Section: TypeAlias = Bar | Panel


@dataclass(frozen=True, slots=True)
class Beam:
    """Sections on a grid of n places."""

    x_mm: Float
    """(n,): places from the ball's centre; steps between sections occur twice."""
    load: Float
    """(n,): weight per length, N/mm."""
    soft: Float
    stiff: Float
    """`soft`, `stiff`: (n,): bending stiffness E I across the panel and along it, N mm^2; the same
    for bars."""
    axial: Float
    """(n,): stiffness E A against tension, N."""
    bow: Float
    """(n,): curvature per kelvin between the faces of a panel, 1/(mm K); bars are too thin."""

    @property
    def weight(self) -> float:
        return float(_running(self.load, self.x_mm)[-1])


@dataclass(frozen=True, slots=True)
class Deflection:
    """Deflection of a beam."""

    x_mm: Float
    """(n,): places."""
    moment: Float
    """(n,): bending moment, N mm."""
    deflection_mm: Float
    slope: Float
    """`deflection_mm`, `slope`: (n,): across the beam, and its derivative along it."""
    reactions: tuple[float, ...]
    """N: of the supports, in order."""

    def at(self, x_mm: Float) -> tuple[Float, Float]:
        """Return deflection, mm, and slope at places (m,); linear beyond the ends."""
        inside = np.clip(x_mm, self.x_mm[0], self.x_mm[-1])
        slope = np.interp(inside, self.x_mm, self.slope)
        bent: Float = np.interp(inside, self.x_mm, self.deflection_mm) + slope * (x_mm - inside)
        return bent, slope


def make_beam(sections: Sequence[Section], gravity: float = GRAVITY) -> Beam:
    pieces = [_piece(section, gravity) for section in sections]
    return Beam(*(np.concatenate([piece[row] for piece in pieces]) for row in range(6)))


def sag(beam: Beam, supports_mm: tuple[float, float]) -> Deflection:
    """Return the sag of a level beam on two supports, mm, up, by its weight (appendix B.1).

    It bends across its soft direction.
    """
    x = beam.x_mm
    first, second = supports_mm
    weight = beam.weight
    about_first = float(_running(beam.load * (x - first), x)[-1])
    reactions = (weight - about_first / (second - first), about_first / (second - first))
    shear = _running(beam.load, x)
    moment = _running(shear, x)
    for place, force in zip(supports_mm, reactions, strict=True):
        moment = moment - force * np.maximum(x - place, 0.0)
    slope = _running(-moment / beam.soft, x)
    bent = _running(slope, x)
    # A straight line is free: it passes through both supports.
    at = np.interp(supports_mm, x, bent)
    tilt = (at[1] - at[0]) / (second - first)
    return Deflection(
        x, moment, bent - at[0] - tilt * (x - first), slope - tilt, tuple(map(float, reactions))
    )


def side_load(beam: Beam, held_mm: float, *, stiff: bool = False) -> Deflection:
    """Return the deflection along 1 N on the ball, across the beam, clamped at ``held_mm``.

    Zero behind the clamp. If ``stiff``, the force acts along the panel instead of across it.
    """
    x = beam.x_mm
    moment = np.maximum(x, 0.0)
    curvature = moment / (beam.stiff if stiff else beam.soft)
    slope = _running(curvature, x)
    bent = _running(slope, x)
    tilt = float(np.interp(held_mm, x, slope))
    bent = bent - float(np.interp(held_mm, x, bent)) - tilt * (x - held_mm)
    free = x < held_mm
    return Deflection(x, moment * free, bent * free, (slope - tilt) * free, (-1.0,))


def bow(beam: Beam) -> Deflection:
    """Return the deflection for 1 K between the faces, towards the cooler one; zero at the ball."""
    slope = _running(beam.bow, beam.x_mm)
    still = np.zeros_like(slope)
    return Deflection(beam.x_mm, still, _running(slope, beam.x_mm), slope, ())


def compression(beam: Beam, from_mm: float, to_mm: float) -> float:
    """Return the compression between two places for 1 N along the beam, mm."""
    run = _running(1.0 / beam.axial, beam.x_mm)
    low, high = np.interp((from_mm, to_mm), beam.x_mm, run)
    return float(high - low)


def upright_shortening(beam: Beam) -> float:
    """Return the compression of the beam upright on the ball (appendix B.2), mm."""
    above = beam.weight - _running(beam.load, beam.x_mm)
    return float(_running(above / beam.axial, beam.x_mm)[-1])


def _running(values: Float, x_mm: Float) -> Float:
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(x_mm)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _piece(section: Section, gravity: float) -> tuple[Float, ...]:
    x = np.linspace(section.start_mm, section.end_mm, _STEPS + 1)
    share = np.linspace(0.0, 1.0, _STEPS + 1)
    heavy = gravity * section.density / _MM3_PER_M3
    if isinstance(section, Bar):
        outer = _between(section.diameter_mm, share)
        inner = _between(section.bore_mm, share)
        area = 0.25 * np.pi * (outer**2 - inner**2)
        inertia = np.pi / 64.0 * (outer**4 - inner**4)
        bending = section.modulus * inertia
        return x, heavy * area, bending, bending, section.modulus * area, np.zeros_like(x)
    width = _between(section.width_mm, share)
    inside, outside = 0.5 * section.core_mm, 0.5 * section.core_mm + section.face_mm
    faces = 2.0 * section.face_mm * width
    across = 2.0 / 3.0 * width * (outside**3 - inside**3)
    core = gravity * section.core_density / _MM3_PER_M3 * section.core_mm * width
    along = faces * width**2 / 12.0
    return (
        x,
        heavy * faces + core,
        section.modulus * across,
        section.modulus * along,
        section.modulus * faces,
        np.full_like(x, section.expansion_per_k / (section.core_mm + section.face_mm)),
    )


def _between(ends: tuple[float, float], share: Float) -> Float:
    values: Float = ends[0] + (ends[1] - ends[0]) * share
    return values
