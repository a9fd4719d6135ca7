"""Scan of the wire with the necessary rights: a JSON line in, the devices as a line out."""

from __future__ import annotations

import sys

import msgspec

from ocmm_core.acquisition.bus_process._commands import run_errand
from ocmm_core.acquisition.bus_process._launch import bus_command
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.wire import RawLine, check_interface, encode_scan, scan_devices

_MODULE = "ocmm_core.acquisition.bus_process._scan_process"


class ScanConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    interface: str
    force: bool = False
    """Use the interface although the computer uses it for its network."""

    def to_json(self) -> bytes:
        """Return the configuration as one line of JSON."""
        return msgspec.json.encode(self) + b"\n"


def scan_command() -> list[str]:
    """Return the command of this process, with the bus process interpreter."""
    return [*bus_command()[:-1], _MODULE]


def main() -> None:
    run_errand(_run, "The bus scan")


def _run(content: bytes) -> None:
    try:
        config = msgspec.json.decode(content, type=ScanConfig)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise InputError(
            "bus.scan", f"Invalid scan request: {error}.", "Use the command 'ocmm bus scan'."
        ) from error
    check_interface(config.interface, force=config.force)
    line = RawLine(config.interface)
    try:
        devices = scan_devices(line.exchange)
    finally:
        line.close()
    sys.stdout.buffer.write(encode_scan(devices))
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
