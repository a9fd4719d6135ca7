"""Measurement system analysis: gauge R&R, type 1, linearity, suitability, and a test of stated U.

In: values of parts, operators and trials, or the jobs that hold them. Out: contribution of the
gauge.

Read `_gauge_rr` (analysis of variance) and `_single` (studies of one reference), `_from_jobs`
(plans in random, blind order; one study per characteristic of a plan, bias over the range) and
`_part_study` (U from a calibrated part, for similar parts only).
It must not know how a value was measured.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_shop.studies._from_jobs import (
        STUDY_SCHEMA, CharacteristicStudy, LinearityReport, StudyPlan, StudyReport, StudyRun,
        linearity_of, load_study, open_runs, plan_study, plan_text, require_balanced, store_plan,
        study_jobs, study_of,
    )  # fmt: skip
    from ocmm_shop.studies._gauge_rr import AIAG_LEVEL, GaugeStudy, SourceRow, gauge_study
    from ocmm_shop.studies._part_study import (
        AUDITED, CalibratedPart, PartStudy, load_part_study, load_task, make_part_study,
        part_procedure, save_part_study, uncertainty_for,
    )  # fmt: skip
    from ocmm_shop.studies._single import (
        LinearityStudy, StatedScatter, Suitability, Type1Study, compare_stated, linearity_study,
        process_uncertainty, suitability, type1_study,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "AIAG_LEVEL", "AUDITED", "STUDY_SCHEMA", "CalibratedPart", "CharacteristicStudy", "GaugeStudy",
    "LinearityReport", "LinearityStudy", "PartStudy", "SourceRow", "StatedScatter", "StudyPlan",
    "StudyReport", "StudyRun", "Suitability", "Type1Study", "compare_stated", "gauge_study",
    "linearity_of", "linearity_study", "load_part_study", "load_study", "load_task",
    "make_part_study", "open_runs", "part_procedure", "plan_study", "plan_text",
    "process_uncertainty", "require_balanced", "save_part_study", "store_plan", "study_jobs",
    "study_of", "suitability", "type1_study", "uncertainty_for",
]  # fmt: skip
