"""Bending and thermal growth of stylus and probe body (thesis, appendices A and B, generalised).

Bending: a stepped, tapered beam along the probe, the ball's centre at zero. Sections are solid or
hollow bars, or sandwich panels whose core carries no load. The grid has a point on both sides of
every step, exact except for the taper (trapezia, below 1e-5). Lengths are mm, forces N, stiffness
N mm^2.

Growth: a chain of layers along the axis. A point moves along the axis by the growth between it and
the ball's centre, and across it by the growth of its layer. Uniform temperature; for one-sided
heating see `bow`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ocmm_core.ambient import TEMPERATURE
from ocmm_core.errors import InputError
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
    x_mm: Float
    """(n,): places."""
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
        x, bent - at[0] - tilt * (x - first), slope - tilt, tuple(map(float, reactions))
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
    return Deflection(x, bent * free, (slope - tilt) * free, (-1.0,))


def bow(beam: Beam) -> Deflection:
    """Return the deflection for 1 K between the faces, towards the cooler one; zero at the ball."""
    slope = _running(beam.bow, beam.x_mm)
    return Deflection(beam.x_mm, _running(slope, beam.x_mm), slope, ())


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
    return ends[0] + (ends[1] - ends[0]) * share


REFERENCE_C = 20.0
"""Reference temperature of lengths (ISO 1)."""
LOWEST_C, HIGHEST_C = TEMPERATURE.least, TEMPERATURE.most
"""Plausible range of room, probe and part temperatures."""
UNMEASURED_K = 2.0
"""Standard uncertainty of a temperature that was not measured; 20 degrees are assumed."""
LARGEST_U_K = 20.0
"""Largest plausible expanded uncertainty (k = 2) of a thermometer."""


def require_temperature(what: str, celsius: float) -> None:
    """Raise InputError for a temperature outside `LOWEST_C` to `HIGHEST_C`, or NaN."""
    if not LOWEST_C <= celsius <= HIGHEST_C:
        raise InputError(
            "temperature.range",
            f"The temperature of the {what} is given as {celsius:g} °C.",
            f"Give it in degrees Celsius, from {LOWEST_C:g} to {HIGHEST_C:g}.",
        )


@dataclass(frozen=True, slots=True)
class Temperature:
    """How warm something is."""

    celsius: float
    sigma_k: float
    """Standard uncertainty, including that of the measuring position, K."""
    origin: str
    """Thermometer, or basis of the value; readings of one origin are fully correlated."""


def stated_temperature(
    celsius: float | None, expanded_k: float | None, origin: str = ""
) -> Temperature | None:
    """Return a typed temperature with U (k = 2); InputError if implausible, or without U."""
    if celsius is None:
        return None
    require_temperature("surroundings", celsius)
    if expanded_k is None:
        raise InputError(
            "temperature.u_missing",
            f"The temperature {celsius:g} °C is given without the uncertainty of its thermometer.",
            "Give U (k = 2) in kelvin from the certificate of the thermometer, or the name of the "
            "thermometer in the register of artefacts.",
        )
    if not 0.0 < expanded_k <= LARGEST_U_K:
        raise InputError(
            "temperature.sigma",
            f"The thermometer is given with an expanded uncertainty of {expanded_k:g} K.",
            f"Give U (k = 2) in kelvin, above 0 and up to {LARGEST_U_K:g}.",
        )
    return Temperature(celsius, 0.5 * expanded_k, origin)


def certified_at(
    length: float, expanded: float, expansion: float, expansion_sigma: float,
    temperature: Temperature | None,
) -> tuple[float, float]:  # fmt: skip
    """Return a certified length at a temperature, and its expanded uncertainty (k = 2), mm.

    l (1 + a (T - 20)); U holds the certificate (``expanded``, k = 2), l a u(T) and l |T - 20| u(a).
    Unmeasured: 20 degrees with `UNMEASURED_K`.
    """
    off = 0.0 if temperature is None else temperature.celsius - REFERENCE_C
    sigma_k = UNMEASURED_K if temperature is None else temperature.sigma_k
    thermal = abs(length) * np.hypot(off * expansion_sigma, sigma_k * expansion)
    return length * (1.0 + expansion * off), float(np.hypot(expanded, 2.0 * thermal))


@dataclass(frozen=True, slots=True)
class MaterialExpansion:
    """Thermal expansion of a material."""

    name: str
    per_k: float
    """Relative growth of a length, 1/K."""
    sigma_per_k: float
    """Its standard uncertainty, 1/K."""


@dataclass(frozen=True, slots=True)
class Layer:
    """A piece of the chain, from ``start_mm`` to ``end_mm`` behind the ball's centre."""

    start_mm: float
    end_mm: float
    material: MaterialExpansion


@dataclass(frozen=True, slots=True)
class LayerChain:
    """Adjacent layers, from the ball on."""

    axis_probe: Float
    """(3,), unit: from the ball's centre along the probe."""
    layers: tuple[Layer, ...]
    """The first one starts at the ball or before it."""

    @property
    def materials(self) -> tuple[MaterialExpansion, ...]:
        """Return every material once; layers of one material share its expansion."""
        return tuple(dict.fromkeys(layer.material for layer in self.layers))

    @property
    def growth_per_k(self) -> float:
        """Return the growth of the whole chain, mm/K (appendix A: 1.75 um/K)."""
        return sum(layer.material.per_k * (layer.end_mm - layer.start_mm) for layer in self.layers)


def strain_shapes(chain: LayerChain, from_tip: Float) -> Float:
    """Return displacements from the ball's centre by growth of each `LayerChain.materials`.

    (m, n, 3), mm per unit relative growth, for points ``from_tip`` (n, 3), mm from the centre.
    """
    along = from_tip @ chain.axis_probe
    across = from_tip - along[:, None] * chain.axis_probe
    shapes = np.zeros((len(chain.materials), len(from_tip), 3))
    last = len(chain.layers) - 1
    for index, layer in enumerate(chain.layers):
        # The end layers extend beyond the chain.
        start = -np.inf if index == 0 else layer.start_mm
        end = np.inf if index == last else layer.end_mm
        passed = np.clip(along, start, end) - np.clip(0.0, start, end)
        stands = (along >= start) & (along < end)
        shapes[chain.materials.index(layer.material)] += (
            passed[:, None] * chain.axis_probe + stands[:, None] * across
        )
    return shapes
