"""Acceptance and reverification tests: procedures, engine, sealed records.

In: a procedure, artefacts, ball centres in plan order, temperatures.
Out: a plan, objections to recorded points, judged values, and a record.

Start with `_procedure` (documents, limits), `_result` (record) and `_values` (pure statistics of
points), then `_kinds` (one entry per kind: planned by `_planning`, judged by `_evaluating` and
`_placement`), `_session` (engine, a chain of events folded by `_session_state`; signed records and
their recomputation) and `_guards`. `_offers` lists the choices before a test, `_guided` is a test
as a guided procedure. `_register` holds the artefacts, `_thermometers` reads temperatures
(`_temperature_source`), `_interim` the chart of interim checks. It must not depend on the source of
ball centres: cameras, recording or simulation.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.acceptance._guards import EarlierUse, reserved_spots, spots_hash
    from ocmm_core.acceptance._guided import (
        AcceptanceOutcome, AcceptanceProcedure, GuidedAcceptanceView, worst_value,
    )  # fmt: skip
    from ocmm_core.acceptance._interim import (
        INTERIM, ChartPoint, InterimChart, InterimCheck, InterimHistory, InterimWord, interim_chart,
        note_check,
    )  # fmt: skip
    from ocmm_core.acceptance._kinds import KINDS, kind_of, plan_of, values_of
    from ocmm_core.acceptance._offers import (
        RECORDS, SESSIONS, ArtefactOffer, FinishedTest, OpenTest, ProcedureOffer, finished_tests,
        offered_artefacts, offered_procedures, open_tests, typed_entry,
    )  # fmt: skip
    from ocmm_core.acceptance._procedure import (
        ClimateRule, InterimTest, Mpe, PartTest, ProcedureDocument, find_procedure, load_procedure,
        procedure_files,
    )  # fmt: skip
    from ocmm_core.acceptance._register import (
        ARTEFACT_KINDS, ARTEFACT_SCHEMA, NOT_SIGNED_REMEDY, ArtefactEntry, ArtefactKind,
        ArtefactRegister, load_artefact, load_used, used_bar, used_sphere,
    )  # fmt: skip
    from ocmm_core.acceptance._result import (
        AcceptanceRecord, AcceptanceVerdict, ClimateReading, InstrumentState, JudgedValue,
        Observation, PlannedPosition, QuantityResult, RefusedPoint, RoomAir, UsedArtefact,
    )  # fmt: skip
    from ocmm_core.acceptance._session import (
        AcceptanceSession, chain_history, differences, load_signed_record, recompute,
        recompute_tips, save_record,
    )  # fmt: skip
    from ocmm_core.acceptance._session_state import AcceptanceView
    from ocmm_core.acceptance._situation import Situation, Stage, judge
    from ocmm_core.acceptance._temperature_source import (
        LoggedTemperature, TemperatureSource, ThermometerLog,
    )  # fmt: skip
    from ocmm_core.acceptance._thermometers import read_temperature, thermometer_log
    from ocmm_core.acceptance._values import (
        PartTask, PartUncertainty, SpatValues, SphereValues, VolumetricValues, block_length,
        dissimilar, faces_normal, location_value, nest_lengths, part_uncertainty, repeat_ranges,
        smallest_ball, spat_values, sphere_values, thickness, volumetric_values,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ARTEFACT_KINDS", "ARTEFACT_SCHEMA", "INTERIM", "KINDS", "NOT_SIGNED_REMEDY", "RECORDS",
    "SESSIONS", "AcceptanceOutcome", "AcceptanceProcedure", "AcceptanceRecord", "AcceptanceSession",
    "AcceptanceVerdict", "AcceptanceView", "ArtefactEntry", "ArtefactKind", "ArtefactOffer",
    "ArtefactRegister", "ChartPoint", "ClimateReading", "ClimateRule", "EarlierUse", "FinishedTest",
    "GuidedAcceptanceView", "InstrumentState", "InterimChart", "InterimCheck", "InterimHistory",
    "InterimTest", "InterimWord", "JudgedValue", "LoggedTemperature", "Mpe", "Observation",
    "OpenTest", "PartTask", "PartTest", "PartUncertainty", "PlannedPosition", "ProcedureDocument",
    "ProcedureOffer", "QuantityResult", "RefusedPoint", "RoomAir", "Situation", "SpatValues",
    "SphereValues", "Stage", "TemperatureSource", "ThermometerLog", "UsedArtefact",
    "VolumetricValues", "block_length", "chain_history", "differences", "dissimilar",
    "faces_normal", "find_procedure", "finished_tests", "interim_chart", "judge", "kind_of",
    "load_artefact", "load_procedure", "load_signed_record", "load_used", "location_value",
    "nest_lengths", "note_check", "offered_artefacts", "offered_procedures", "open_tests",
    "part_uncertainty", "plan_of", "procedure_files", "read_temperature", "recompute",
    "recompute_tips", "repeat_ranges", "reserved_spots", "save_record", "smallest_ball",
    "spat_values", "sphere_values", "spots_hash", "thermometer_log", "thickness", "typed_entry",
    "used_bar", "used_sphere", "values_of", "volumetric_values", "worst_value",
]  # fmt: skip
