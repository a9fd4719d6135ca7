"""Permanent changes to a camera in a process with the necessary rights; idle bus only.

A line of JSON on standard input; lines of JSON as output: progress, then the result.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import msgspec

from ocmm_core.acquisition.bus_process._commands import run_errand
from ocmm_core.acquisition.bus_process._launch import bus_command
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.objects import update_firmware, write_alias
from ocmm_core.fieldbus.wire import RawLine, check_interface

_MODULE = "ocmm_core.acquisition.bus_process._maintenance_process"
_TELL_S = 0.1


class MaintenanceConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    interface: str
    force: bool = False
    serial: int
    alias: int = 0
    """Station alias to store; 0: none."""
    firmware: str = ""
    """Firmware file; empty: none."""

    def to_json(self) -> bytes:
        """Return the configuration as one line of JSON."""
        return msgspec.json.encode(self) + b"\n"


class MaintenanceNews(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    done: int = 0
    total: int = 0
    words: str = ""
    """Result, at the end; empty before."""


def maintenance_command() -> list[str]:
    """Return the command of this process, with the bus process interpreter."""
    return [*bus_command()[:-1], _MODULE]


def main() -> None:
    run_errand(_run, "The maintenance of a camera")


def _run(content: bytes) -> None:
    try:
        config = msgspec.json.decode(content, type=MaintenanceConfig)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise InputError(
            "bus.maintenance", f"Invalid request: {error}.", "Use the commands 'ocmm camera'."
        ) from error
    image = read_bytes(Path(config.firmware)) if config.firmware else b""
    check_interface(config.interface, force=config.force)
    line = RawLine(config.interface)
    told_s = 0.0

    def tell(done: int, total: int) -> None:
        nonlocal told_s
        if time.monotonic() - told_s > _TELL_S or done == total:
            told_s = time.monotonic()
            _say(MaintenanceNews(done=done, total=total))

    try:
        words = []
        if config.alias:
            before = write_alias(line.exchange, config.serial, config.alias)
            words.append(
                f"The camera with serial number {config.serial} stores the alias {config.alias} "
                f"(before: {before}). Switch it off and on."
            )
        if image:
            firmware = update_firmware(line.exchange, config.serial, image, tell)
            words.append(
                f"The camera with serial number {config.serial} runs the firmware "
                f"{firmware.version}."
            )
    finally:
        line.close()
    _say(MaintenanceNews(words=" ".join(words) or "Nothing was to be done."))


def _say(news: MaintenanceNews) -> None:
    sys.stdout.buffer.write(msgspec.json.encode(news) + b"\n")
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
