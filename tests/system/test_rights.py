"""Least rights, tried with an unprivileged user.

Evidence is the kernel's status (``/proc/PID/status``) of every thread. The tests with another user
need root, because only root can become another user; they make their environment in a separate
folder and leave nothing.
"""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from ocmm_core.acquisition.bus_process import (
    BUS_PRIORITY,
    NEEDED,
    BusConfig,
    Capability,
    ServiceBus,
    rights_of,
)
from ocmm_core.acquisition.frames import AcquisitionState, FrameRing, StopReason, read_status
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_sim.bus import SegmentConfig, VirtualBus
from tests.host import HANG_S, needs_tools, not_run, on_linux_only, private_network
from tests.system.other_user import NOBODY, as_nobody
from tests.system.other_user import environment as environment

# Two processes must answer each other within a millisecond: not in parallel with other tests.
pytestmark = [pytest.mark.timing, on_linux_only]

_ROOT = Path(__file__).resolve().parents[2]
_GRANT = _ROOT / "installer" / "linux" / "grant-rights.sh"
_SCENARIO = Path(__file__).with_name("rights_scenario.py")
_OUTSIDER = 65533
CAMERAS = (CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2))
_EXACTLY = [sorted(NEEDED)]
_NONE: list[list[int]] = [[]]


@pytest.fixture
def granted(environment: Path) -> Iterator[Path]:
    """Return the environment after `grant-rights.sh`; the rights are taken back afterwards."""
    command = ["sh", str(_GRANT), "--venv", str(environment)]
    done = subprocess.run(
        [*command, "--group", "nogroup"], capture_output=True, text=True, check=False
    )
    if "does not keep rights" in done.stderr or "nosuid" in done.stderr:
        not_run(f"rights cannot be given to files here: {done.stderr.strip()}")
    if "Python of the system" in done.stderr:
        not_run(f"the Python of these tests is none of the system: {done.stderr.strip()}")
    assert done.returncode == 0, done.stderr
    yield environment
    subprocess.run([*command, "--remove"], check=True, capture_output=True)


_HOST = """
import subprocess, sys
from ocmm_core.fieldbus.wire import make_link
make_link("right0", "right1")
cameras = subprocess.Popen(
    [sys.executable, "-m", "ocmm_sim.bus._camera_process"],
    stdin=subprocess.PIPE, stdout=subprocess.PIPE,
)
cameras.stdin.write(sys.argv[1].encode()); cameras.stdin.flush()
assert cameras.stdout.readline() == b"ready\\n"
code = subprocess.call(sys.argv[2:])
cameras.stdin.close(); cameras.wait(240); sys.exit(code)
"""


def play(
    environment: Path,
    drop: str = "",
    limits: tuple[str, ...] = (),
    window: tuple[str, ...] = ("right0",),
) -> dict[str, Any]:
    """Measure as an unprivileged user on a virtual cable in a private network; return a summary."""
    segment = SegmentConfig(
        interface="right1", cameras=CAMERAS, provider=msgspec.Raw(b'{"pattern":"test"}')
    )
    user = as_nobody(environment / "bin" / "python", _SCENARIO, *window, drop=drop)
    done = subprocess.run(
        # Root's network namespace, so that rights in it are real ones.
        ["unshare", "-n", sys.executable, "-c", _HOST, segment.to_json().decode(),
         *limits, *user],
        capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    seen: dict[str, Any] = json.loads(done.stdout)
    return seen


def test_window_without_any_right_measures_through_a_bus_process_with_three(granted: Path) -> None:
    seen = play(granted)
    assert seen["user"] == NOBODY
    assert seen["window"]["effective"] == seen["window"]["permitted"] == _NONE
    assert "bus" in seen, seen
    assert seen["command"][:2] == [str(granted / "bin" / "ocmm-acq-python"), "-I"]
    assert seen["bus"]["effective"] == seen["bus"]["permitted"] == _EXACTLY
    assert seen["bus"]["inheritable"] == seen["bus"]["ambient"] == _NONE
    assert seen["bus"]["no_new_privileges"]
    assert seen["frames"] >= 2000
    assert seen["ended"]
    assert seen["runs"]["policy"] == os.SCHED_FIFO
    assert not any("priority" in note for note in seen["notes"])


def test_without_the_rights_the_message_says_what_to_type(environment: Path) -> None:
    seen = play(environment)
    assert "bus" not in seen
    assert "sudo installer/linux/grant-rights.sh" in seen["message"]


@pytest.mark.parametrize("right", ["net_raw", "net_admin"])
def test_a_right_that_the_system_forbids_is_missed_with_a_clear_message(
    granted: Path, right: str
) -> None:
    """The kernel does not start a file with rights that it may not give: not even tried."""
    seen = play(granted, drop=right)
    assert "bus" not in seen
    assert "may not send raw Ethernet frames" in seen["message"]


def test_the_copy_cannot_be_run_by_other_groups(granted: Path) -> None:
    command = as_nobody(granted / "bin" / "ocmm-acq-python", "-I", "-c", "", number=_OUTSIDER)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 126
    assert "denied" in done.stderr


def test_granting_twice_and_removing_twice_is_fine_and_check_knows(granted: Path) -> None:
    def call(*options: str) -> int:
        return subprocess.call(
            ["sh", str(_GRANT), "--venv", str(granted), *options], stderr=subprocess.DEVNULL
        )

    assert call("--check") == 0
    assert call("--group", "nogroup") == 0
    assert call("--check") == 0
    before = sorted(path.name for path in (granted / "bin").iterdir())
    assert not [name for name in before if name.startswith(".")]
    assert call("--remove") == call("--remove") == 0
    assert call("--check") == 1


def test_granting_needs_root_and_a_group_that_exists(environment: Path) -> None:
    command = ["sh", str(_GRANT), "--venv", str(environment)]
    done = subprocess.run(as_nobody(*command), capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "Type: sudo" in done.stderr
    plain = {name: value for name, value in os.environ.items() if name != "SUDO_USER"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=plain)
    assert done.returncode == 2
    assert "--group NAME" in done.stderr
    done = subprocess.run(
        [*command, "--group", "no-such-group"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "groupadd" in done.stderr
    assert not (environment / "bin" / "ocmm-acq-python").exists()


def test_a_link_in_the_way_is_replaced_and_not_followed(environment: Path, tmp_path: Path) -> None:
    """Whoever owns the environment must not make root write elsewhere."""
    precious = tmp_path / "precious"
    precious.write_text("mine", encoding="utf-8")
    target = environment / "bin" / "ocmm-acq-python"
    target.symlink_to(precious)
    command = ["sh", str(_GRANT), "--venv", str(environment)]
    try:
        subprocess.run([*command, "--group", "nogroup"], check=True, capture_output=True)
        assert precious.read_text(encoding="utf-8") == "mine"
        assert not target.is_symlink()
    finally:
        subprocess.run([*command, "--remove"], check=True, capture_output=True)


def test_on_the_virtual_wire_the_bus_process_keeps_three_rights_of_all() -> None:
    """It starts as root of a private namespace, and drops the other rights."""
    private_network()
    ring = FrameRing.create(len(CAMERAS))
    bus = VirtualBus(
        BusConfig(interface="", ring_path=str(ring.path), cameras=CAMERAS),
        SegmentConfig(interface="", cameras=CAMERAS, provider=msgspec.Raw(b'{"pattern":"test"}')),
        ring,
    )
    try:
        bus.start()
        end = time.monotonic() + HANG_S
        while read_status(ring).state is not AcquisitionState.RUNNING:
            assert time.monotonic() < end, read_status(ring)
            time.sleep(0.01)
        children = Path(f"/proc/{bus.pid}/task/{bus.pid}/children").read_text(encoding="ascii")
        [process] = map(int, children.split())
        threads = [int(entry.name) for entry in Path(f"/proc/{process}/task").iterdir()]
        for thread in threads:
            own = rights_of(thread)
            assert own.effective == own.permitted == NEEDED
            assert own.bounding == NEEDED
            assert not own.inheritable
            assert own.no_new_privileges
    finally:
        bus.request_stop()
        assert bus.join(HANG_S)
        ring.close()


def unit(name: str) -> str:
    return (_ROOT / "installer" / "linux" / name).read_text(encoding="utf-8")


def test_the_units_are_valid(tmp_path: Path) -> None:
    needs_tools("systemd-analyze")
    # The program is not installed at the unit's path.
    service = unit("ocmm-acq@.service").replace("/opt/ocmm/.venv/bin/python", sys.executable)
    (tmp_path / "ocmm-acq@.service").write_text(service, encoding="utf-8")
    (tmp_path / "ocmm-acq.socket").write_text(unit("ocmm-acq.socket"), encoding="utf-8")
    for name in ("ocmm-acq@.service", "ocmm-acq.socket"):
        done = subprocess.run(
            ["systemd-analyze", "verify", "--man=no", str(tmp_path / name)],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert str(tmp_path) not in done.stderr, done.stderr


def test_the_unit_gives_the_rights_that_the_program_keeps_and_no_other() -> None:
    """The priority comes from a limit: it allows this priority and nothing else."""
    assert set(Capability) == NEEDED == {
        Capability.NET_RAW, Capability.NET_ADMIN, Capability.SYS_NICE
    }  # fmt: skip
    text = unit("ocmm-acq@.service")
    for setting in ("AmbientCapabilities", "CapabilityBoundingSet"):
        assert f"\n{setting}=CAP_NET_RAW CAP_NET_ADMIN\n" in text
    assert f"\nLimitRTPRIO={BUS_PRIORITY}\n" in text


_SERVICE = """
import subprocess, sys, time
from pathlib import Path
address, python = Path(sys.argv[1]), sys.argv[2]
rights = "+net_raw,+net_admin"
service = subprocess.Popen(
    ["systemd-socket-activate", "--accept", "--inetd", "-l", address, "--",
     "setpriv", "--reuid=65533", "--regid=65534", "--clear-groups", "--no-new-privs",
     f"--inh-caps={rights}", f"--ambient-caps={rights}", f"--bounding-set=-all,{rights}", "--",
     python, "-I", "-m", "ocmm_core.acquisition.bus_process._start", "--interface", "right0"])
while not address.exists():
    time.sleep(0.01)
subprocess.run(["chgrp", "nogroup", address], check=True)
address.chmod(0o660)
code = subprocess.call(sys.argv[3:])
service.terminate(); service.wait(240); address.unlink(); sys.exit(code)
"""


def test_a_window_measures_through_the_service(environment: Path) -> None:
    """The unit's command, user and rights behind a socket of systemd's own."""
    needs_tools("systemd-socket-activate")
    address = environment.parent / "acq.sock"
    wrapper = (sys.executable, "-c", _SERVICE, str(address), str(environment / "bin" / "python"))
    # It names an interface that is not there: only the service decides which one it is.
    seen = play(environment, limits=wrapper, window=("nope0", str(address)))
    assert seen["window"]["permitted"] == _NONE
    assert seen["frames"] >= 2000, seen
    assert seen["ended"]


def test_a_service_that_is_not_there_is_named(tmp_path: Path) -> None:
    ring = FrameRing.create(len(CAMERAS))
    try:
        config = BusConfig(interface="", ring_path=str(ring.path), cameras=CAMERAS)
        with pytest.raises(BusError, match=r"systemctl start ocmm-acq.socket"):
            ServiceBus(config, ring, tmp_path / "acq.sock").start()
    finally:
        ring.close()


def test_a_service_that_hangs_up_is_named(tmp_path: Path) -> None:
    """As systemd does with a second window."""
    ring = FrameRing.create(len(CAMERAS))
    address = tmp_path / "acq.sock"
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as door:
        door.bind(str(address))
        door.listen()
        try:
            config = BusConfig(interface="", ring_path=str(ring.path), cameras=CAMERAS)
            bus = ServiceBus(config, ring, address)
            bus.start()
            door.accept()[0].close()
            assert bus.join(HANG_S)
            status = read_status(ring)
            assert status.stop_reason is StopReason.FAILED
            assert "journalctl -u 'ocmm-acq@*'" in status.message
        finally:
            ring.close()
