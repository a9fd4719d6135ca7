"""A touch meant for a feature of the previous plan does not enter the next plan."""

from __future__ import annotations

import numpy as np

from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import Progress, SessionOptions
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session._assignment import NominalPlace, assign_touch
from ocmm_core.inspection.session._touch_filter import Contact, TouchAssignment
from ocmm_core.measuring import Refusal, RefusalCode


def _meant(wanted: str) -> TouchAssignment | Refusal:
    plan = load_plan(resource("plans", "quick.toml"))
    progress = Progress(tuple(feature.name for feature in plan.features), active="BED")
    contact = Contact(np.zeros(3), (), 3.0, 1.5)
    nominals = NominalPlace(plan, (), SessionOptions())
    return assign_touch(plan, progress, contact, nominals, wanted=wanted, selected="")


def test_a_touch_for_a_feature_that_the_plan_does_not_have_is_refused() -> None:
    refused = _meant("BORE_A")
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.NO_FEATURE
    assert "BORE_A" in refused.what
    assert _meant("SPHERE") == TouchAssignment("SPHERE", "approach", None)
