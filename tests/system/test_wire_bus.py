"""The wire between master and software cameras, in a private network namespace.

Timing is not judged here: on a busy machine cycles are late and answers lost, which must be counted
and cost no frame. The tests judge that every loss is counted, nothing doubtful is passed on, and
passed frames are exactly those of the cameras.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.host import HANG_S, private_network

# Two processes must answer each other within a millisecond: not in parallel with other tests.
pytestmark = pytest.mark.timing

_SCENARIOS = Path(__file__).with_name("wire_scenarios.py")
_ROOT = Path(__file__).resolve().parents[2]


def play(name: str) -> dict[str, Any]:
    """Play a scenario in a separate namespace and return its output."""
    prefix = private_network()
    done = subprocess.run(
        [*prefix, sys.executable, "-W", "error", str(_SCENARIOS), name],
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
        env={**os.environ, "PYTHONPATH": str(_ROOT)},
    )
    assert done.returncode == 0, done.stderr
    seen: dict[str, Any] = json.loads(done.stdout)
    return seen


def check_accounts(seen: dict[str, Any], *, brought_up_once: bool = True) -> None:
    """Every cycle and every exposure is in exactly one account, and none of two exposures."""
    assert sum(seen["verdicts"].values()) == seen["elapsed"]
    # A pause of this machine between the last cycle and the reading of the clock may last this
    # long.
    assert seen["elapsed"] == pytest.approx(seen["passed"], abs=25)
    assert seen["frames"] + seen["frames_lost"] == seen["last"] + 1
    assert seen["in_order"]
    assert seen["mixed"] == 0
    # The software cameras restart their pattern at a new bring-up; the count continues.
    assert not brought_up_once or seen["wrong"] == 0


def check_nothing_is_lost(seen: dict[str, Any]) -> None:
    """Judge losses if the machine kept up: the cameras hold 128 ms of frames.

    A cycle carries 12 frames and 8 are made in it, so that three good cycles of four catch up. The
    60 ms before the first exposure bring no frames and count as a gap.
    """
    if seen["verdicts"]["good"] > 0.85 * seen["elapsed"] and seen["longest_ms"] < 90:
        assert seen["frames_lost"] == 0


def test_three_seconds_at_8_khz_lose_and_mix_nothing() -> None:
    seen = play("run")
    check_accounts(seen)
    check_nothing_is_lost(seen)
    assert seen["verdicts"]["good"] > 0
    # A busy computer may lose answers or be late; on an undisturbed wire no camera is blamed.
    assert [reason for reason in seen["reasons"] if "amera '" in reason] == []
    # Exposures start 60 ms after they were programmed; the rest of 3 s is at 8 kHz. Frames still in
    # the cameras at the end (128 ms at most) are in no account.
    assert seen["frames"] + seen["frames_lost"] > 22_000


def test_lost_answers_cost_no_frame() -> None:
    seen = play("drop")
    check_accounts(seen)
    check_nothing_is_lost(seen)
    # 3 % of two answers a cycle in 2000 cycles: 120 expected, 20 would be nine sigma away.
    assert seen["verdicts"]["lost"] + seen["verdicts"].get("bad", 0) > 20


def test_cameras_that_are_not_those_of_the_rig_are_refused_by_name() -> None:
    seen = play("refusals")
    codes = {name: answer[0] for name, answer in seen.items()}
    assert codes == {
        "serial": "bus.cameras",
        "missing": "bus.cameras",
        "extra": "bus.cameras",
        "duplicate": "bus.duplicate",
        "swapped": "bus.alias",
        "mapping": "bus.mapping",
        "none": "bus.no_cameras",
        "sensor": "bus.sensor",
        "sensor exchanged": "bus.sensor",
        "two serials": "bus.two_serials",
        "too many": "bus.too_many",
    }
    assert "'right' (serial 1002)" in seen["serial"][1]
    assert "4711" in seen["serial"][1]
    assert "'third' (serial 1003)" in seen["missing"][1]
    assert "serial 1003 at position 3" in seen["extra"][1]
    assert "alias of 'right'" in seen["swapped"][1]
    assert "0x1c13:03" in seen["mapping"][1]
    assert "'right' has a sensor of 2048 x 2048 px" in seen["sensor"][1]
    assert "sensor with serial number 1002" in seen["sensor exchanged"][1]
    assert "4711 in its object 0x1018 and 1002 in its EEPROM" in seen["two serials"][1]
    # A refused bus leaves no socket open.
    assert {answer[2] for answer in seen.values()} == {"0"}


def test_alarms_name_camera_port_and_cause_and_an_end_is_no_emergency() -> None:
    seen = play("alarms")
    ((camera, what, _remedy),) = seen["bus.emergency"]
    assert (camera, "0x5030" in what) == ("left", True)
    assert seen["emergencies"] == [1, 0]
    ((camera, what, remedy),) = seen["bus.error_over"]
    assert (camera, remedy) == ("left", "")
    assert what == "Camera 'left' reports that its error is over."
    ((camera, what, remedy),) = seen["bus.port_errors"]
    assert (camera, what) == ("right", "Camera 'right' counts 3 broken frames at its port IN (0).")
    assert "cable at that port" in remedy
    assert seen["link errors"] == [0, 3]
    # Not the cable: this computer paused.
    assert any("computer" in what for _camera, what, _remedy in seen["bus.host_busy"])


def test_names_a_master_that_starts_later_and_takes_no_frame_meanwhile() -> None:
    """Within a second, be it silent or not; the limit is part of the requirement."""
    seen = play("second_master")
    assert not [each for each in seen["before"] if "master" in each]
    for name in ("silent", "sends"):
        after_s, reason, alarm = seen[name]
        assert (after_s < 1.0, alarm, seen[f"{name} frames"]) == (True, "bus.second_master", 0)
        assert "The program 'python" in reason
        assert "uses interface 'wire0' as an EtherCAT master" in reason


def test_interfaces_that_cannot_be_the_bus_are_refused() -> None:
    seen = play("interfaces")
    assert {name[:8]: answer[0] for name, answer in seen.items()} == {
        "nope0": "bus.no_interface",
        "xxxxxxxx": "bus.interface_name",
        "../eth0": "bus.interface_name",
        "": "bus.interface_name",
        "wire1": "bus.in_use",
        "dark0": "bus.down",
        "lo": "bus.loopback",
        "wire0": "accepted",
    }
    assert "10.11.12.13" in seen["wire1"][1]


def test_objects_are_read_written_and_refused() -> None:
    seen = play("objects")
    assert (seen["serial"], seen["alias"], seen["name"]) == (1001, 1, "OCMM smart camera")
    assert seen["segmented"] is True
    assert "0x06010002" in seen["read only"]
    assert "0x06020000" in seen["no object"]
    assert "0x06090011" in seen["no entry"]
    assert "0x06070010" in seen["length"]


def test_an_answer_that_comes_too_late_is_not_taken_for_another_entry() -> None:
    seen = play("late_objects")
    assert seen["wrong"] == []
    assert seen["right"] >= 100


def test_killed_cameras_are_lost_but_waited_for() -> None:
    seen = play("killed")
    assert seen["before"]["verdicts"]["good"] > 0
    assert set(seen["after"]["verdicts"]) <= {"lost", "late"}
    assert seen["after"]["frames"] == 0
    assert seen["error"] == ""
    assert any("No camera answers" in reason for reason in seen["after"]["reasons"])


def test_a_camera_that_repeats_itself_is_not_believed() -> None:
    seen = play("frozen")
    assert seen["after"]["verdicts"].get("good", 0) == 0
    assert seen["after"]["frames"] == 0
    assert any("repeated old data" in reason for reason in seen["after"]["reasons"])


def test_a_camera_that_was_restarted_is_brought_back_with_the_count_going_on() -> None:
    seen = play("restarted")
    assert seen["error"] == ""
    assert any("'right' was restarted" in reason for reason in seen["flagged"])
    before, after = seen["before"], seen["after"]
    assert after["frames"] > 0
    assert after["in_order"]
    # Every exposure is given out or lost, across the new bring-up.
    given = before["frames"] + seen["between"]["frames"] + after["frames"]
    lost = before["frames_lost"] + seen["between"]["frames_lost"] + after["frames_lost"]
    assert given + lost == after["last"] + 1


def test_after_a_long_stall_the_bus_recovers_and_counts_the_loss() -> None:
    seen = play("stalled")
    check_accounts(seen, brought_up_once=False)
    assert seen["verdicts"]["late"] >= 390
    # 400 ms at 8 kHz, minus the buffer of the cameras (128 ms).
    assert seen["frames_lost"] > 1900
    # Good again: at most 400 were good before.
    assert seen["verdicts"]["good"] > 500
