"""Acceptance and reverification tests: procedures as documents, one engine, sealed records.

In: a procedure, artefacts, ball centres in the order of the plan, temperatures.
Out: a plan, what is wrong with what was taken, judged values, and a record.

Read `_procedure` (documents, limits), `_result` (what a test leaves) and `_values` (pure statistics
of points), then what the tests do.
It must not know where a ball centre comes from: cameras, a recording or a simulation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.acceptance._part_u import (
        PartTask,
        PartUncertainty,
        dissimilar,
        part_uncertainty,
        share_within,
    )
    from ocmm_core.acceptance._procedure import (
        ClimateRule,
        Mpe,
        Procedure,
        find_procedure,
        load_procedure,
        procedure_files,
    )
    from ocmm_core.acceptance._result import (
        RECORD_SCHEMA,
        AcceptanceRecord,
        Climate,
        Instrument,
        JudgedValue,
        Observation,
        PlannedPosition,
        QuantityResult,
        Refusal,
        UsedArtefact,
        Verdict,
    )
    from ocmm_core.acceptance._values import (
        SpatValues,
        SphereValues,
        VolumetricValues,
        block_length,
        location_value,
        nest_lengths,
        repeat_ranges,
        smallest_ball,
        spat_values,
        sphere_values,
        thickness,
        volumetric_values,
    )
else:
    __getattr__ = door(
        __name__,
        _part_u="PartTask PartUncertainty dissimilar part_uncertainty share_within",
        _procedure="ClimateRule Mpe Procedure find_procedure load_procedure procedure_files",
        _result=(
            "AcceptanceRecord Climate Instrument JudgedValue Observation PlannedPosition "
            "QuantityResult RECORD_SCHEMA Refusal UsedArtefact Verdict"
        ),
        _values=(
            "SpatValues SphereValues VolumetricValues block_length location_value nest_lengths "
            "repeat_ranges smallest_ball spat_values sphere_values thickness volumetric_values"
        ),
    )

__all__ = [
    "RECORD_SCHEMA",
    "AcceptanceRecord",
    "Climate",
    "ClimateRule",
    "Instrument",
    "JudgedValue",
    "Mpe",
    "Observation",
    "PartTask",
    "PartUncertainty",
    "PlannedPosition",
    "Procedure",
    "QuantityResult",
    "Refusal",
    "SpatValues",
    "SphereValues",
    "UsedArtefact",
    "Verdict",
    "VolumetricValues",
    "block_length",
    "dissimilar",
    "find_procedure",
    "load_procedure",
    "location_value",
    "nest_lengths",
    "part_uncertainty",
    "procedure_files",
    "repeat_ranges",
    "share_within",
    "smallest_ball",
    "spat_values",
    "sphere_values",
    "thickness",
    "volumetric_values",
]
