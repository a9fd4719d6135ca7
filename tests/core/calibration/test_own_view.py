"""Which LEDs the body of a probe hides, and that rig and targets know it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ocmm_cad.reach import Reach, Setting, make_obstacle
from ocmm_core.calibration.probe_design import (
    Panel,
    ProbeDesign,
    leds_behind_body,
    load_design,
    shipped_design,
)
from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.part_model import Placement
from ocmm_core.tracking import ProbeBody, load_probe
from ocmm_sim.scene import VirtualRig, load_part


def designed(name: str) -> tuple[ProbeBody, ProbeDesign]:
    body = load_probe(resource("probes", f"{name}.toml"))
    path = shipped_design(body)
    assert path is not None
    return body, load_design(path, body)


def in_the_middle() -> tuple[ProbeBody, ProbeDesign]:
    """Return the standard probe with its panel about the axis: three LEDs are behind it."""
    body, design = designed("standard")
    sections = tuple(
        replace(one, offset_mm=0.0) if isinstance(one, Panel) else one for one in design.sections
    )
    return body, replace(design, sections=sections)


@pytest.mark.parametrize("name", sorted(p.stem for p in resource("designs").glob("*.toml")))
def test_no_shipped_probe_hides_an_led(name: str) -> None:
    assert leds_behind_body(*designed(name)) == ()


def test_a_panel_hides_what_is_behind_it() -> None:
    body, design = in_the_middle()
    behind = leds_behind_body(body, design)
    assert behind == tuple(np.flatnonzero(body.leds_probe[:, 1] > 0.0).tolist()) == (1, 3, 5)


def test_targets_count_on_no_led_that_the_body_hides() -> None:
    low, high = np.array([-30.0, -30.0, -10.0]), np.array([30.0, 30.0, 0.0])
    top = np.array([[low[0], low[1], 0], [high[0], low[1], 0], [high[0], high[1], 0.0]])
    other = np.array([[low[0], low[1], 0], [high[0], high[1], 0], [low[0], high[1], 0.0]])
    obstacle = make_obstacle(np.array([top, other]), np.zeros(2, dtype=np.int64), 1, 0.01)
    rig = load_rig(resource("rigs", "recommended.toml"))
    for (body, design), seen in ((designed("standard"), True), (in_the_middle(), False)):
        setting = Setting(body, design, rig, Placement())
        reach = Reach(obstacle, 3.0, setting, np.empty((0, 3)))
        found = reach.evaluate(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), [0])
        assert (found.stage[0] == 0) == seen
        if not seen:
            assert reach.why_not(found) == (
                "two cameras see 3 LEDs of the probe there, 4 are needed"
            )


def test_the_virtual_rig_shows_no_led_that_the_body_hides(tmp_path: Path) -> None:
    body, design = in_the_middle()
    rig = load_rig(resource("rigs", "recommended.toml"))
    part = load_part(resource("parts", "demo.toml"))
    touches = ((part.artefacts[0].name, 1),)
    hidden = leds_behind_body(body, design)
    made = VirtualRig(rig, body, part, touches, 1, frame_rate_hz=100, behind_body=hidden)
    free = VirtualRig(rig, body, part, touches, 1, frame_rate_hz=100)
    for camera in range(2):
        seen, _ = made.led_images(camera, 0, 100)
        all_seen, _ = free.led_images(camera, 0, 100)
        assert not seen[:, list(hidden)].any()
        assert all_seen[:, list(hidden)].any()
        shown = [n for n in range(body.n_leds) if n not in hidden]
        np.testing.assert_array_equal(seen[:, shown], all_seen[:, shown])
