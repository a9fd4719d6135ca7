"""Cameras on a named interface, as real ones: nothing is measured until all is as it must be."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.host import HANG_S, private_network

# Two processes must answer each other within a millisecond: not in parallel with other tests.
pytestmark = [pytest.mark.timing, pytest.mark.slow]

_ROOT = Path(__file__).resolve().parents[2]

_PROGRAM = """
import json, os, sys, tempfile, time
from datetime import UTC, datetime
from pathlib import Path
import msgspec
from ocmm_core.calibration.records._history import CalibrationStore
from ocmm_core.calibration.records._in_use import default_folder, store_folder
from ocmm_core.camera._rig import load_rig
from ocmm_cli import main
from ocmm_core.composition import StationRequest, build_station
from ocmm_sim.sources import segment_of
from ocmm_core.documents import resource
from ocmm_core.inspection.plan._plan import load_plan
from ocmm_core.inspection.evaluation._view import StatusWord
from ocmm_sim.bus._named_rig import rig_down, rig_up
from tests.core.calibration.made_records import make_verification
from ocmm_core.calibration.records._in_use import default_probe_folder
from tests.core.calibration.fresh_tips import TIP, Tips
from tests.core.station.test_station_calibration import fresh_record

PLAN = resource("plans", "quick.toml")
REQUEST = StationRequest(plan=PLAN, out=Path("out"), source="ethercat:ocmm0")
CAMERAS = ("--source", "ethercat:ocmm0")

def ocmm(*arguments):
    # A process of its own, made of this one, which has loaded everything.
    with tempfile.TemporaryFile() as said:
        child = os.fork()
        if child == 0:
            for stream in (1, 2):
                os.dup2(said.fileno(), stream)
            sys.argv = ["ocmm", *arguments]
            code = 3
            try:
                main()
                code = 0
            except SystemExit as end:
                code = int(end.code or 0)
            finally:
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(code)
        _, status = os.waitpid(child, 0)
        said.seek(0)
        return [os.waitstatus_to_exitcode(status), " ".join(said.read().decode().split())]

def measure(*more):
    return ocmm("measure", "--plan", str(PLAN), "--out", "out", *CAMERAS, *more)

def ready():
    station = build_station(REQUEST).station
    try:
        station.start()
        until = time.monotonic() + 240.0
        while time.monotonic() < until:
            live = station.looks.live()
            if live.status in (StatusWord.READY, StatusWord.MEASURING):
                return station.instruments.calibration().label.split()[0]
            time.sleep(0.05)
        return live.reason
    finally:
        station.close()

rig_up(segment_of(REQUEST, load_plan(PLAN), load_rig(REQUEST.rig)))
seen = {}
try:
    Tips(Path("tips"))
    seen["never"] = measure()
    store = CalibrationStore(store_folder(default_folder(), "recommended"))
    record = fresh_record()
    store.accept(record, "technician", "new", datetime.now(UTC))
    store.verify(make_verification(record), datetime.now(UTC))
    seen["nothing stored"] = measure("--probes", str(Path("tips").resolve()))
    seen["write"] = ocmm("calibrate", "write-cameras", *CAMERAS)
    seen["check"] = ocmm("calibrate", "write-cameras", "--check", *CAMERAS)
    seen["no tip"] = measure()
    tips = Tips(default_probe_folder())
    seen["ready"] = ready()
    tips.store.mount(TIP, "inspector", datetime.now(UTC))
    seen["mounted"] = measure()
    other = fresh_record(points=17, data_sha256="c" * 64, cameras=tuple(
        msgspec.structs.replace(camera, focal=camera.focal + 1e-6) for camera in record.cameras
    ))
    store.accept(other, "technician", "new", datetime.now(UTC))
    store.verify(make_verification(other), datetime.now(UTC))
    seen["others stored"] = ocmm("calibrate", "write-cameras", "--check", *CAMERAS)
finally:
    rig_down()
print(json.dumps(seen))
"""


def test_nothing_is_measured_until_the_cameras_hold_a_verified_calibration(tmp_path: Path) -> None:
    prefix = private_network()
    done = subprocess.run(
        [*prefix, sys.executable, "-c", _PROGRAM],
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
        cwd=tmp_path,
        env={
            **os.environ,
            "PYTHONPATH": str(_ROOT),
            "XDG_STATE_HOME": str(tmp_path / "state"),
            "XDG_DATA_HOME": str(tmp_path / "data"),
            "PYTHONFAULTHANDLER": "1",
        },
    )
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    code, words = seen["never"]
    assert code == 2, words
    assert "NONE: The cameras of rig 'recommended' were never calibrated." in words
    code, words = seen["nothing stored"]
    assert code == 2, words
    assert "UNUSABLE: Camera 'left' stores no intrinsics" in words
    assert "ocmm calibrate write-cameras" in words
    code, words = seen["write"]
    assert code == 0, words
    assert "'left' (20600001), 'right' (20600002) now store calibration" in words
    assert seen["check"][0] == 0
    code, words = seen["no tip"]
    assert code == 2, words
    assert "NONE: Probe 'standard' was never calibrated." in words
    assert seen["ready"] == "VALID"
    code, words = seen["mounted"]
    assert code == 2, words
    assert "SUSPECT: Tip '6 mm' was mounted and has not been checked since." in words
    assert "Run the quick tip check (one minute)." in words
    code, words = seen["others stored"]
    assert code == 1
    assert "The intrinsics stored in camera 'left' differ" in words
