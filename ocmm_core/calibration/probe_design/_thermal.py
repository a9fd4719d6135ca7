"""Thermal growth of a stylus and a probe body (thesis, appendix A, generalised).

The probe is a chain of layers along its axis. A point moves along the axis by the growth between it
and the ball's centre, and across it by the growth of its layer. Uniform temperature; for one-sided
heating see `beam.bow`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.surroundings import TEMPERATURE

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
class Expansion:
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
    material: Expansion


@dataclass(frozen=True, slots=True)
class LayerChain:
    """Adjacent layers, from the ball on."""

    axis_probe: Float
    """(3,), unit: from the ball's centre along the probe."""
    layers: tuple[Layer, ...]
    """The first one starts at the ball or before it."""

    @property
    def materials(self) -> tuple[Expansion, ...]:
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
