"""The rig on named interfaces: made, shown and removed, and nothing else is touched."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_sim.bus import SegmentConfig, named_rig
from tests.host import HANG_S, private_network

# Two processes must answer each other within a millisecond: not in parallel with other tests.
pytestmark = pytest.mark.timing

_ROOT = Path(__file__).resolve().parents[2]
SEGMENT = SegmentConfig(
    interface="",
    cameras=(CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2)),
    provider=msgspec.Raw(b'{"pattern":"test"}'),
)

_PROGRAM = """
import json, os, socket, subprocess, sys
import test_wire_named_rig as t
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.cycle._bus import BusSettings, CameraBus
from ocmm_sim.bus._named_rig import rig_down, rig_status, rig_up

def names():
    return sorted(name for _, name in socket.if_nameindex())

def refusal(action, *arguments):
    try:
        action(*arguments)
    except BusError as error:
        return error.code
    return "accepted"

seen = {"none": rig_status().record is None, "down of nothing": rig_down() is None}
ip = "ip", "link"
subprocess.run([*ip, "add", "ocmm9", "type", "veth", "peer", "ocmm8"], check=True)
subprocess.run([*ip, "add", "ocmm0", "type", "veth", "peer", "ocmm7"], check=True)
seen["taken"] = refusal(rig_up, t.SEGMENT)
subprocess.run([*ip, "del", "ocmm0"], check=True)
up = rig_up(t.SEGMENT)
seen["up"] = [up.interface_there, up.cameras_running, list(up.record.names)]
seen["twice"] = refusal(rig_up, t.SEGMENT)
bus = CameraBus(BusSettings("ocmm0", t.SEGMENT.cameras, 125000, 1000000))
seen["bus"] = refusal(bus.open)
bus.close()
seen["names"] = names()
rig_down()
seen["after"] = names()
seen["gone"] = rig_status().record is None
wrong = t.msgspec.structs.replace(t.SEGMENT, cameras=())
seen["bad cameras"] = refusal(rig_up, wrong)
seen["after failure"] = names()
print(json.dumps(seen))
"""


def test_named_rig_is_made_and_removed_and_leaves_other_interfaces_alone(tmp_path: Path) -> None:
    prefix = private_network()
    path = os.pathsep.join([str(_ROOT), str(Path(__file__).parent)])
    done = subprocess.run(
        [*prefix, sys.executable, "-c", _PROGRAM],
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
        env={**os.environ, "PYTHONPATH": path, "XDG_STATE_HOME": str(tmp_path)},
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {
        "none": True,
        "down of nothing": True,
        "taken": "rig.name",
        "up": [True, True, ["left", "right"]],
        "twice": "rig.up",
        "bus": "accepted",
        "names": ["lo", "ocmm0", "ocmm1", "ocmm8", "ocmm9"],
        "after": ["lo", "ocmm8", "ocmm9"],
        "gone": True,
        "bad cameras": "rig.cameras",
        "after failure": ["lo", "ocmm8", "ocmm9"],
    }


def test_without_root_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    with pytest.raises(BusError, match=r"sudo ocmm rig up.*ethercat:virtual"):
        named_rig.rig_up(SEGMENT)
