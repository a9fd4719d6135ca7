"""Configuration (JSON) and start command of the bus process: interpreter, and so the rights.

On a workstation a copy of the interpreter, made by ``installer/linux/grant-rights.sh``, carries the
rights of the bus process; the application's interpreter has none. In an installed package
``ocmm-acq`` is a separate program with rights from the package.
"""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path
from typing import ClassVar

import msgspec

from ocmm_core.acquisition.bus_process._rights import NEEDED, granted_by, rights_of
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.described import DeviceDescription
from ocmm_core.fieldbus.device import CameraIdentity, Intrinsics
from ocmm_core.host import HOST, require_linux


class ProcessConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a program gets from its parent, in the first line of its standard input."""

    def to_json(self) -> bytes:
        """Return the request as one line of JSON."""
        return msgspec.json.encode(self) + b"\n"


class WireErrand(ProcessConfig, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A short task on the wire with the rights of the bus process."""

    module: ClassVar[str]
    """Program that does it."""
    interface: str
    force: bool = False
    """Use the interface although the computer uses it for its network."""

    def command(self) -> list[str]:
        """Return the command of its program, with the bus process interpreter."""
        return [*bus_command()[:-1], self.module]


class BusConfig(ProcessConfig, frozen=True, kw_only=True, forbid_unknown_fields=True):
    interface: str
    ring_path: str
    cameras: tuple[CameraIdentity, ...]
    frame_period_ns: int = 125_000
    cycle_period_ns: int = 1_000_000
    """`frame_period_ns`, `cycle_period_ns`: exposure and bus cycle periods."""
    force: bool = False
    """Use the interface although the computer uses it for its network."""
    redundant_interface: str = ""
    """Interface at the other end of the ring; empty without redundancy."""
    stretched: bool = False
    """The interface belongs to a virtual wire whose time waits for this computer."""
    processor: int | None = None
    """CPU of the bus process; None: automatic."""
    device: DeviceDescription | None = None
    lenses: tuple[Intrinsics, ...] = ()
    """`device`, `lenses`: description of cameras of other makers, and their correction lenses."""


def read_config(content: bytes) -> BusConfig:
    """Return the configuration; raise InputError if invalid."""
    try:
        config = msgspec.json.decode(content, type=BusConfig)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise InputError(
            "bus.config",
            f"The configuration of the bus process is not valid: {error}.",
            "Start the bus process from OCMM, or correct that field.",
        ) from error
    cycle, frame = config.cycle_period_ns, config.frame_period_ns
    if frame < 50_000 or cycle < 250_000 or cycle % frame or cycle // frame > 8:
        raise InputError(
            "bus.periods",
            f"A bus cycle of {cycle} ns with frames every {frame} ns cannot be kept.",
            "Use a bus cycle of at least 250 us with 1 to 8 whole frame periods.",
        )
    device = config.device
    if device is not None and (device.cycle_ns, device.period_ns) != (cycle, frame):
        raise InputError(
            "bus.periods",
            f"The camera '{device.name}' needs a bus cycle of {device.cycle_ns} ns with "
            f"{device.exposures} exposure(s), not {cycle} ns with one every {frame} ns.",
            "Start it from OCMM, or correct its description.",
        )
    if device is not None and device.is_corrected and len(config.lenses) != len(config.cameras):
        raise InputError(
            "bus.config",
            f"The cameras '{device.name}' correct by themselves, but field 'lenses' says what "
            f"{len(config.lenses)} of {len(config.cameras)} correct with.",
            "Give the intrinsics of each camera.",
        )
    if not config.cameras:
        raise InputError(
            "bus.config",
            "Field 'cameras' of the bus configuration is empty.",
            "Name the cameras of the rig.",
        )
    return config


RECIPE = "sudo installer/linux/grant-rights.sh"
"""Command that grants missing rights."""
_NAME = "ocmm-acq-python"
_INSTALLED_NAME = "ocmm-acq"
_INSTALLED_RECIPE = "sudo usermod -aG ocmm NAME; then log in"
_MODULE = "ocmm_core.acquisition.bus_process._start"


def bus_command(interpreter: Path | None = None) -> list[str]:
    """Return the bus process command, for a granted copy next to `interpreter`."""
    require_linux("The camera bus")
    if getattr(sys, "frozen", False):
        return _installed_command(Path(sys.executable).with_name(_INSTALLED_NAME))
    ordinary = Path(sys.executable) if interpreter is None else interpreter
    chosen = ordinary
    if HOST.is_linux_like and os.geteuid() != 0:
        granted = ordinary.with_name(_NAME)
        if not why_not(granted, ordinary):
            chosen = granted
    # Isolated: a program that may send raw frames loads no code from the current folder, the
    # environment or the user's packages.
    return [str(chosen), "-I", "-m", _MODULE]


def _installed_command(program: Path) -> list[str]:
    """Return the packaged command; users without permission run it without its rights."""
    if os.geteuid() != 0 and not _why_not_safe(program, _INSTALLED_RECIPE):
        return [str(program)]
    return [sys.executable, "-I", "-m", _MODULE]


def why_not(granted: Path, ordinary: Path) -> str:
    """Return why `granted` cannot replace `ordinary` for the bus process, or empty."""
    again = f"run {RECIPE} again"
    try:
        there, original = granted.stat(), ordinary.stat()
    except OSError:
        return f"{granted} does not exist; run {RECIPE}"
    if (there.st_size, int(there.st_mtime)) != (original.st_size, int(original.st_mtime)):
        # Checked first, because a changed copy also differs.
        return (
            _changeable(granted, there, again)
            or f"{granted} is a copy of a different Python than {ordinary}; {again}"
        )
    return _why_not_safe(granted, again)


def _why_not_safe(granted: Path, again: str) -> str:
    try:
        there = granted.stat()
    except OSError:
        return f"{granted} does not exist; {again}"
    if changeable := _changeable(granted, there, again):
        return changeable
    if not os.access(granted, os.X_OK):
        return f"this user is not in the group that may run {granted}"
    if missing := NEEDED - granted_by(granted):
        return f"{granted} lacks {len(missing)} of {len(NEEDED)} rights; {again}"
    if os.statvfs(granted).f_flag & os.ST_NOSUID:
        return f"{granted} is on a file system that ignores capabilities (mounted 'nosuid')"
    own = rights_of()
    # The kernel would refuse to start it.
    if own.no_new_privileges or not own.bounding >= NEEDED:
        return "this program was started in a way that denies these rights to its child processes"
    return ""


def _changeable(granted: Path, there: os.stat_result, again: str) -> str:
    if not stat.S_ISREG(there.st_mode) or there.st_uid != 0 or there.st_mode & 0o022:
        return f"{granted} can be changed by users other than root; {again}"
    return ""
