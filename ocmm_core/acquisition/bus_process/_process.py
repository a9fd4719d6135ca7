"""The program ``ocmm-acq``: the camera bus in a separate process.

Only this part needs network rights and a real-time priority, and could be ended by a fault of the
EtherCAT library. It reads its configuration as one line of JSON from a file or standard input,
fills a ring in shared memory and ends on request in the ring, on SIGTERM, or when its parent is
gone (end of standard input).
"""

from __future__ import annotations

import gc
import signal
import sys
import threading
from functools import partial
from pathlib import Path

import msgspec

from ocmm_core.acquisition.bus_process import _rights as rights
from ocmm_core.acquisition.bus_process._commands import CommandPort, read_first_line
from ocmm_core.acquisition.bus_process._ethercat import EthercatSource
from ocmm_core.acquisition.bus_process._launch import BusConfig, read_config
from ocmm_core.acquisition.bus_process._stepped_time import SteppedTime
from ocmm_core.acquisition.frames import AcquisitionWorker, FrameRing, leave_error
from ocmm_core.documents import read_bytes
from ocmm_core.failure import REOPEN, exit_with
from ocmm_core.fieldbus.cycle import BusSettings


def main() -> None:
    """Run ``ocmm-acq [--interface NAME | CONFIG.json]``, or by standard input."""
    try:
        sys.exit(_run(sys.argv[1:]))
    except Exception as error:
        exit_with(error, "The bus process", REOPEN)


def _run(arguments: list[str]) -> int:
    fixed = arguments[1] if arguments[:1] == ["--interface"] and len(arguments) > 1 else ""
    from_parent = bool(fixed) or not arguments
    content = read_first_line(sys.stdin.fileno()) if from_parent else read_bytes(Path(arguments[0]))
    config = read_config(content)
    if fixed:
        config = msgspec.structs.replace(
            config, interface=fixed, redundant_interface="", force=False, stretched=False
        )
    ring = FrameRing.attach(config.ring_path)
    port: CommandPort | None = None
    stop = threading.Event()
    try:
        notes = tuple(
            missing
            for missing in (
                rights.take_priority(rights.BUS_PRIORITY),
                rights.lock_memory(),
                rights.take_processor(config.processor),
            )
            if missing
        )
        for note in notes:
            sys.stderr.write(f"note: {note}\n")
        if from_parent:
            port = CommandPort.from_standard_streams(stop.set, partial(leave_error, ring))
        source = EthercatSource(
            _settings(config),
            ring.set_report,
            port,
            notes,
            SteppedTime(ring) if config.stretched else None,
        )
        worker = AcquisitionWorker(source, ring, stop)
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda _number, _frame: worker.request_stop())
        # A collection takes milliseconds; the source runs one when time is not critical.
        gc.collect()
        gc.freeze()
        gc.disable()
        return worker.run_program()
    finally:
        if port is not None:
            port.close()
        ring.close()


def _settings(config: BusConfig) -> BusSettings:
    return BusSettings(
        config.interface,
        config.cameras,
        config.frame_period_ns,
        config.cycle_period_ns,
        config.force,
        config.redundant_interface,
        config.device,
        config.lenses,
    )


if __name__ == "__main__":
    main()
