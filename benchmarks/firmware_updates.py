"""Does an interrupted update kill a camera? Power goes at a random write, at times twice in a row.

Run: ``python -m benchmarks.firmware_updates [COUNT]``. Ends with 1 where a camera is dead.
"""

from __future__ import annotations

import struct
import sys

import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.fieldbus.device import PRODUCT_CODE, REVISION, Firmware
from ocmm_core.fieldbus.objects import FIRMWARE_NAME, FoeWrite
from ocmm_sim.firmware import FirmwareBanks, FoeServer, PowerLossError, maker_key

UPDATES = 1000
MAILBOX_BYTES = 256
_MOST_WRITES = 40
_NEVER = 1 << 30


def firmware(version: str, size: int = 5000, product: int = PRODUCT_CODE) -> bytes:
    """Return a firmware file that the maker of software cameras signed."""
    content = np.random.default_rng(size).bytes(size)
    return Firmware(version, product, (REVISION, REVISION), content).signed(maker_key())


def send(server: FoeServer, image: bytes) -> None:
    """Send a file packet by packet."""
    transfer = FoeWrite(FIRMWARE_NAME, image, MAILBOX_BYTES)
    counter = 1
    while not transfer.done:
        mailbox = transfer.request(counter)
        (length,) = struct.unpack_from("<H", mailbox)
        transfer.answer(server.answer(mailbox[6 : 6 + length]))
        counter = counter % 7 + 1


def server_of(banks: FirmwareBanks) -> FoeServer:
    """Return the camera's side, in BOOT."""
    return FoeServer(banks, MAILBOX_BYTES, lambda: True)


class _Power:
    """Ends after the given number of writes."""

    def __init__(self) -> None:
        self.left = _NEVER

    def written(self) -> None:
        self.left -= 1
        if self.left < 0:
            raise PowerLossError


def interrupted(count: int, seed: int) -> tuple[int, int, int]:
    """Interrupt updates; return the numbers of cameras with old and new firmware, and dead."""
    random = np.random.default_rng(seed)
    old = new = dead = 0
    images = {version: firmware(version, 3000) for version in ("3.1.0", "3.2.0")}
    power = _Power()
    banks = FirmwareBanks(power.written)
    for number in range(count):
        before = banks.version
        wanted = "3.2.0" if before == "3.1.0" else "3.1.0"
        power.left = int(random.integers(0, _MOST_WRITES))
        try:
            send(server_of(banks), images[wanted])
            banks.start()
            banks.confirm()
        except PowerLossError:
            pass
        # The power comes back, every third time to go again at once.
        power.left = int(random.integers(0, 2)) if number % 3 == 0 else _NEVER
        try:
            banks.start()
        except PowerLossError:
            power.left = _NEVER
            banks.start()
        except InputError:
            dead += 1
            power.left = _NEVER
            banks = FirmwareBanks(power.written)
            continue
        power.left = _NEVER
        banks.confirm()
        old += banks.version == before
        new += banks.version == wanted
    return old, new, dead


def main() -> int:
    """Print what became of the cameras and return the exit code."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else UPDATES
    old, new, dead = interrupted(count, 1)
    print(
        f"{count} interrupted updates: {old} run the old firmware, {new} the new, {dead} are dead"
    )
    return 1 if dead or old + new != count else 0


if __name__ == "__main__":
    sys.exit(main())
