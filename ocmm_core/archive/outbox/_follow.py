"""The process that hands over: started by a window, a station or systemd, one for each outbox.

It gives way to whatever measures (nice), ends when whoever started it has gone, and leaves the box
to another one that is at it already.
"""

from __future__ import annotations

import contextlib
import os
import random
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.archive.outbox._courier import BackOff, Courier
from ocmm_core.archive.outbox._notes import sweep
from ocmm_core.archive.outbox._outbox import Outbox
from ocmm_core.archive.stores import open_archive
from ocmm_core.errors import OcmmError
from ocmm_core.host import HOST
from ocmm_core.side_files import open_guarded

_LOOK_S = 2.0
"""How long a job waits at most before it is seen."""
_NICE = 10
_END_S = 2.0


@dataclass(frozen=True, slots=True)
class ArchivePlace:
    """What a hand-over needs to know.

    Attributes
    ----------
    address, password
        As for `open_archive`.
    """

    address: str
    station: str
    """Name of the station; empty is that of this computer."""
    outbox: Path
    """Folder of the outbox."""
    password: Path | None = None

    def courier(self, outbox: Outbox) -> Courier:
        """Return what hands over from an open outbox."""
        return Courier(
            outbox, lambda: open_archive(self.address, password=self.password), self.station
        )


@contextlib.contextmanager
def only_one(folder: Path) -> Iterator[bool]:
    """Give whether nobody else hands over from this outbox; it is held until the end."""
    folder.mkdir(parents=True, exist_ok=True)
    descriptor = open_guarded(folder / "lock", flags=os.O_RDWR | os.O_CREAT)
    try:
        try:
            HOST.lock(descriptor)
        except BlockingIOError:
            yield False
        else:
            yield True
    finally:
        os.close(descriptor)


def follow(place: ArchivePlace, stop: threading.Event, rng: random.Random) -> None:
    """Hand over whatever is put into the outbox until told to stop."""
    HOST.stand_back(_NICE)
    with only_one(place.outbox) as alone:
        if not alone:
            return
        pauses = BackOff(rng)
        with Outbox(place.outbox) as outbox:
            courier = place.courier(outbox)
            sweep(outbox)
            try:
                while not stop.is_set():
                    handed = courier.send_waiting(stop.is_set)
                    if handed.error is None:
                        pauses.good()
                        if handed.sent:
                            outbox.prune()
                        stop.wait(_LOOK_S)
                    else:
                        stop.wait(pauses.next_s())
            finally:
                courier.close()


class HandOverProcess:
    """Starts the process that hands over, and ends it; no call waits for the archive.

    Parameters
    ----------
    place
        What it needs to know.
    """

    def __init__(self, place: ArchivePlace) -> None:
        self._place = place
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it; what goes wrong then stands in the outbox."""
        place = self._place
        password = [] if place.password is None else [str(place.password)]
        self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and module
            [
                sys.executable, "-m", "ocmm_core.archive.outbox", place.address, place.station,
                str(place.outbox), *password,
            ],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def close(self) -> None:
        """End it within two seconds; a job that is under way is sent again by the next one."""
        if self._process is None:
            return
        process, self._process = self._process, None
        if process.stdin is not None:
            with contextlib.suppress(OSError):
                process.stdin.close()
        try:
            process.wait(_END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def main(arguments: list[str]) -> int:
    """Hand over until the standard input is closed; return the exit code."""
    address, station, outbox, *password = arguments
    stop = threading.Event()

    def wait_for_end() -> None:
        with contextlib.suppress(OSError):
            while sys.stdin.buffer.read(1):
                pass
        stop.set()

    threading.Thread(target=wait_for_end, daemon=True, name="end").start()
    place = ArchivePlace(address, station, Path(outbox), Path(password[0]) if password else None)
    try:
        follow(place, stop, random.Random(os.getpid()))  # noqa: S311 - pauses only
    except OcmmError:
        # The outbox itself cannot be used: whoever puts the next job in is told so.
        return 1
    return 0
