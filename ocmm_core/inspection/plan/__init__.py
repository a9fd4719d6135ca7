"""The plan: its document, its checks, its changes, and imports.

In: a TOML document, a table in text, or the measurement of a master part. Out: a checked plan, and
TOML that reads back to the same plan.

Read `_plan` (features and characteristics), `_file` (the document, released by name, in a folder or
a job), `_findings` (contradictions), `_environment` (required and noted ambient
conditions), `_edit` (changes: a plan in, another one out; teaching), `_file_beside` (pictures, and
the model of the part that is shown). Imports: `_csv` (tables); `_requirements` keeps the account of
imported files. It must not know points or sessions.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.inspection.plan._csv import FeatureTable, feature_table
    from ocmm_core.inspection.plan._edit import (
        EDITED, HEAD_FIELDS, add_characteristic, add_construction, add_feature, move_item, new_plan,
        remove_item, replace_item, taught_plan, usual_points, with_alignment, with_head,
    )  # fmt: skip
    from ocmm_core.inspection.plan._environment import (
        EnvironmentLimits, NotedRoom, environment_doubt, environment_words, note_room_in,
        noted_rooms,
    )  # fmt: skip
    from ocmm_core.inspection.plan._file import (
        PlanSummary, list_plans, note_release, plan_card, plan_release, release_in_job,
        release_plan, require_released, save_plan, stored_plan,
    )  # fmt: skip
    from ocmm_core.inspection.plan._file_beside import (
        PartOfPlan, carry_model, carry_pictures, part_of_plan, with_model, with_picture,
        without_file,
    )  # fmt: skip
    from ocmm_core.inspection.plan._findings import PlanFinding, plan_findings, require_consistent
    from ocmm_core.inspection.plan._plan import (
        MAX_EXPANSION_PPM, CadModel, Material, Plan, check_plan, climate_for, load_plan,
        material_expansion, read_plan, step_fault,
    )  # fmt: skip
    from ocmm_core.inspection.plan._requirements import (
        PlanSource, Requirement, RequirementState, requirement_count, requirement_states, source_of,
        with_requirements,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "EDITED", "HEAD_FIELDS", "MAX_EXPANSION_PPM", "CadModel", "EnvironmentLimits", "FeatureTable",
    "Material", "NotedRoom", "PartOfPlan", "Plan", "PlanFinding", "PlanSource", "PlanSummary",
    "Requirement", "RequirementState", "add_characteristic", "add_construction", "add_feature",
    "carry_model", "carry_pictures", "check_plan", "climate_for", "environment_doubt",
    "environment_words", "feature_table", "list_plans", "load_plan", "material_expansion",
    "move_item", "new_plan", "note_release", "note_room_in", "noted_rooms", "part_of_plan",
    "plan_card", "plan_findings", "plan_release", "read_plan", "release_in_job", "release_plan",
    "remove_item", "replace_item", "require_consistent", "require_released", "requirement_count",
    "requirement_states", "save_plan", "source_of", "step_fault", "stored_plan", "taught_plan",
    "usual_points", "with_alignment", "with_head", "with_model", "with_picture",
    "with_requirements", "without_file",
]  # fmt: skip
