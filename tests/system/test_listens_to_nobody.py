"""By default no program of OCMM listens on a network, and with the stream only on loopback.

Real processes in a separate private network; the kernel's tables list the listeners.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.host import HANG_S, on_linux_only, private_network
from tests.short_plan import ball_plan_in
from tests.slow_rig import slow_rig_in

pytestmark = [on_linux_only, pytest.mark.slow]

_ROOT = Path(__file__).resolve().parents[2]
_LISTENS, _UNCONNECTED = "0A", "07"  # states of TCP and UDP
_COMMAND = ("ocmm_cli", "demo", "--headless", "--out")
_WINDOW = ("ocmm_gui", "--silent", "--quit-after", "4", "--out")
_STREAM = ("ocmm_cli", "measure", "--source", "simulated", "--speed", "1",
           "--stream", "0", "--out")  # fmt: skip


def _sockets(pid: int) -> set[tuple[str, str]]:
    """Return protocol and local address of every socket that waits for others, in its network."""
    found = set()
    for protocol, state in (("tcp", _LISTENS), ("tcp6", _LISTENS), ("udp", _UNCONNECTED),
                            ("udp6", _UNCONNECTED), ("raw", _UNCONNECTED)):  # fmt: skip
        table = Path(f"/proc/{pid}/net/{protocol}")
        try:
            lines = table.read_text(encoding="ascii").splitlines()[1:]
        except OSError:  # it has ended, or IPv6 is missing
            continue
        rows = (line.split() for line in lines)
        found |= {(protocol, row[1]) for row in rows if row[3] == state}
    return found


def _has_its_own_network(pid: int) -> bool:
    """Return whether a process has come into its private network; until then it sees ours."""
    try:
        return Path(f"/proc/{pid}/ns/net").readlink() != Path("/proc/self/ns/net").readlink()
    except OSError:  # it has ended
        return False


def _heard(command: list[str], folder: Path, *, until_heard: bool = False) -> set[tuple[str, str]]:
    """Return all sockets that waited for others while a command ran in a private network."""
    plan = ["--plan", str(ball_plan_in(folder))]
    if _WINDOW[0] in command:
        plan += ["--rig", str(slow_rig_in(folder))]
    shell = 'ip link set lo up && exec "$@"'
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen(
            [*private_network(), "sh", "-c", shell, "sh", *command, *plan],
            stdout=log, stderr=log, cwd=folder,
            env={**os.environ, "PYTHONPATH": str(_ROOT), "QT_QPA_PLATFORM": "offscreen",
                 "PATH": f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin"},
        )  # fmt: skip
    heard: set[tuple[str, str]] = set()
    looks = 0
    try:
        end = time.monotonic() + HANG_S
        while process.poll() is None and not (until_heard and heard):
            assert time.monotonic() < end
            if _has_its_own_network(process.pid):
                heard |= _sockets(process.pid)
                looks += 1
            time.sleep(0.01)
    finally:
        process.kill()
        process.wait(HANG_S)
    assert looks
    if not until_heard:
        # It fulfilled its task; otherwise its silence would prove nothing.
        assert process.returncode in (0, 1), (folder / "log").read_text(encoding="utf-8")
    return heard


@pytest.mark.parametrize("program", [_COMMAND, _WINDOW], ids=["command", "window"])
def test_nobody_can_call_it(program: tuple[str, ...], tmp_path: Path) -> None:
    command = [sys.executable, "-m", *program, str(tmp_path / "out")]
    assert _heard(command, tmp_path) == set()


def test_the_stream_is_heard_on_this_computer_alone(tmp_path: Path) -> None:
    command = [sys.executable, "-m", *_STREAM, str(tmp_path / "out")]
    heard = _heard(command, tmp_path, until_heard=True)
    assert len(heard) == 1
    # 127.0.0.1, in the byte order of the processor.
    assert {(protocol, place.split(":")[0]) for protocol, place in heard} == {("tcp", "0100007F")}


def test_whoever_listens_to_all_is_found(tmp_path: Path) -> None:
    listens = "import socket,time; s=socket.create_server(('', 0)); time.sleep(240)"
    heard = _heard([sys.executable, "-c", listens], tmp_path, until_heard=True)
    assert {(protocol, place.split(":")[0]) for protocol, place in heard} == {("tcp", "00000000")}
