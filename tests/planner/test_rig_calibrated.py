"""U of a rig as calibrated, over that of its plan."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_planner import RigSheet, evaluate_plan, maps_of, predict_map, scene_of
from tests.planner.rig_scenes import changed, given_plan


def compared(nodes: tuple[int, int, int], scale: float = 1.0) -> tuple[RigSheet, list[float]]:
    """Return a plan with cameras moved and turned, and the prediction of that placement."""
    plan = changed(given_plan(), nodes=nodes)
    moved = plan.places.copy()
    moved[0, :3] += [-30.0, 40.0, 0.0]
    moved[1, 3:] += [0.0, 0.0, 20.0]
    rig = plan.rig(moved)
    rig = replace(rig, parameter_covariance=scale * rig.parameter_covariance)
    sheet = evaluate_plan(plan, seed=1, evaluations=0, calibrated=rig)
    there = predict_map(scene_of(plan, moved), plan.nodes(nodes))
    return sheet, [1e3 * value for value in there.u_tip.tolist()]


def test_a_rig_as_planned_elsewhere_has_the_u_of_that_placement() -> None:
    sheet, there = compared((3, 2, 3))
    found = sheet.calibrated
    assert found is not None
    assert [value for value in found.u_um if value] == pytest.approx(
        [value for value in there if np.isfinite(value)], abs=1e-3
    )
    assert found.away_mm == pytest.approx((50.0, 0.0), abs=1e-9)
    aim = np.array([-165.0, 1000.0, 0.0])
    turned = np.degrees(np.arctan2(20.0, np.linalg.norm(aim)))
    assert found.turned_deg[1] == pytest.approx(turned, abs=1e-6)
    assert [one.space_um.shape for one in maps_of(sheet)] == [(2, 3), (3, 3)] * 2


def test_a_worse_calibration_shows() -> None:
    good, bad = (compared((3, 1, 3), scale)[0].calibrated for scale in (1.0, 9.0))
    assert good is not None
    assert bad is not None
    assert good.ratios is not None
    assert bad.ratios is not None
    # Calibration dominates, so that three times its uncertainty is nearly three times U.
    assert 2.0 < bad.ratios[0] / good.ratios[0] < 3.0


def test_another_rig_is_refused() -> None:
    plan, rig = given_plan(), load_rig(resource("rigs", "thesis.toml"))
    other = replace(rig, cameras=(rig.cameras[0], replace(rig.cameras[1], width=1024)))
    for wrong in (other, load_rig(resource("rigs", "tracker.toml"))):
        assert not plan.describes(wrong)
        with pytest.raises(InputError, match="sensors are not those of rig"):
            evaluate_plan(plan, seed=1, evaluations=0, calibrated=wrong)
