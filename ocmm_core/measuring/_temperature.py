"""Temperatures of probe and part: compensation, contribution to U, and record.

The two switches are independent. The probe is compensated by measuring with its geometry at the
present temperature (`calibration.probe_design.body_in_use`). The part is compensated by reporting
all coordinates at 20 °C (ISO 1): ball centres and ball radius are scaled together, which scales
every surface point about the world's origin. Observations are unchanged, and the job file records
the compensation so that it can be repeated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import msgspec
import numpy as np

from ocmm_core.calibration.probe_design import (
    REFERENCE_C,
    MaterialExpansion,
    Temperature,
    TemperatureState,
    check_temperature,
)
from ocmm_core.camera import ThermalShare
from ocmm_core.documents import decode_json
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.measuring._point import MeasuredPoint

SCHEMA = "ocmm.temperature/1"
CLIMATE_EVENT = "temperature"
"""Kind of the event in the job file; its text is a `TemperatureRecord`."""

_PPM = 1e6


@dataclass(frozen=True, slots=True)
class PartTemperature:
    """Temperature and expansion of the part."""

    now: Temperature | None = None
    expansion: MaterialExpansion | None = None
    """`now`, `expansion`: None if unknown."""
    compensated: bool = False
    """Coordinates are reported at 20 °C."""

    @property
    def scale(self) -> float:
        """Return the factor on measured lengths: ``1 - alpha (T - 20)``."""
        if not self.compensated or self.now is None or self.expansion is None:
            return 1.0
        return 1.0 - self.expansion.per_k * (self.now.celsius - REFERENCE_C)

    @property
    def scale_sigma(self) -> float:
        """Return the standard uncertainty of the scale, from expansion and temperature."""
        if not self.compensated or self.now is None or self.expansion is None:
            return 0.0
        change = self.now.celsius - REFERENCE_C
        return float(
            np.hypot(change * self.expansion.sigma_per_k, self.expansion.per_k * self.now.sigma_k)
        )

    @property
    def share(self) -> ThermalShare | None:
        """Return the share of the thermometer in the scale; None if not compensated."""
        if not self.compensated or self.now is None or self.expansion is None:
            return None
        by_k = np.array([-self.expansion.per_k])
        return ThermalShare(self.now.origin, self.now.sigma_k, by_k)


class TemperatureRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Record of the temperatures of a job; None if unknown."""

    schema: str
    probe_compensated: bool
    part_compensated: bool
    probe: Temperature | None
    probe_calibration: Temperature | None
    part: Temperature | None
    """`probe`, `probe_calibration`, `part`: Temperatures: °C, standard uncertainty in K, origin."""
    part_expansion: MaterialExpansion | None
    """Name, 1/K, standard uncertainty in 1/K."""
    probe_design: str
    """The whole design document of the probe; empty if absent."""


@dataclass(frozen=True, slots=True)
class Climate:
    """Temperatures of probe and part for a job."""

    probe: TemperatureState = field(default_factory=TemperatureState)
    part: PartTemperature = field(default_factory=PartTemperature)
    probe_design: str = ""
    """The text of the probe's design; empty if unknown."""

    @property
    def summary(self) -> str:
        if self.probe.now is None and self.part.now is None:
            return "No temperature compensation (no temperatures given)."
        return f"{_probe_words(self.probe)} {_part_words(self.part)}"

    @property
    def label(self) -> str:
        """Return the text for reports: pure ASCII, no comma."""
        plain = self.summary.replace("°C", "C").replace("±", "+-").replace(",", ";")
        return plain.encode("ascii", "replace").decode("ascii")

    def record(self) -> TemperatureRecord:
        return TemperatureRecord(
            schema=SCHEMA,
            probe_compensated=self.probe.compensated,
            part_compensated=self.part.compensated,
            probe=self.probe.now,
            probe_calibration=self.probe.made,
            part=self.part.now,
            part_expansion=self.part.expansion,
            probe_design=self.probe_design,
        )


def record_text(record: TemperatureRecord) -> str:
    """Return the text of the event in the job file."""
    return msgspec.json.encode(record).decode("utf-8")


def climate_of_text(text: str) -> Climate:
    """Return the temperatures of a job from its event; raise InputError if unreadable."""
    try:
        record = decode_json(text, TemperatureRecord)
    except msgspec.MsgspecError as error:
        raise InputError(
            "temperature.record",
            f"The job's record of temperatures cannot be read: {error}.",
            "Open the job with the program that wrote it.",
        ) from error
    return Climate(
        TemperatureState(record.probe, record.probe_calibration, record.probe_compensated),
        PartTemperature(record.part, record.part_expansion, record.part_compensated),
        record.probe_design,
    )


def check_part(part: PartTemperature) -> None:
    """Raise InputError for an implausible or, if compensating, a missing part property."""
    if part.now is not None:
        check_temperature("part", part.now)
    if not part.compensated:
        return
    if part.now is None:
        raise InputError(
            "temperature.part_unknown",
            "Reporting at 20 °C needs the part temperature, which is not given.",
            "Measure and give it, or do not compensate the part (Settings, Temperature).",
        )
    if part.expansion is None:
        raise InputError(
            "temperature.expansion_unknown",
            "Reporting at 20 °C needs the expansion of the part, which is unknown.",
            "Write its material into the plan ([material]), give its expansion, e.g. 11.5 for "
            "steel, or do not compensate the part (Settings, Temperature).",
        )


def reported_points(points: Sequence[MeasuredPoint], part: PartTemperature) -> list[MeasuredPoint]:
    """Return points as reported: at 20 °C if the part is compensated."""
    scale = part.scale
    if scale == 1.0:
        return list(points)
    return [
        replace(
            point,
            tip_world=scale * point.tip_world,
            tip_radius=scale * point.tip_radius,
            random_covariance=scale**2 * point.random_covariance,
        )
        for point in points
    ]


def scale_movement(points: Sequence[MeasuredPoint]) -> Float:
    """Return the derivative of all points and the radius by the part scale, (3 N + 1,), mm.

    In the order of `measuring.joint_factors`. One scale is common to all points, so its uncertainty
    grows with lengths, not with the position of the part.
    """
    return np.concatenate([*(p.tip_world for p in points), [points[0].tip_radius]])


def _probe_words(probe: TemperatureState) -> str:
    if probe.now is None:
        return "Probe: no temperature given, not compensated."
    made = "" if probe.made is None else f", calibrated at {probe.made.celsius:.1f} °C"
    done = "compensated" if probe.compensated else "not compensated"
    return f"Probe: {probe.now.celsius:.1f} ± {probe.now.sigma_k:.1f} °C{made}, {done}."


def _part_words(part: PartTemperature) -> str:
    if part.now is None:
        return "Part: no temperature given, not compensated."
    warm = f"Part: {part.now.celsius:.1f} ± {part.now.sigma_k:.1f} °C"
    if not part.compensated or part.expansion is None:
        return f"{warm}, not compensated: results are at this part temperature."
    growth, sigma = _PPM * part.expansion.per_k, _PPM * part.expansion.sigma_per_k
    return (
        f"{warm}, results reported at 20 °C with {growth:.1f} ± {sigma:.1f} ppm/K "
        f"({part.expansion.name})."
    )
