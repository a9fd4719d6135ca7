"""Links to a tracker: a computer on the network (TCP or UDP), or a serial line.

Source of the dialogue on a serial line: the public program ndicapi.
"""

from __future__ import annotations

import errno
import os
import select
import socket
import time
from collections.abc import Generator, Iterator

from ocmm_core.errors import AcquisitionError
from ocmm_trackers._ndi import command_of, text_of

_CHUNK = 1 << 16
_MOST_WAITING = 64
"""Packets of one read."""


class TrackerLink:
    """A connection to one computer, whose datagrams alone are received; OSError if it fails."""

    def __init__(self, address: tuple[str, int], *, datagrams: bool, connect_s: float) -> None:
        self._datagrams, self._address = datagrams, address
        if datagrams:
            self._address = (socket.gethostbyname(address[0]), address[1])
            self._sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM)]
        else:
            self._sockets = [socket.create_connection(address, connect_s)]
            # Markers that arrive late are worth less than small packets.
            self._sockets[0].setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data: bytes) -> None:
        """Send bytes, as one datagram if it sends these."""
        try:
            if self._datagrams:
                self._sockets[0].sendto(data, self._address)
            else:
                self._sockets[0].sendall(data)
        except OSError as error:
            raise _ended(
                f"The tracker ended the connection ({error.strerror or error})."
            ) from error

    def receive(self, wait_s: float) -> list[bytes]:
        """Return the bytes received within a wait, s; AcquisitionError at the end."""
        found: list[bytes] = []
        while len(found) < _MOST_WAITING:
            ready = select.select(self._sockets, [], [], 0.0 if found else wait_s)[0]
            if not ready:
                break
            for one in ready:
                data, why = b"", "closed"
                try:
                    data, sender = one.recvfrom(_CHUNK)
                except OSError as error:
                    why = error.strerror or str(error)
                if self._datagrams:
                    found.append(data if data and sender[0] == self._address[0] else b"")
                elif data:
                    found.append(data)
                else:
                    raise _ended(f"The tracker ended the connection ({why}).")
        return found

    def join(self, group: str, port: int) -> None:
        """Receive datagrams to a multicast address also."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as route:
            # Of several interfaces, the one towards the tracker.
            route.connect(self._address)
            local = route.getsockname()[0]
        one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sockets.append(one)
        one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        one.bind((group, port))
        both = socket.inet_aton(group) + socket.inet_aton(local)
        one.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, both)

    def close(self) -> None:
        """End the connection; idempotent."""
        for one in self._sockets:
            one.close()


_RESET = b"RESETBE6F\r"
_FIRST_BAUD, _OTHERS = 9600, (115200, 921600, 19200, 38400, 57600, 230400)
_WANTED = (("6", 921600), ("5", 115200), ("0", _FIRST_BAUD))
_PROBE = "TSTOP:"
"""Each device replies to it in any state."""
_STEP_S, _REPLY_S, _SWITCH_S = 0.05, 0.4, 0.1
_MOST_TEXT = 4096


class SerialLink:
    """A serial line to an NDI device, held for this program; AcquisitionError if it fails.

    `baud`: its present speed.
    """

    def __init__(self, path: str, reset_s: float) -> None:
        try:
            import fcntl
            import termios
        except ImportError as error:
            raise AcquisitionError(
                "tracker.line_linux",
                "Trackers on a serial line need Linux.",
                "Connect the tracker by its network, or use a computer with Linux.",
            ) from error
        self._path, self._reset_s, self.baud = path, reset_s, _FIRST_BAUD
        self._descriptor = -1
        try:
            self._descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._set(_FIRST_BAUD)
            fcntl.ioctl(self._descriptor, termios.TIOCEXCL)
        except OSError as error:
            self.close()
            raise _not_opened(path, error.errno or 0) from error

    def start(self) -> Iterator[None]:
        """Reset the device, and set the highest speed that both ends have, in short steps."""
        answers = False
        for digit, baud in _WANTED:
            if not answers:
                yield from self._find()
            if self.baud == baud:
                return
            answers = True
            if (yield from self._ask(f"COMM:{digit}0000")) == "OKAY":
                time.sleep(_SWITCH_S)
                self._set(baud)
                # Cable and adapter may not carry it.
                answers = bool((yield from self._ask(_PROBE)))
                if answers:
                    return

    def send(self, data: bytes) -> None:
        """Send bytes; a line that takes none for a while loses them, as a cable does."""
        while data and select.select([], [self._descriptor], [], _REPLY_S)[1]:
            try:
                data = data[os.write(self._descriptor, data) :]
            except OSError as error:
                raise self._ended(error.errno or 0) from error

    def receive(self, wait_s: float) -> list[bytes]:
        """Return the bytes received within a wait, s."""
        if not select.select([self._descriptor], [], [], wait_s)[0]:
            return []
        try:
            data = os.read(self._descriptor, _CHUNK)
        except BlockingIOError:
            return []
        except OSError as error:
            raise self._ended(error.errno or 0) from error
        if not data:
            raise self._ended(errno.EIO)
        return [data]

    def close(self) -> None:
        """Release the line; idempotent."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
        self._descriptor = -1

    def _set(self, baud: int, *, reset: bool = False) -> None:
        """Set raw bytes, 8N1 without handshake; drop waiting bytes; OSError if it is gone."""
        import termios

        code = getattr(termios, f"B{baud}")
        flags = termios.CS8 | termios.CREAD | termios.CLOCAL
        try:
            control = termios.tcgetattr(self._descriptor)[6]
            control[termios.VMIN], control[termios.VTIME] = 1, 0
            modes = [0, 0, flags, 0, code, code, control]
            termios.tcsetattr(self._descriptor, termios.TCSANOW, modes)
            termios.tcflush(self._descriptor, termios.TCIOFLUSH if reset else termios.TCIFLUSH)
            if reset:
                termios.tcsendbreak(self._descriptor, 0)
        except termios.error as error:
            raise OSError(*error.args) from error
        self.baud = baud

    def _find(self) -> Iterator[None]:
        """Reset the device, or find its speed if it does not hear a break."""
        self._set(_FIRST_BAUD, reset=True)
        if (yield from self._ask("", self._reset_s)):
            time.sleep(_SWITCH_S)
            return
        for baud in (_FIRST_BAUD, *_OTHERS):
            self._set(baud)
            if (yield from self._ask(_PROBE)):
                return
        speeds = ", ".join(map(str, (_FIRST_BAUD, *_OTHERS)))
        raise AcquisitionError(
            "tracker.line_silent",
            f"No NDI device answers on the serial line {self._path} ({speeds} baud).",
            "Check cable and power, and wait until the device has started; the lines are listed "
            "by: ls -l /dev/serial/by-id",
        )

    def _ask(self, command: str, wait_s: float = _REPLY_S) -> Generator[None, None, str]:
        """Send a command, and return the reply, or that to a break; empty if none comes."""
        if command:
            self.send(command_of(command))
        text, deadline = b"", time.monotonic() + wait_s
        while time.monotonic() < deadline:
            text = (text + b"".join(self.receive(_STEP_S)))[-_MOST_TEXT:]
            if _RESET in text:
                return "RESET"
            for line in text.split(b"\r")[:-1]:
                reply = text_of(line)
                if reply and command:
                    return reply
            yield
        return ""

    def _ended(self, number: int) -> AcquisitionError:
        return _ended(f"The serial line {self._path} has ended ({os.strerror(number)}).")


def _ended(what: str) -> AcquisitionError:
    return AcquisitionError("tracker.closed", what, "Check its program, cable and power.")


def _not_opened(path: str, number: int) -> AcquisitionError:
    """Return the sentence for an error of opening a line."""
    match number:
        case errno.EACCES | errno.EPERM:
            return AcquisitionError(
                "tracker.line_rights",
                f"This user has no right to open the serial line {path}.",
                "Add the user to the group of the line: sudo usermod -aG dialout NAME; then log "
                "out and in.",
            )
        case errno.EBUSY | errno.EAGAIN:
            return AcquisitionError(
                "tracker.line_held",
                f"Another program holds the serial line {path}.",
                "End it, such as the program of the maker or a terminal; this finds it: "
                f"fuser {path}",
            )
    return AcquisitionError(
        "tracker.line_absent",
        f"There is no serial line {path} ({os.strerror(number)}).",
        "Plug the cable in, and switch the tracker on; the lines are listed by: "
        "ls -l /dev/serial/by-id",
    )
