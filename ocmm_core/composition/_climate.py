"""Temperatures and expansion of a job."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.acceptance import read_temperature
from ocmm_core.calibration.probe_design import (
    UNMEASURED_K,
    ContactForce,
    MaterialExpansion,
    Temperature,
    TemperatureState,
    body_in_use,
    check_temperature,
    contact_force,
    load_design,
    require_temperature,
)
from ocmm_core.calibration.records import ProbeRecord
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import MAX_EXPANSION_PPM, Plan, material_expansion
from ocmm_core.measuring import Climate, PartTemperature, check_part
from ocmm_core.tables import typed_number
from ocmm_core.tracking import ProbeBody

_PPM = 1e-6
_SIGMA_PPM = 1.0
"""1e-6/K; expansion from a handbook (ISO/TR 16015)."""
_GIVEN = "given by the operator"


@dataclass(frozen=True, slots=True)
class ClimateRequest:
    """Requested temperatures; None if unknown."""

    probe_design: Path | None = None
    probe_c: float | None = None
    part_c: float | None = None
    """`probe_c`, `part_c`: °C."""
    sigma_k: float | None = None
    """Standard uncertainty of each temperature, K; required with a temperature."""
    part_expansion_ppm: float | None = None
    """1e-6/K; None for the material of the plan."""
    compensate_probe: bool = False
    compensate_part: bool = False
    thermometer: str = _GIVEN
    """That both temperatures were read by."""
    stated_u: str = ""
    """Instead of ``sigma_k``: U (k = 2) of the thermometer in kelvin, or its id in the register.

    A part temperature that compensation needs and that is not typed is read by its source.
    """


@dataclass(frozen=True, slots=True)
class ClimateInUse:
    """Climate, probe and contact force of a job."""

    climate: Climate
    body: ProbeBody
    """Probe with its geometry as used."""
    contact: ContactForce | None
    """Effect of the probing force; None without a design document."""


def climate_in_use(
    request: ClimateRequest, plan: Plan, body: ProbeBody, calibration: ProbeRecord | None
) -> ClimateInUse:
    """Return the climate of a job.

    `calibration`: its record, with the temperature at calibration; None if the document is used.
    InputError: a document or number is invalid, or a value needed for compensation is missing.
    """
    request = _with_thermometer(request)
    part = PartTemperature(
        _temperature(request, "part", request.part_c),
        _expansion(request.part_expansion_ppm, plan),
        request.compensate_part,
    )
    check_part(part)
    now = _temperature(request, "probe", request.probe_c)
    if now is not None:
        check_temperature("probe", now)
    if request.probe_design is None:
        if request.compensate_probe:
            raise InputError(
                "temperature.design_unknown",
                "Compensating the probe needs its materials, which are unknown.",
                "Give its design, or do not compensate the probe (Settings, Temperature).",
            )
        return ClimateInUse(Climate(TemperatureState(now), part), body, None)
    design = load_design(request.probe_design, body)
    made = None
    sigma_k = UNMEASURED_K if request.sigma_k is None else request.sigma_k
    if calibration is not None and calibration.temperature_c is not None:
        made = Temperature(calibration.temperature_c, sigma_k, "record of the calibration")
    elif calibration is None and design.reference_temperature_c is not None:
        made = Temperature(design.reference_temperature_c, sigma_k, "design of the probe")
    temperature_state = TemperatureState(now, made, request.compensate_probe)
    return ClimateInUse(
        Climate(temperature_state, part, design.text),
        body_in_use(body, design, temperature_state),
        contact_force(design, body),
    )


def _with_thermometer(request: ClimateRequest) -> ClimateRequest:
    """Return a request with the uncertainty and the name of its thermometer."""
    if not request.stated_u.strip():
        return request
    if request.sigma_k is not None:
        raise InputError(
            "temperature.u_twice",
            "The uncertainty of the thermometer is given twice.",
            "Give U (k = 2) or the id of the thermometer, or the standard uncertainty (Settings, "
            "Temperature).",
        )
    read = [
        read_temperature(celsius, request.stated_u, datetime.now(UTC))
        for celsius in (request.probe_c, request.part_c)
        if celsius is not None
    ]
    found = next((one for one in read if one is not None), None)
    by_source = typed_number(request.stated_u, comma=False) is None
    if request.part_c is None and request.compensate_part and by_source:
        # As in a calibration without a typed temperature.
        found = read_temperature(None, request.stated_u, datetime.now(UTC))
        request = replace(request, part_c=None if found is None else found.celsius)
    if found is None:
        return request
    return replace(request, sigma_k=found.sigma_k, thermometer=found.origin or _GIVEN)


def _temperature(request: ClimateRequest, what: str, celsius: float | None) -> Temperature | None:
    if celsius is None:
        return None
    require_temperature(what, celsius)
    if request.sigma_k is None:
        raise InputError(
            "temperature.u_missing",
            f"The temperature of the {what} is given without the uncertainty of its thermometer.",
            "Give its standard uncertainty in kelvin (Settings, Temperature), half of U (k = 2) of "
            "its certificate.",
        )
    return Temperature(celsius, request.sigma_k, request.thermometer)


def _expansion(given_ppm: float | None, plan: Plan) -> MaterialExpansion | None:
    if given_ppm is not None:
        if not abs(given_ppm) <= MAX_EXPANSION_PPM:
            raise InputError(
                "temperature.expansion",
                f"The expansion of the part is given as {given_ppm:g} 1e-6/K.",
                "Give it in 1e-6/K, e.g. 11.5 for steel or 23.1 for aluminium (Settings, "
                "Temperature).",
            )
        return MaterialExpansion(_GIVEN, _PPM * given_ppm, _PPM * _SIGMA_PPM)
    return material_expansion(plan)
