"""Thermal growth of a stylus and a probe body (thesis, appendix A, generalised).

The probe is taken as a chain of layers along its axis, each with the expansion of its material. A
point moves along the axis by the growth of everything between it and the ball's centre, and
across it as the layer grows in which it stands. All of the probe is equally warm here; what a hand
does that warms one side is in `beam.bow`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float

REFERENCE_C = 20.0
"""Reference temperature of lengths (ISO 1)."""
LOWEST_C, HIGHEST_C = 0.0, 50.0
"""A room, probe or part outside is no place to measure with micrometres, or a wrong number."""


def require_temperature(what: str, celsius: float) -> None:
    """Refuse a temperature that nobody measures at, wherever it was entered.

    Parameters
    ----------
    what
        Whose it is.

    Raises
    ------
    InputError
        It is outside `LOWEST_C` to `HIGHEST_C`, or no number.
    """
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
    """Degrees."""
    sigma_k: float
    """Standard uncertainty, with that of the place where it was measured, K."""
    origin: str
    """Where the number comes from, in words."""


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
    """Layers that follow each other without gaps, from the ball on."""

    axis_probe: Float
    """(3,), unit: from the ball's centre along the probe."""
    layers: tuple[Layer, ...]
    """The first one begins at the ball or before it."""

    @property
    def materials(self) -> tuple[Expansion, ...]:
        """Return every material once; layers of one material have one and the same expansion."""
        return tuple(dict.fromkeys(layer.material for layer in self.layers))

    @property
    def growth_per_k(self) -> float:
        """Return by how much the whole chain gets longer, mm/K (appendix A: 1.75 um/K)."""
        return sum(layer.material.per_k * (layer.end_mm - layer.start_mm) for layer in self.layers)


def strain_shapes(chain: LayerChain, from_tip: Float) -> Float:
    """Return how points move against the ball's centre where a material grows.

    Parameters
    ----------
    from_tip
        (n, 3), mm, probe frame: from the ball's centre to the points.

    Returns
    -------
    numpy.ndarray
        (m, n, 3): for each of `LayerChain.materials`, mm for a relative growth of one.
    """
    along = from_tip @ chain.axis_probe
    across = from_tip - along[:, None] * chain.axis_probe
    shapes = np.zeros((len(chain.materials), len(from_tip), 3))
    last = len(chain.layers) - 1
    for index, layer in enumerate(chain.layers):
        # Beyond its ends the chain goes on as its first and last layer.
        start = -np.inf if index == 0 else layer.start_mm
        end = np.inf if index == last else layer.end_mm
        passed = np.clip(along, start, end) - np.clip(0.0, start, end)
        stands = (along >= start) & (along < end)
        shapes[chain.materials.index(layer.material)] += (
            passed[:, None] * chain.axis_probe + stands[:, None] * across
        )
    return shapes
