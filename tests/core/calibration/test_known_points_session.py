"""Results of the guided calibration from known points that enter the calculation."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from ocmm_core.calibration.cameras import KnownPointsProcedure, KnownPointsSetup, calibrate_rig
from ocmm_core.calibration.guided import SessionSite
from ocmm_core.calibration.records import CalibrationStore
from ocmm_core.tracking import load_probe
from tests.core.calibration.known_points import observe, rig
from tests.core.calibration.procedure_site import PROBE_DOCUMENT

NOW = datetime(2026, 3, 1, 8, tzinfo=UTC)


def test_a_session_keeps_all_of_the_list(tmp_path: Path) -> None:
    points, spots = observe(rig(), 60, 200.0, 1, reference_sigma=0.0017)
    points = replace(points, length_sigma=3e-5)
    store = CalibrationStore(tmp_path / "store")
    site = SessionSite(tmp_path, rig(), load_probe(PROBE_DOCUMENT), store.folder)
    begun = KnownPointsProcedure.start(site, KnownPointsSetup(who="Ada", points=points), NOW)
    begun.take_table(spots, NOW)
    again = KnownPointsProcedure.resume(site, begun.base.session)
    again.compute()
    outcome = again.view.outcome
    assert outcome is not None
    expected = calibrate_rig(rig(), points, spots)
    assert np.array_equal(np.array(outcome.record.covariance), expected.covariance)
    assert outcome.record.cameras[0].focal == expected.cameras[0].model.focal
