"""Client of the bus process as a service.

On a measuring cell's computer systemd starts the bus process (``installer/linux``) with rights that
no person has. Its socket gives permitted users a bus process with the protocol of pipes. An
unprivileged relay process adapts it: a child process with the service's output.
"""

from __future__ import annotations

import os
import select
import shutil
import socket
import sys
from pathlib import Path

from ocmm_core.acquisition.bus_process._client import ChildProcess
from ocmm_core.acquisition.bus_process._launch import BusConfig
from ocmm_core.acquisition.frames import FrameRing
from ocmm_core.errors import BusError
from ocmm_core.failure import EXIT_FAILED, REOPEN, exit_with

SERVICE_SOCKET = Path("/run/ocmm/acq.sock")
_READ_BYTES = 65536
_RING_MODE = 0o660


class ServiceBus(ChildProcess):
    """The service ``ocmm-acq``, as an `Acquisition`.

    `config`: the interface is ignored: the service sets it. `ring`: the ring named in `config`;
    writable by the group of the service from `start` on.
    """

    def __init__(self, config: BusConfig, ring: FrameRing, address: Path = SERVICE_SOCKET) -> None:
        # -I as in `_launch.bus_command`.
        command = [sys.executable, "-I", "-m", "ocmm_core.acquisition.bus_process._service_client"]
        super().__init__([*command, str(address)], config.to_json(), ring)
        self._ring_path = ring.path
        self._address = address

    def start(self) -> None:
        """Connect to the service; raise BusError if it is absent or not permitted."""
        try:
            group = self._address.stat().st_gid
        except OSError as error:
            raise BusError(
                "bus.service_missing",
                f"No camera bus service at {self._address} ({error.strerror}).",
                "Start it (sudo systemctl start ocmm-acq.socket), or name the interface of the "
                "cameras as their source: ethercat:INTERFACE (Settings, Instrument).",
            ) from error
        try:
            shutil.chown(self._ring_path, group=group)
            self._ring_path.chmod(_RING_MODE)
        except OSError as error:
            raise _not_allowed(self._address) from error
        super().start()


def relay(address: str, source: int, sink: int) -> bool:
    """Relay `source` and `sink` until one ends; True if `source` first; BusError: unreachable."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as service:
        try:
            service.connect(address)
        except PermissionError as error:
            raise _not_allowed(Path(address)) from error
        except OSError as error:
            raise BusError(
                "bus.service_missing",
                f"The camera bus service does not answer ({error.strerror}).",
                "Check it (systemctl status ocmm-acq.socket); another window may be using it.",
            ) from error
        listened_to = [source, service.fileno()]
        while True:
            ready = select.select(listened_to, [], [])[0]
            if source in ready:
                content = os.read(source, _READ_BYTES)
                if content:
                    service.sendall(content)
                else:
                    # The bus process sees the end of its input, but may still send output.
                    service.shutdown(socket.SHUT_WR)
                    listened_to = [service.fileno()]
            if service.fileno() in ready:
                content = service.recv(_READ_BYTES)
                if not content:
                    return source not in listened_to
                _write(sink, content)


def main() -> None:
    """Run the relay: ``python -m ..._service_client SOCKET``."""
    try:
        ours = relay(sys.argv[1], sys.stdin.fileno(), sys.stdout.fileno())
    except (BrokenPipeError, ConnectionResetError):
        ours = False
    except Exception as error:
        exit_with(error, "The relay to the camera bus service", REOPEN)
    if not ours:
        sys.stderr.write(
            "The camera bus service ended or refused; another window may be using it. See its "
            "log: journalctl -u 'ocmm-acq@*' -n 20\n"
        )
        sys.exit(EXIT_FAILED)


def _write(sink: int, content: bytes) -> None:
    rest = memoryview(content)
    while rest:
        rest = rest[os.write(sink, rest) :]


def _not_allowed(address: Path) -> BusError:
    return BusError(
        "bus.service_denied",
        f"This user may not use the camera bus service at {address}.",
        "Join its group: sudo usermod -aG ocmm $USER, then log in again.",
    )


if __name__ == "__main__":
    main()
