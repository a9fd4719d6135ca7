"""Jobs on the virtual wire are completed: refused touches are repeated, no sound probe is bent."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ocmm_cli.measure import run_job
from ocmm_cli.terminal import make_console
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.measuring import Refusal
from ocmm_sim.scene import ScriptedOcclusion, WorldOptions
from tests.commands import Ocmm
from tests.host import long_form, private_network
from tests.short_plan import TOUCHES, ball_plan_in

HIDDEN = ScriptedOcclusion(-1, tuple(range(8)), 3000, 5000)
"""All LEDs, for two seconds at 1 kHz: at least one whole touch."""


@pytest.mark.slow
@pytest.mark.timing
def test_repeats_refused_touches(tmp_path: Path) -> None:
    private_network()
    source = "ethercat:pixels" if long_form() else "ethercat:virtual"
    built = build_station(
        StationRequest(
            plan=ball_plan_in(tmp_path), out=tmp_path, source=source, frame_rate_hz=1000,
            world=WorldOptions(occlusions=(HIDDEN,)),
        )
    )  # fmt: skip
    assert built.virtual is not None
    before = built.virtual.n_frames
    refused: list[Refusal] = []
    built.station.events.point_refused.connect(refused.append)
    view = run_job(built, tmp_path, make_console())

    assert refused
    assert view.part_verdict.complete
    assert built.virtual.n_frames > before
    (ball,) = view.features
    places = np.array([point.tip_world for point in ball.points])
    assert len(places) == TOUCHES
    apart = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(TOUCHES, 1)]
    # Each place once: the missing ones, not others again.
    assert apart.min() > 1.0


@pytest.mark.slow
@pytest.mark.timing
@pytest.mark.timeout(1800)
def test_demo_with_rendered_cameras_conforms(ocmm_here: Ocmm, tmp_path: Path) -> None:
    private_network()
    # The whole part takes two minutes of frames; its errors of pixels once meant a bent LED.
    plan: tuple[str | Path, ...] = () if long_form() else ("--plan", ball_plan_in(tmp_path))
    done = ocmm_here("demo", "--headless", "--source", "ethercat:pixels", "--seed", "22", *plan)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "PART CONFORMS"
