"""Thermal expansion of a plan's part."""

from __future__ import annotations

from dataclasses import replace

from ocmm_core.calibration.probe_design import MaterialExpansion
from ocmm_core.inspection.plan._plan import Plan
from ocmm_core.measuring import Climate, check_part

_PPM = 1e-6


def material_expansion(plan: Plan) -> MaterialExpansion | None:
    """Return the expansion of the plan's material; None without material."""
    material = plan.material
    if material is None:
        return None
    return MaterialExpansion(
        material.name, _PPM * material.expansion_ppm, _PPM * material.expansion_sigma_ppm
    )


def climate_for(climate: Climate, before: Plan, plan: Plan) -> Climate:
    """Return the climate of a job after a change of the plan.

    The operator's expansion is kept, the plan's replaced by the new one. InputError if results are
    to be reported at 20 °C, and the plan names no material.
    """
    if climate.part.expansion != material_expansion(before):
        return climate
    part = replace(climate.part, expansion=material_expansion(plan))
    check_part(part)
    return replace(climate, part=part)
