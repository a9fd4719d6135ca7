"""The program ``ocmm-acq``: the camera bus in a process of its own.

It is the only part of the product that needs rights on the network and a real-time priority, and
the only one that a fault of the EtherCAT library could end. It reads its configuration as one
line of JSON from a file or from standard input, fills a ring in shared memory and ends when the
ring says so, on SIGTERM, or when the program that started it is gone (end of standard input).
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from pathlib import Path

from ocmm_core.acquisition.bus_config import BusConfig, read_config
from ocmm_core.acquisition.ethercat import EthercatSource
from ocmm_core.acquisition.realtime import BUS_PRIORITY, lock_memory, take_priority
from ocmm_core.acquisition.ring import FrameRing
from ocmm_core.acquisition.worker import AcquisitionWorker, StopReason
from ocmm_core.documents import read_bytes
from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus.bus import BusSettings

EXIT_FAILED = 2


def main() -> None:
    """Run the bus process; ``ocmm-acq [CONFIG.json]``, standard input without an argument."""
    try:
        sys.exit(_run(sys.argv[1:]))
    except OcmmError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(EXIT_FAILED)


def _run(arguments: list[str]) -> int:
    from_parent = not arguments
    content = sys.stdin.buffer.readline() if from_parent else read_bytes(Path(arguments[0]))
    config = read_config(content)
    ring = FrameRing.attach(config.ring_path)
    try:
        worker = AcquisitionWorker(EthercatSource(_settings(config)), ring)
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda _number, _frame: worker.request_stop())
        if from_parent:
            watch = threading.Thread(target=_stop_at_end_of_input, args=(worker,), daemon=True)
            watch.start()
        for missing in (take_priority(BUS_PRIORITY), lock_memory()):
            if missing:
                sys.stderr.write(f"note: {missing}\n")
        reason = worker.run()
        if reason is StopReason.FAILED:
            sys.stderr.write(f"{ring.text()}\n")
            return EXIT_FAILED
        return 0
    finally:
        ring.close()


def _settings(config: BusConfig) -> BusSettings:
    return BusSettings(
        config.interface,
        config.cameras,
        config.frame_period_ns,
        config.cycle_period_ns,
        config.force,
    )


def _stop_at_end_of_input(worker: AcquisitionWorker) -> None:
    # Unbuffered: at the end of the process nothing may hold the lock of the buffered stream.
    while os.read(sys.stdin.fileno(), 4096):
        pass
    worker.request_stop()


if __name__ == "__main__":
    main()
