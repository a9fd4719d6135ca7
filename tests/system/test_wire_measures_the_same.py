"""A plan over the whole wire gives the results of the virtual rig in this process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ocmm_cli.measure import run_job
from ocmm_cli.terminal import make_console
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.inspection.evaluation import JobView
from tests.host import private_network
from tests.short_plan import wire_plan_in

RESOLUTION_MM = 1e-5
"""Spots on the wire are rounded to 2^-16 px: 4.4e-6 px RMS, 2e-7 mm at the LEDs, independent from
frame to frame, a few times that at the ball. Ten times what one frame could do is allowed."""


def measured(source: str, plan: Path, out: Path) -> tuple[JobView, dict[str, int]]:
    request = StationRequest(plan=plan, out=out, source=source, seed=4)
    built = build_station(request)
    view = run_job(built, out, make_console())
    status = built.station.looks.acquisition()
    names = ("elapsed", "good", "late", "lost", "bad", "frames", "frames_lost", "overrun")
    counts = {name: getattr(status, name) for name in names}
    return view, counts


@pytest.mark.slow
@pytest.mark.timing
def test_the_wire_gives_the_features_of_the_virtual_rig_in_this_process(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    private_network()
    plan = wire_plan_in(tmp_path)
    direct, _ = measured("simulated", plan, tmp_path / "direct")
    wired, counts = measured("ethercat:virtual", plan, tmp_path / "wired")

    assert counts["elapsed"] == sum(counts[key] for key in ("good", "late", "lost", "bad"))
    record_property("cycles and frames", counts)
    # A pause longer than the cameras' buffer loses frames, and with them a little of the average;
    # then the features agree within their uncertainty only.
    lost = counts["frames_lost"] + counts["overrun"]
    for ours, theirs in zip(direct.features, wired.features, strict=True):
        assert len(ours.points) == len(theirs.points) == ours.needed
        for one, other in zip(ours.points, theirs.points, strict=True):
            apart = float(np.linalg.norm(one.tip_world - other.tip_world))
            if one.n_frames == other.n_frames and one.first_frame == other.first_frame:
                assert apart < RESOLUTION_MM
            else:
                assert lost > 0
    for ours_, theirs_ in zip(direct.characteristics, wired.characteristics, strict=True):
        assert ours_.measured is not None
        assert theirs_.measured is not None
        assert ours_.uncertainty is not None
        limit = RESOLUTION_MM if lost == 0 else ours_.uncertainty
        assert abs(ours_.measured - theirs_.measured) < limit
        assert ours_.verdict is theirs_.verdict
