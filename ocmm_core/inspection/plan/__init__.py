"""The plan: its document, its checks, its changes, and imports.

In: a TOML document, a table in text, or the measurement of a master part. Out: a checked plan, and
TOML that reads back to the same plan.

Read `_plan` (features and characteristics), `_file` (the document), `_step_checks` and `_findings`
(contradictions), `_environment` (required and noted ambient conditions), `_edit` (changes: a plan
in, another one out), `_shelf` (plans of a folder), `_file_beside` (files that it names),
`_picture`, `_cad_model` (the part that is shown). Imports: `_csv`, `_teach` and `_surface_profile`
(of faces of the model). `_stored_plan` reads the plan of a job file; `_plan_release` releases a
plan by name; `_requirements` keeps the account of imported files. It must not know points or
sessions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.inspection.plan._cad_model import (
        PartOfPlan,
        carry_model,
        part_of_plan,
        with_model,
        without_model,
    )
    from ocmm_core.inspection.plan._climate import climate_for, material_expansion
    from ocmm_core.inspection.plan._csv import FeatureTable, feature_table
    from ocmm_core.inspection.plan._edit import (
        EDITED,
        HEAD_FIELDS,
        add_characteristic,
        add_construction,
        add_feature,
        move_item,
        new_plan,
        remove_item,
        replace_item,
        usual_points,
        with_alignment,
        with_head,
    )
    from ocmm_core.inspection.plan._environment import (
        ENVIRONMENT_EVENT,
        EnvironmentLimits,
        NotedRoom,
        environment_doubt,
        environment_words,
        note_room_in,
        noted_rooms,
    )
    from ocmm_core.inspection.plan._file import save_plan
    from ocmm_core.inspection.plan._findings import PlanFinding, plan_findings, require_consistent
    from ocmm_core.inspection.plan._picture import carry_pictures, with_picture, without_file
    from ocmm_core.inspection.plan._plan import (
        MAX_EXPANSION_PPM,
        CadModel,
        Material,
        Plan,
        check_plan,
        load_plan,
    )
    from ocmm_core.inspection.plan._plan_release import (
        RELEASE_EVENT,
        note_release,
        plan_release,
        release_in_job,
        release_plan,
        require_released,
    )
    from ocmm_core.inspection.plan._requirements import (
        PlanSource,
        Requirement,
        RequirementState,
        requirement_count,
        requirement_states,
        source_of,
        with_requirements,
    )
    from ocmm_core.inspection.plan._shelf import PlanSummary, list_plans, plan_card
    from ocmm_core.inspection.plan._step_checks import step_fault
    from ocmm_core.inspection.plan._stored_plan import stored_plan
    from ocmm_core.inspection.plan._surface_profile import (
        USUAL_BALL_RADIUS,
        surface_profile,
        with_model_fit,
        with_profiles,
    )
    from ocmm_core.inspection.plan._teach import taught_plan
else:
    __getattr__ = door(
        __name__,
        _cad_model="PartOfPlan carry_model part_of_plan with_model without_model",
        _climate="climate_for material_expansion",
        _csv="FeatureTable feature_table",
        _edit=(
            "EDITED HEAD_FIELDS add_characteristic add_construction add_feature move_item "
            "new_plan remove_item replace_item usual_points with_alignment with_head"
        ),
        _environment=(
            "ENVIRONMENT_EVENT EnvironmentLimits NotedRoom environment_doubt environment_words "
            "note_room_in noted_rooms"
        ),
        _file="save_plan",
        _findings="PlanFinding plan_findings require_consistent",
        _picture="carry_pictures with_picture without_file",
        _plan="CadModel MAX_EXPANSION_PPM Material Plan check_plan load_plan",
        _plan_release=(
            "RELEASE_EVENT note_release plan_release release_in_job release_plan require_released"
        ),
        _requirements=(
            "PlanSource Requirement RequirementState requirement_count requirement_states "
            "source_of with_requirements"
        ),
        _shelf="PlanSummary plan_card list_plans",
        _step_checks="step_fault",
        _stored_plan="stored_plan",
        _surface_profile="USUAL_BALL_RADIUS surface_profile with_model_fit with_profiles",
        _teach="taught_plan",
    )

__all__ = [
    "EDITED", "ENVIRONMENT_EVENT", "HEAD_FIELDS", "MAX_EXPANSION_PPM", "RELEASE_EVENT",
    "USUAL_BALL_RADIUS", "CadModel", "EnvironmentLimits", "FeatureTable", "Material", "NotedRoom",
    "PartOfPlan", "Plan", "PlanFinding", "PlanSource", "PlanSummary", "Requirement",
    "RequirementState", "add_characteristic", "add_construction", "add_feature", "carry_model",
    "carry_pictures", "check_plan", "climate_for", "environment_doubt", "environment_words",
    "feature_table", "list_plans", "load_plan", "material_expansion", "move_item", "new_plan",
    "note_release", "note_room_in", "noted_rooms", "part_of_plan", "plan_card", "plan_findings",
    "plan_release", "release_in_job", "release_plan", "remove_item", "replace_item",
    "require_consistent", "require_released", "requirement_count", "requirement_states",
    "save_plan", "source_of", "step_fault", "stored_plan", "surface_profile", "taught_plan",
    "usual_points", "with_alignment", "with_head", "with_model", "with_model_fit", "with_picture",
    "with_profiles", "with_requirements", "without_file", "without_model",
]  # fmt: skip
