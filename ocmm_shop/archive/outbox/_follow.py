"""The delivering process, one per outbox; low priority, ends with its parent."""

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

from ocmm_core.errors import OcmmError
from ocmm_core.host import HOST
from ocmm_core.side_files import open_guarded
from ocmm_shop.archive.outbox._courier import BackOff, Courier
from ocmm_shop.archive.outbox._notes import sweep
from ocmm_shop.archive.outbox._outbox import Outbox
from ocmm_shop.archive.stores import open_archive

_LOOK_S = 2.0
"""Polling interval of the outbox, s."""
_NICE = 10
_END_S = 2.0


@dataclass(frozen=True, slots=True)
class ArchivePlace:
    """Places of archive and outbox. `address`, `password`: as for `open_archive`."""

    address: str
    station: str
    """Empty is the name of this computer."""
    outbox: Path
    password: Path | None = None

    def courier(self, outbox: Outbox) -> Courier:
        return Courier(
            outbox, lambda: open_archive(self.address, password=self.password), self.station
        )


@contextlib.contextmanager
def only_one(folder: Path) -> Iterator[bool]:
    """Yield whether no other process delivers from this outbox; locked until the end."""
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
    """Deliver from the outbox until stopped."""
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
    """Starts and ends the delivering process, without waiting for the archive."""

    def __init__(self, place: ArchivePlace) -> None:
        self._place = place
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it; it reports errors in the outbox."""
        place = self._place
        password = [] if place.password is None else [str(place.password)]
        self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and module
            [
                sys.executable, "-m", "ocmm_shop.archive.outbox", place.address, place.station,
                str(place.outbox), *password,
            ],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def close(self) -> None:
        """End it within two seconds; a job in transfer is sent again by the next one."""
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
    """Deliver until stdin is closed; return the exit code."""
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
        # The outbox is unusable, which whoever queues the next job is told.
        return 1
    return 0
