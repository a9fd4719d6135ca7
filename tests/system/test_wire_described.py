"""Cameras that a file describes, on the virtual wire, without a line of code for them."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ocmm_cli.measure import run_job
from ocmm_cli.terminal import make_console
from ocmm_core.acquisition.frames import FrameBlock, read_status
from ocmm_core.camera import load_rig
from ocmm_core.composition import StationRequest, build_station, make_feed
from ocmm_core.documents import resource
from ocmm_core.fieldbus.described import Clock, load_device
from ocmm_core.inspection.plan import load_plan
from ocmm_sim.scene import VirtualRig
from ocmm_sim.sources import true_values
from tests.bit_device import bit_device
from tests.host import HANG_S, private_network
from tests.short_plan import wire_plan_in

# Processes must answer each other.
pytestmark = pytest.mark.timing

PLAN = resource("plans", "quick.toml")
_SEARCHED = 2000
"""Exposures of 250 us: half a second, more than a bring-up takes between two of its states."""


def rig_with(device: str, folder: Path) -> Path:
    """Return the recommended rig, whose cameras are those of a description."""
    text = resource("rigs", "recommended.toml").read_text()
    path = folder / f"rig-{Path(device).stem}.toml"
    path.write_text(
        text.replace("\nheight_px = 2048\n", f'\nheight_px = 2048\ndevice = "{device}"\n')
    )
    assert path.read_text().count("device =") == 2
    return path


@pytest.mark.parametrize(
    ("name", "tolerance_px"),
    # Single precision of some 12 mm, and half a step of 1/256 px; then the wire's own 2^-16.
    [("thesis-camera", 1e-4), ("plain-spots", 1 / 512), ("./bits.toml", 1 / 512)],
)
def test_a_described_camera_gives_out_what_its_sensor_saw(
    name: str, tolerance_px: float, tmp_path: Path
) -> None:
    private_network()
    bit_device(tmp_path)
    path = rig_with(name, tmp_path)
    device = load_device(name, path)
    request = StationRequest(plan=PLAN, out=tmp_path, rig=path, source="ethercat:virtual", seed=4)
    feed = make_feed(request, load_plan(PLAN), load_rig(path))
    blocks: list[FrameBlock] = []
    try:
        feed.acquisition.start()
        end = time.monotonic() + HANG_S
        while sum(map(len, blocks)) < 400:
            assert time.monotonic() < end, read_status(feed.ring)
            block = feed.ring.read(1000)
            if block is not None:
                blocks.append(block)
            time.sleep(0.01)
        status = read_status(feed.ring)
    finally:
        feed.end()
    assert status.elapsed == status.good + status.late + status.lost + status.bad
    assert isinstance(feed.virtual, VirtualRig)
    assert feed.description.frame_period_ns == device.period_ns
    virtual, mask = feed.virtual, (1 << device.slots) - 1
    shift = 0 if device.clock is Clock.DISTRIBUTED else shift_of(virtual, blocks[0])
    for block in blocks:
        first, count = int(block.counter[0]), int(block.counter[-1] - block.counter[0]) + 1
        chosen = block.counter - first
        for camera in range(2):
            valid, _flags, uv = virtual.camera_frames(camera, first + shift, count)
            np.testing.assert_array_equal(block.valid[:, camera], valid[chosen] & mask)
            seen = uv[chosen].copy()
            seen[:, device.slots :] = np.nan
            np.testing.assert_allclose(block.uv[:, camera], seen, rtol=0, atol=tolerance_px + 1e-5)


def shift_of(virtual: VirtualRig, block: FrameBlock) -> int:
    """Return the offset of the exposure count of cameras with a clock of their own.

    They started at their command to run, at a time unknown outside.
    """
    first = int(block.counter[0])
    begin = max(-first, -_SEARCHED)
    _valid, _flags, uv = virtual.camera_frames(0, first + begin, 2 * _SEARCHED)
    apart = np.nansum(np.abs(uv - block.uv[0, 0]), axis=(1, 2))
    return begin + int(np.argmin(apart))


def with_button(folder: Path) -> Path:
    """Return the thesis's camera with one more byte: the button of the probe.

    The thesis does not define a request for a point; its cameras send image coordinates alone. With
    those, a key or pedal at the computer is used, which a test cannot press in time on a slow wire.
    """
    text = resource("devices", "thesis-camera.toml").read_text()
    spots = '{ index = 0x6000, sub = 1, type = "REAL32", role = ["x", "y"], slots = true }'
    button = '{ index = 0x6001, sub = 1, type = "USINT", role = ["button"] }'
    assert spots in text
    path = folder / "thesis-with-button.toml"
    path.write_text(text.replace(spots, f"{spots}, {button}"))
    return path


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_the_camera_of_the_thesis_measures_within_u(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    private_network()
    # Beside the rig that names it.
    path = rig_with(with_button(tmp_path).name, tmp_path)
    plan = tmp_path / "plan.toml"
    plan.write_text(f'cameras = "unproven"\n{wire_plan_in(tmp_path).read_text()}')
    request = StationRequest(
        plan=plan, out=tmp_path / "wired", rig=path, source="ethercat:virtual", seed=4
    )
    built = build_station(request)
    assert built.virtual is not None
    view = run_job(built, tmp_path / "wired", make_console())
    truth = true_values(built.station.job.plan, built.virtual.part)
    assert view.complete
    assert len(view.camera_doubts) == 5
    for each in view.characteristics:
        assert each.measured is not None
        assert each.uncertainty is not None
        error = each.measured - truth[each.name]
        record_property(
            each.name, f"error {error * 1e3:+.1f} um, U {each.uncertainty * 1e3:.1f} um"
        )
        assert abs(error) <= each.uncertainty
