"""The emulated camera of pylon (proprietary, by Basler) with our picture, if pylon is installed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.host import HANG_S, not_run

ROOT = Path(__file__).resolve().parents[2]
_SIZE = 4096
"""Of the emulated sensor."""
_PLACES = ((150.3, 90.6), (400.8, 300.2), (520.1, 60.9))
_PROGRAM = """
import json, sys
import numpy as np
from pypylon import genicam, pylon
from ocmm_genicam import Expected, Viewfinder

class Emulated:
    # A `Camera` by pylon.
    def __init__(self, device):
        self._camera = pylon.InstantCamera(pylon.TlFactory.GetInstance().CreateDevice(device))
        self._camera.Open()
        self.serial, self.model = device.GetSerialNumber(), f"Basler {device.GetModelName()}"
        self._node("ImageFilename").SetValue(sys.argv[1])
        self._node("ImageFileMode").SetValue("On")
        self._node("TestImageSelector").SetValue("Off")
    def _node(self, name):
        return self._camera.GetNodeMap().GetNode(name)
    def has(self, name):
        node = self._node(name)
        return node is not None and genicam.IsAvailable(node)
    def text(self, name): return self._node(name).ToString()
    def number(self, name): return float(self._node(name).GetValue())
    def integer(self, name): return int(self._node(name).GetValue())
    def set_text(self, name, value): self._node(name).FromString(value)
    def set_number(self, name, value): self._node(name).SetValue(value)
    def set_integer(self, name, value): self._node(name).SetValue(value)
    def steps(self, name): return self._node(name).GetMin(), self._node(name).GetInc()
    def execute(self, name): self._node(name).Execute()
    def entries(self, name):
        entries = self._node(name).GetEntries()
        return tuple(one.GetSymbolic() for one in entries if genicam.IsAvailable(one))
    def address(self): return ""
    def tick_frequency(self): return 0
    def start(self): self._camera.StartGrabbing(pylon.GrabStrategy_LatestImageOnly)
    def next_image(self, timeout_s):
        from ocmm_genicam._client import Image
        got = self._camera.RetrieveResult(round(1e3 * timeout_s), pylon.TimeoutHandling_Return)
        if got is None or not got.IsValid() or not got.GrabSucceeded():
            return None
        self._data = np.frombuffer(got.GetBuffer(), np.uint8).copy()
        return Image(0, got.ImageNumber, got.TimeStamp, got.PixelType & 0xFFFFFFFF, got.Width,
                     got.Height, self._data, got.OffsetX, got.OffsetY)
    def close(self): self._camera.Close()

class Cameras:
    def open(self, serial):
        return Emulated(next(d for d in pylon.TlFactory.GetInstance().EnumerateDevices()
                             if d.GetSerialNumber() == serial))

serial = pylon.TlFactory.GetInstance().EnumerateDevices()[0].GetSerialNumber()
size = int(sys.argv[2])
finder = Viewfinder(Cameras(), [serial], [Expected("left", size, size, 100_000_000)])
finder.look()
look = finder.look()[0]
finder.close()
print(json.dumps([look.spots_px.tolist(), look.model]))
"""


@pytest.mark.slow
def test_spots_of_our_picture_are_found_by_its_emulation(tmp_path: Path) -> None:
    if find_spec("pypylon") is None:
        not_run("pypylon is not installed")
    light, x = np.full((_SIZE, _SIZE), 10.0), np.arange(_SIZE)
    for u, v in _PLACES:
        across, down = (np.exp(-0.5 * ((x - at) / 1.2) ** 2) for at in (u, v))
        light += 170.0 * np.outer(down, across)
    cv2.imwrite(str(tmp_path / "picture.png"), light.astype(np.uint8))
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM, str(tmp_path / "picture.png"), str(_SIZE)],
        cwd=ROOT, capture_output=True, text=True, timeout=HANG_S, check=False,
        env={**os.environ, "PYLON_CAMEMU": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    spots, model = json.loads(done.stdout.strip().splitlines()[-1])
    assert "Emulation" in model
    found = np.array(sorted(spots))
    assert found == pytest.approx(np.array(sorted(_PLACES)), abs=0.05)
