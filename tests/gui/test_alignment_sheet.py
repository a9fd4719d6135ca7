"""The sheet of the alignment: the job uses the accepted one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ocmm_core.alignment import AlignmentReport, Residual
from ocmm_core.geometry import RigidTransform
from tests.generated_jobs import generated_job

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow


def test_a_frame_is_not_accepted_for_points_that_have_changed_since(
    open_window: OpenWindow,
) -> None:
    bench = open_window(start=False)
    job = next(
        job
        for job, _ in map(generated_job, range(20))
        if len(job.features) > 1 and all(item.points for item in job.features[:2])
    )
    used, other = job.features[:2]
    placed = RigidTransform(np.eye(3), np.zeros(3))
    residual = Residual(used.name, True, np.zeros(3), 0.0, None, 0.0)
    report = AlignmentReport("frame of the part", placed, placed, (residual,), (), None, None, ())
    sheet = bench.window.sheets.alignment
    bench.bridge.shown.job = job
    sheet._of = job  # noqa: SLF001 - as if it had been computed from this job
    sheet._on_report(report)  # noqa: SLF001
    assert sheet.state.text() == "Fully constrained"
    assert sheet.keys["accept"].isEnabled()

    def without_a_point_of(name: str) -> None:
        features = tuple(
            replace(item, points=item.points[1:]) if item.name == name else item
            for item in job.features
        )
        bench.window.sheets.job_changed(replace(job, features=features))

    # It does not rest on this one.
    without_a_point_of(other.name)
    assert sheet.keys["accept"].isEnabled()
    without_a_point_of(used.name)
    assert "have changed" in sheet.state.text()
    assert not sheet.keys["accept"].isEnabled()
    told: list[str] = []
    sheet.told.connect(told.append)
    sheet.accept()
    assert told == ["No alignment to accept yet."]
