"""A real run on a virtual cable, recorded in parallel: the recording contains the same frames."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ocmm_core.acquisition.recording import BusCapture
from tests.host import HANG_S, needs_tools, private_network

# Three processes must answer each other within a millisecond: not in parallel with other tests.
pytestmark = pytest.mark.timing

_SCENARIO = Path(__file__).with_name("capture_scenario.py")
_ROOT = Path(__file__).resolve().parents[3]


def play(folder: Path, writer: str) -> None:
    prefix = private_network()
    done = subprocess.run(
        [*prefix, sys.executable, "-W", "error", str(_SCENARIO), str(folder), writer],
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
        env={**os.environ, "PYTHONPATH": str(_ROOT)},
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("writer", ["pcap", "tcpdump"])
def test_a_recorded_bus_gives_the_frames_that_the_application_got(
    writer: str, tmp_path: Path
) -> None:
    if writer == "tcpdump":
        needs_tools(writer)
    play(tmp_path, writer)
    got = np.load(tmp_path / "frames.npy")
    capture = check_same_frames(BusCapture(tmp_path / "bus.pcap"), got)
    # The order of the cameras on the wire differs from that in the rig.
    assert capture.serials == (1002, 1001)
    # Also with an explicit number of cameras.
    check_same_frames(BusCapture(tmp_path / "bus.pcap", n_cameras=2), got)


def check_same_frames(capture: BusCapture, got: NDArray[np.void]) -> BusCapture:
    blocks = list(capture.blocks())
    time_ns = np.concatenate([block.time_ns for block in blocks])
    valid = np.concatenate([block.valid for block in blocks])[:, ::-1]
    uv = np.concatenate([block.uv for block in blocks])[:, ::-1]
    common, here, there = np.intersect1d(time_ns, got["time_ns"], return_indices=True)
    # A recorder that gets no processor time loses packets without a message.
    assert len(common) > 0.5 * len(got)
    np.testing.assert_array_equal(valid[here], got["valid"][there])
    np.testing.assert_array_equal(uv[here], got["uv"][there])
    account = capture.account
    assert account.malformed == 0
    assert all(camera.damaged == camera.contradicting == 0 for camera in account.cameras)
    return capture


def test_another_program_finds_every_frame_well_formed(tmp_path: Path) -> None:
    needs_tools("tshark")
    play(tmp_path, "pcap")
    path = str(tmp_path / "bus.pcap")
    listed = [
        subprocess.run(
            ["tshark", "-r", path, "-Y", chosen], capture_output=True, text=True, check=True
        ).stdout.splitlines()
        for chosen in ("ecat", "ecat && (_ws.malformed || _ws.expert.severity == error)")
    ]
    assert len(listed[0]) > 1000
    assert listed[1] == []
