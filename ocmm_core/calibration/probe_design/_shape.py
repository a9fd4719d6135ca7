"""Displacement of LEDs, ball and computed tip by temperature, weight and force.

A shape is the displacement of LEDs and ball per unit of its cause, in the order of
`ProbeBody.geometry_covariance`. The covariance of uncorrected effects is the sum of squares of
shapes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.probe_design import _beam as beam
from ocmm_core.calibration.probe_design._design import ProbeDesign
from ocmm_core.camera import ThermalShare
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, rigid_fit
from ocmm_core.tracking import ProbeBody


@dataclass(frozen=True, slots=True)
class ContactForce:
    """Effect of the hand's force on the ball."""

    by_force: Float
    """(3 L + 3, 3), mm/N: displacement of LEDs and ball by the force on the ball, probe frame."""
    largest_n: float
    """Forces from zero to this are equally likely, N."""


@dataclass(frozen=True, slots=True)
class TemperatureState:
    """Present and calibration temperature of the probe."""

    now: beam.Temperature | None = None
    """None if unknown."""
    made: beam.Temperature | None = None
    """At its calibration; None if unknown."""
    compensated: bool = False
    """The geometry is computed for the present temperature."""

    @property
    def difference_k(self) -> float | None:
        """Return the temperature increase since its calibration, K; None if unknown."""
        if self.now is None or self.made is None:
            return None
        return self.now.celsius - self.made.celsius


def check_temperature(what: str, temperature: beam.Temperature) -> None:
    """Raise InputError for an implausible temperature."""
    beam.require_temperature(what, temperature.celsius)
    if not 0.0 < temperature.sigma_k <= 10.0:
        raise InputError(
            "temperature.sigma",
            f"The temperature of the {what} is given with an uncertainty of "
            f"{temperature.sigma_k:g} K.",
            "Give its standard uncertainty in kelvin, above 0 and up to 10.",
        )


def warmth_shapes(design: ProbeDesign, body: ProbeBody) -> Float:
    """Return the shapes (m, 3 L + 3) of a unit relative growth of each material, mm."""
    moved = beam.strain_shapes(design.chain, body.leds_probe - body.tip_probe)
    flat = moved.reshape(len(moved), -1)
    return np.hstack([flat, np.zeros((len(flat), 3))])


def growth_shape(design: ProbeDesign, body: ProbeBody) -> Float:
    """Return the shape (3 L + 3) of one kelvin, mm/K."""
    per_k = np.array([material.per_k for material in design.chain.materials])
    return per_k @ warmth_shapes(design, body)


def force_shapes(design: ProbeDesign, body: ProbeBody) -> Float:
    """Return the shapes (3 L + 3, 3), mm/N, of forces on the ball along the probe axes."""
    axis, soft = design.axis_probe, design.soft_probe
    stiff = np.cross(axis, soft)
    across = [
        _bent(
            body, design, direction, beam.side_load(design.beam, design.handle_mm, stiff=is_stiff)
        )
        for direction, is_stiff in ((soft, False), (stiff, True))
    ]
    pressed = np.zeros(3 * body.n_leds + 3)
    along = (body.leds_probe - body.tip_probe) @ axis
    for led, place in enumerate(np.minimum(along, design.handle_mm)):
        rest = beam.compression(design.beam, max(float(place), 0.0), design.handle_mm)
        pressed[3 * led : 3 * led + 3] = rest * axis
    pressed[-3:] = beam.compression(design.beam, 0.0, design.handle_mm) * axis
    return np.stack([*across, pressed], axis=1) @ np.stack([soft, stiff, axis])


def sag_shape(design: ProbeDesign, body: ProbeBody) -> Float:
    """Return the shape (3 L + 3), mm, of the level probe's weight, across its soft side."""
    bent = beam.sag(design.beam, (0.0, design.handle_mm))
    return _bent(body, design, design.soft_probe, bent)


def bow_shape(design: ProbeDesign, body: ProbeBody) -> Float:
    """Return the shape (3 L + 3), mm/K, of a temperature difference of the panel faces."""
    return _bent(body, design, design.soft_probe, beam.bow(design.beam))


def tip_shift(body: ProbeBody, shape: Float) -> Float:
    """Return the uncorrected error of the computed tip (3,), mm, probe frame.

    LEDs have equal weights, as in appendix B; better visible ones weigh more
    (`tracking.sensitivity`).
    """
    # Small against the probe: a thousandth of the displacement, so that the rotation stays linear.
    scale = 1e-3 / max(float(np.abs(shape).max()), 1e-30)
    moved = scale * shape.reshape(-1, 3)
    rotation, origin = rigid_fit(body.leds_probe, body.leds_probe + moved[:-1])
    found = rotation @ body.tip_probe + origin
    shift: Float = (found - body.tip_probe - moved[-1]) / scale
    return shift


def contact_force(design: ProbeDesign, body: ProbeBody) -> ContactForce:
    return ContactForce(force_shapes(design, body), design.contact_force_n)


def body_in_use(
    body: ProbeBody, design: ProbeDesign, temperature_state: TemperatureState
) -> ProbeBody:
    """Return the probe with thermal and weight effects applied.

    Compensated, LEDs and ball are at their positions for the temperature, leaving the uncertainty
    of temperatures and expansions. Otherwise the growth itself, for the temperature difference or
    the range in the design, is uncertainty. InputError if a temperature for compensation is unknown
    or implausible.
    """
    shapes = warmth_shapes(design, body)
    growth = growth_shape(design, body)
    covariance = body.geometry_covariance.copy()
    weight = sag_shape(design, body)
    # Orientation is not followed: gravity across the panel varies, with a mean square of a third.
    covariance += np.outer(weight, weight) / 3.0
    for what, temperature in (
        ("probe", temperature_state.now),
        ("probe's calibration", temperature_state.made),
    ):
        if temperature is not None:
            check_temperature(what, temperature)
    change = temperature_state.difference_k
    if change is None or temperature_state.now is None or temperature_state.made is None:
        if temperature_state.compensated:
            raise _unknown(temperature_state)
        variance = design.temperature_range_k**2 / 3.0
        return replace(body, geometry_covariance=covariance + variance * np.outer(growth, growth))
    variance = temperature_state.now.sigma_k**2 + temperature_state.made.sigma_k**2
    if not temperature_state.compensated:
        variance += change**2
        return replace(body, geometry_covariance=covariance + variance * np.outer(growth, growth))
    covariance += variance * np.outer(growth, growth)
    for material, shape in zip(design.chain.materials, shapes, strict=True):
        covariance += (change * material.sigma_per_k) ** 2 * np.outer(shape, shape)
    ball = design.ball
    radius_sigma = float(
        np.linalg.norm(
            [
                body.tip_radius_sigma,
                body.tip_radius * ball.per_k * np.sqrt(variance),
                body.tip_radius * ball.sigma_per_k * change,
            ]
        )
    )
    return replace(
        body,
        leds_probe=body.leds_probe + change * growth[:-3].reshape(-1, 3),
        tip_radius=body.tip_radius * (1.0 + ball.per_k * change),
        tip_radius_sigma=radius_sigma,
        geometry_covariance=covariance,
        thermal=ThermalShare(temperature_state.now.origin, temperature_state.now.sigma_k, growth),
    )


def _bent(body: ProbeBody, design: ProbeDesign, direction: Float, bent: beam.Deflection) -> Float:
    """Return the shape of a bent beam: every cross-section is shifted and turned."""
    from_tip = np.vstack([body.leds_probe - body.tip_probe, np.zeros(3)])
    along = from_tip @ design.axis_probe
    shift, slope = bent.at(along)
    beside = from_tip @ direction
    return (shift[:, None] * direction - (slope * beside)[:, None] * design.axis_probe).ravel()


def _unknown(temperature_state: TemperatureState) -> InputError:
    if temperature_state.now is None:
        return InputError(
            "temperature.probe_unknown",
            "Compensating the probe needs its temperature, which is not given.",
            "Measure and give it, or do not compensate the probe (Settings, Temperature).",
        )
    return InputError(
        "temperature.calibration_unknown",
        "Compensating the probe needs its temperature at calibration, which is unknown.",
        "Calibrate the probe with a thermometer beside it, enter reference_temperature_c in its "
        "design, or do not compensate the probe (Settings, Temperature).",
    )
