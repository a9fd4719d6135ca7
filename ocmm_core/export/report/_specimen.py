"""Empty report, to preview a template without a job."""

from __future__ import annotations

from ocmm_core.documents import read_text, resource
from ocmm_core.export.report._report_data import Instrument, ReportData, report_data
from ocmm_core.inspection.evaluation import FeatureState, FeatureView, JobView
from ocmm_core.inspection.plan import load_plan
from ocmm_core.measuring import Climate
from ocmm_core.storage import JobHead
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict

_PLAN = ("plans", "quick.toml")
_NAME = "SPECIMEN"
_NO_JOB = "00000000-0000-0000-0000-000000000000"


def specimen_report() -> ReportData:
    """Return the report of an untouched part: all NOT MEASURED, no number made up, SIMULATED."""
    path = resource(*_PLAN)
    plan = load_plan(path)
    head = JobHead(
        job_uuid=_NO_JOB, created_utc="", software_version="", operator="", part=_NAME, serial="",
        plan_text=read_text(path), rig_text="", probe_text="",
    )  # fmt: skip
    view = JobView(
        job=_NAME,
        part=_NAME,
        operator="",
        features=tuple(
            FeatureView(one.name, one.shape, one.points, FeatureState.PENDING, (), None, "")
            for one in plan.features
        ),
        active="",
        characteristics=tuple(
            CharacteristicResult(
                name=one.name, kind=one.kind, features=tuple(one.features), nominal=one.nominal,
                lower=one.lower, upper=one.upper, measured=None, deviation=None, uncertainty=None,
                verdict=Verdict.NOT_MEASURED,
            )
            for one in plan.characteristics
        ),
        refusal=None,
        complete=False,
        requirements=None,
        simulated=True,
    )  # fmt: skip
    return report_data(
        view, head, plan, T_part_from_world=None, calibration=Instrument(""), probe=Instrument(""),
        reference=Instrument(""), climate=Climate(),
    )  # fmt: skip
