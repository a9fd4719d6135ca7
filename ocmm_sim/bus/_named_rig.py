"""Virtual rig for other programs: software cameras on named network interfaces.

Created objects are recorded before anything else can fail, and only recorded ones are ever removed:
the process is identified by its number and start time, the interface by its index.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import msgspec
import platformdirs

from ocmm_core.documents import write_atomic
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.wire import make_link, remove_link
from ocmm_core.side_files import read_guarded
from ocmm_sim.bus._camera_process import READY, SegmentConfig

HOST_INTERFACE = "ocmm0"
CAMERA_INTERFACE = "ocmm1"
_READY_S = 30.0
_STOP_S = 3.0
_POLL_S = 0.02


class RigRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Created objects, as stored in the state file."""

    host: str
    host_index: int
    cameras: str
    pid: int
    started: int
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RigStatus:
    """Current state."""

    record: RigRecord | None
    """Created objects; None without a named rig."""
    interface_there: bool
    cameras_running: bool


def rig_up(segment: SegmentConfig) -> RigStatus:
    """Create the interfaces and start the software cameras on one of them.

    BusError if not root, a rig is up, a name is in use, or cameras fail; nothing is left.
    """
    _need_root("up")
    if rig_status().record is not None:
        raise BusError(
            "rig.up", "The virtual rig is already up.", "Use it, or run 'ocmm rig down' first."
        )
    host, cameras = HOST_INTERFACE, CAMERA_INTERFACE
    known = {name for _, name in socket.if_nameindex()}
    for name in (host, cameras):
        if name in known:
            raise BusError(
                "rig.name",
                f"Interface '{name}' already exists and was not created by this program.",
                "Choose another name, or remove that interface manually.",
            )
    make_link(host, cameras)
    process: subprocess.Popen[bytes] | None = None
    try:
        process = _start_cameras(msgspec.structs.replace(segment, interface=cameras))
        record = RigRecord(
            host=host,
            host_index=socket.if_nametoindex(host),
            cameras=cameras,
            pid=process.pid,
            started=_start_time(process.pid) or 0,
            names=tuple(camera.name for camera in segment.cameras),
        )
        write_atomic(_state_file(), msgspec.json.encode(record))
    except BaseException as error:
        if process is not None:
            process.kill()
            process.wait()
        remove_link(host)
        if isinstance(error, OSError):
            raise BusError(
                "rig.state",
                (
                    f"{_state_file()}: the state of the virtual rig cannot be saved "
                    f"({error.strerror})."
                ),
                "Make that folder writable.",
            ) from error
        raise
    # It outlives this process; its end is detected through the state file.
    process.returncode = 0
    return rig_status()


def rig_down() -> RigRecord | None:
    """Stop and remove everything of `rig_up`, and return it; BusError unless root."""
    status = rig_status()
    if status.record is None:
        return None
    _need_root("down")
    record = status.record
    if status.cameras_running:
        os.kill(record.pid, signal.SIGTERM)
        deadline = time.monotonic() + _STOP_S
        while _is_running(record) and time.monotonic() < deadline:
            time.sleep(_POLL_S)
        if _is_running(record):
            os.kill(record.pid, signal.SIGKILL)
    if status.interface_there:
        remove_link(record.host)
    for path in (_state_file(), _config_file(), _log_file()):
        path.unlink(missing_ok=True)
    return record


def rig_status() -> RigStatus:
    """Return what `rig_up` created and what is running."""
    try:
        record = msgspec.json.decode(read_guarded(_state_file(), 1 << 20), type=RigRecord)
    except FileNotFoundError:
        return RigStatus(None, interface_there=False, cameras_running=False)
    except (OSError, msgspec.DecodeError) as error:
        raise BusError(
            "rig.state",
            f"{_state_file()}: the note about the virtual rig cannot be read ({error}).",
            "Remove that file and the interfaces it lists.",
        ) from error
    there = (record.host_index, record.host) in socket.if_nameindex()
    return RigStatus(record, there, _is_running(record))


def _start_cameras(segment: SegmentConfig) -> subprocess.Popen[bytes]:
    """Start the cameras as a background process and wait until they answer."""
    write_atomic(_config_file(), segment.to_json())
    with _log_file().open("wb") as log:
        process = subprocess.Popen(  # noqa: S603 - our own interpreter and module, no shell
            [sys.executable, "-m", "ocmm_sim.bus._camera_process", str(_config_file())],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
    deadline = time.monotonic() + _READY_S
    while True:
        said = read_guarded(_log_file(), 1 << 20).decode("utf-8", "replace").strip().splitlines()
        if said and said[-1] == READY:
            return process
        if process.poll() is not None or time.monotonic() > deadline:
            process.kill()
            process.wait()
            reason = said[-1] if said else "no message"
            raise BusError(
                "rig.cameras",
                f"The software cameras do not start: {reason}",
                "Correct the reported cause and retry.",
            )
        time.sleep(_POLL_S)


def _need_root(verb: str) -> None:
    if os.geteuid() != 0:
        raise BusError(
            "rig.root",
            "Only root can create and remove named network interfaces.",
            f"Run 'sudo ocmm rig {verb}', or use the source ethercat:virtual, without rights.",
        )


def _start_time(pid: int) -> int | None:
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    # The name of the program, in parentheses, may hold anything.
    state, *rest = fields.rpartition(")")[2].split()
    return None if state == "Z" else int(rest[18])


def _is_running(record: RigRecord) -> bool:
    return _start_time(record.pid) == record.started


def _folder() -> Path:
    return platformdirs.user_state_path("ocmm", ensure_exists=True)


def _state_file() -> Path:
    return _folder() / "rig.json"


def _config_file() -> Path:
    return _folder() / "rig-cameras.json"


def _log_file() -> Path:
    return _folder() / "rig-cameras.log"
