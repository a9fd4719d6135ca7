"""Predicted uncertainty of a single point, source by source, and the colour scale of its maps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.probe_design import (
    REFERENCE_C,
    Postures,
    ProbeDesign,
    Temperature,
    TemperatureState,
    TipMap,
    View,
    body_in_use,
    force_shapes,
    growth_shape,
    sag_shape,
)
from ocmm_core.geometry import Float
from ocmm_core.measuring._factors import systematic_covariance
from ocmm_core.tracking import TipSensitivity, tip_sensitivities

_POSES = 60
_WINDOW_FRAMES = 2000
"""A quarter of a second at 8 kHz."""
_KNOWN_SIGMA_K = 0.5
_UM = 1e3


@dataclass(frozen=True, slots=True)
class BudgetTerm:
    """One error source of a point: name, standard uncertainty in space, µm, and basis."""

    name: str
    sigma_um: float
    rests_on: str


def budget_of(
    view: View, design: ProbeDesign | None, postures: Postures, seed: int
) -> tuple[BudgetTerm, ...]:
    """Return error sources of a point, RMS over the postures, propagated as in `_factors`."""
    rig, body = view.rig, view.body
    found = _sensitivities(view, postures, seed)
    if not found:
        return ()
    bare_rig = replace(rig, parameter_covariance=np.zeros_like(rig.parameter_covariance))
    bare_body = replace(body, geometry_covariance=np.zeros_like(body.geometry_covariance))
    white = rig.noise.white_px / np.sqrt(_WINDOW_FRAMES)

    def by_geometry(covariance: Float) -> float:
        return _rms([item.by_geometry @ covariance @ item.by_geometry.T for item in found])

    terms = [
        BudgetTerm(
            "Noise of the spots",
            _rms([white**2 * _squares(item) for item in found]),
            f"{rig.noise.white_px:g} px a frame, {_WINDOW_FRAMES} frames a point",
        ),
        BudgetTerm(
            "Pattern of the sensors",
            _rms([systematic_covariance([item], bare_rig, bare_body) for item in found]),
            f"{rig.noise.pattern_px:g} px, fixed on the sensor",
        ),
        BudgetTerm(
            "Calibration of the cameras",
            _rms(
                [item.by_cameras @ rig.parameter_covariance @ item.by_cameras.T for item in found]
            ),
            "covariance of the rig document",
        ),
        BudgetTerm(
            "Calibration of the probe",
            by_geometry(body.geometry_covariance),
            "covariance of LEDs and tip",
        ),
    ]
    if design is None:
        return tuple(terms)
    growth = growth_shape(design, body)
    weight = sag_shape(design, body)
    forces = force_shapes(design, body)
    sure = Temperature(REFERENCE_C + design.temperature_range_k, _KNOWN_SIGMA_K, "")
    made = Temperature(REFERENCE_C, _KNOWN_SIGMA_K, "")
    used = body_in_use(bare_body, design, TemperatureState(sure, made, compensated=True))
    left = used.geometry_covariance - np.outer(weight, weight) / 3.0
    free = design.temperature_range_k**2 / 3.0 * np.outer(growth, growth)
    force = design.contact_force_n**2 / 9.0 * forces @ forces.T
    return (
        *terms,
        BudgetTerm(
            "Temperature of the probe, not measured",
            by_geometry(free),
            f"within ±{design.temperature_range_k:g} K of its calibration",
        ),
        BudgetTerm(
            "Temperature of the probe, compensated",
            by_geometry(left),
            f"instead: {design.temperature_range_k:g} K warmer, known to ±{_KNOWN_SIGMA_K:g} K",
        ),
        BudgetTerm(
            "Weight of the probe", by_geometry(np.outer(weight, weight) / 3.0), "any attitude"
        ),
        BudgetTerm(
            "Force of the hand",
            by_geometry(force),
            f"0 to {design.contact_force_n:g} N from any side",
        ),
    )


def _sensitivities(view: View, postures: Postures, seed: int) -> tuple[TipSensitivity, ...]:
    rotations, tips = postures.draw(_POSES, np.random.default_rng(seed))
    good = np.isfinite(view.covariance(rotations, tips)[:, 0, 0])
    if not good.any():
        return ()
    return tip_sensitivities(view.spots(rotations, tips)[good], view.rig, view.body)


def _squares(item: TipSensitivity) -> Float:
    by_spots = item.by_spots.reshape(3, -1)
    squares: Float = by_spots @ by_spots.T
    return squares


def _rms(covariances: list[Float]) -> float:
    return _UM * float(np.sqrt(np.mean([np.trace(each) for each in covariances])))


_SCALE = np.array(
    [(68, 1, 84), (65, 68, 135), (42, 120, 142), (34, 168, 132), (122, 209, 81), (253, 231, 37)]
)
"""Dark is good, bright is bad; readable without colours, too."""


def colour_at(share: float) -> str:
    """Return the colour of a share from 0 to 1 of the scale, ``#rrggbb``."""
    place = min(max(share, 0.0), 1.0) * (len(_SCALE) - 1)
    low = min(int(place), len(_SCALE) - 2)
    mixed = _SCALE[low] + (place - low) * (_SCALE[low + 1] - _SCALE[low])
    return "#" + "".join(f"{round(float(part)):02x}" for part in mixed)


def map_range(maps: Sequence[TipMap]) -> tuple[float, float]:
    """Return smallest and largest value of maps that share a scale, µm."""
    values = np.concatenate([item.space_um.ravel() for item in maps])
    known = values[np.isfinite(values)]
    if not known.size:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    return low, max(high, low + 1e-3)
