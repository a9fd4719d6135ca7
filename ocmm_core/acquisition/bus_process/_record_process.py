"""Bus recorder in a process with the necessary rights.

Reads one line of JSON from standard input and writes a pcapng file to standard output, until its
time or size limit or the end of standard input. The parent stores the file.
"""

from __future__ import annotations

import select
import sys
import time

import msgspec

from ocmm_core.acquisition.bus_process._commands import run_errand
from ocmm_core.acquisition.bus_process._launch import bus_command
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.wire import Tap, check_interface, pcapng_end, pcapng_frame, pcapng_head

_MODULE = "ocmm_core.acquisition.bus_process._record_process"
_WAIT_S = 0.1
MOST_SECONDS, MOST_BYTES = 3600.0, 1 << 31


class RecordConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    interface: str
    force: bool = False
    seconds: float
    size_bytes: int
    """`seconds`, `size_bytes`: limits; the first one reached ends the recording."""
    program: str = "OCMM"

    def to_json(self) -> bytes:
        """Return the configuration as one line of JSON."""
        return msgspec.json.encode(self) + b"\n"


def record_command() -> list[str]:
    """Return the command of this process, with the bus process interpreter."""
    return [*bus_command()[:-1], _MODULE]


def main() -> None:
    run_errand(_run, "The recorder of the bus")


def _run(content: bytes) -> None:
    try:
        config = msgspec.json.decode(content, type=RecordConfig)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise InputError(
            "bus.record", f"Invalid request: {error}.", "Use the command 'ocmm bus record'."
        ) from error
    if not (0.0 < config.seconds <= MOST_SECONDS and 0 < config.size_bytes <= MOST_BYTES):
        raise InputError(
            "bus.record",
            f"A recording of {config.seconds:g} s and {config.size_bytes} bytes has no bound.",
            f"Give up to {MOST_SECONDS:.0f} s and {MOST_BYTES >> 20} MB.",
        )
    check_interface(config.interface, force=config.force)
    out = sys.stdout.buffer
    tap = Tap(config.interface)
    try:
        size = out.write(pcapng_head(config.interface, config.program))
        deadline = time.monotonic() + config.seconds
        while (left := deadline - time.monotonic()) > 0.0 and size < config.size_bytes:
            for frame in tap.frames(min(_WAIT_S, left)):
                size += out.write(
                    pcapng_frame(frame.content, frame.utc_ns, outgoing=frame.outgoing)
                )
                if size >= config.size_bytes:
                    break
            if select.select([sys.stdin], [], [], 0.0)[0]:
                break
        tap.count()
        out.write(pcapng_end(time.time_ns(), tap.received, tap.dropped))
        out.flush()
    finally:
        tap.close()


if __name__ == "__main__":
    main()
