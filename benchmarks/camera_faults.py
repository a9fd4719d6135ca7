"""Faults of software cameras, with their messages and their execution on a chain."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from functools import partial

import msgspec
import numpy as np

from ocmm_core.fieldbus.device import (
    DATA_CRC,
    DATA_CRC_AT,
    INPUT_DTYPE,
    INPUT_START,
    NEWEST_LAYOUT,
    SM_ASSIGNMENT,
    SM_INPUTS,
    CameraIdentity,
    ErrorRegister,
)
from ocmm_sim.bus import Chain, Unit
from ocmm_sim.slave import AL_STATUS, STATION_ADDRESS, Esc, SoftwareCamera

CORRUPT_WITH_SUM, COPIED, EXCHANGED, SHARED = 2, 3, 4, 16
"""Values of `FaultKind.CORRUPT`; the last one is added to another."""


class FaultKind(StrEnum):
    """Fault of a camera or its cable, with the meaning of ``value``."""

    NOTHING = "nothing"
    POWER_OFF = "power off"
    """The camera and the cable behind it are dead."""
    POWER_ON = "power on"
    """The camera starts: next boot counter, unconfigured, other clock."""
    RESTART = "restart"
    MUTE = "mute"
    """1: frames pass the camera unprocessed; 0: end."""
    FREEZE = "freeze"
    """1: the camera's program hangs, its controller continues; 0: end."""
    FALL_BACK = "fall back"
    """Fall to AL state ``value`` with AL status code ``code``."""
    STATION = "station"
    SERIAL = "serial"
    """Replace the camera by one with serial number ``value``."""
    ALIAS = "alias"
    """Replace the camera by one with station alias ``value``."""
    SWAP = "swap"
    """Swap cables with camera ``value``, both off meanwhile."""
    UNPLUG = "unplug"
    """Remove the camera and join its cables."""
    PLUG = "plug"
    """Reconnect the camera, restarted."""
    CLOCK_JUMP = "clock jump"
    CLOCK_RATE = "clock rate"
    """The camera's clock runs ``value`` ppb too fast."""
    FRAME_PERIOD = "frame period"
    """Expose every ``value`` ns regardless of the configuration; 0: end."""
    HANG_MAILBOX = "hang mailbox"
    """1: mailboxes are accepted and never answered; 0: end."""
    EMERGENCY = "emergency"
    """Send an emergency message with error code ``value``; 0: the error is over."""
    CORRUPT = "corrupt"
    """1: one bit of each answer is wrong; 2: one bit of frame counter and times, with valid
    checksum; 3: the inputs are those of the next camera; 4: and vice versa; 16 more: in three of
    ten cycles only; 0: end."""
    REMAP = "remap"
    """Position ``value`` of the input assignment shows the mapping object ``code``."""
    LINK_ERRORS = "link errors"
    BREAK = "break"
    """1: the cable behind the camera is broken; 0: repaired."""


class CameraDeed(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A fault command; see `FaultKind` for ``value`` and ``code``."""

    do: FaultKind
    camera: int = 0
    """Camera number in the segment configuration, 0 first."""
    value: int = 0
    code: int = 0


class DeedAnswer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """State after a fault command."""

    monotonic_ns: int
    utc_ns: int
    """`monotonic_ns`, `utc_ns`: time of effect."""
    order: tuple[int, ...] = ()
    """Numbers of the plugged cameras in wire order."""
    states: tuple[int, ...] = ()
    """AL states with error bit; 0 without power."""
    boots: tuple[int, ...] = ()
    error: str = ""


_CLOCK_STEP_NS = 1_234_567_891
"""Clock offset of a restarted camera."""
_SHARE = 0.3
_RX_ERRORS = 0x0300
"""Register of the broken frames of port 0."""
_SPOILED_BYTES = 160
"""Header and first two frames of a camera's inputs: always used, unlike the last frames."""
_TIMES_BYTES = 16
"""Frame counter, exposure time and period: start of the header."""


class FaultCommands:
    """Executes fault commands on a chain; `seed` selects the damaged bits."""

    def __init__(self, chain: Chain, seed: int = 0) -> None:
        self._chain = chain
        self._random = np.random.default_rng(seed)
        self._to_unit: dict[FaultKind, Callable[[Unit, CameraDeed, int], object]] = {
            FaultKind.NOTHING: lambda *_: None,
            FaultKind.POWER_OFF: lambda unit, *_: setattr(unit, "powered", False),
            FaultKind.POWER_ON: lambda unit, *_: _restart(unit),
            FaultKind.RESTART: lambda unit, *_: _restart(unit),
            FaultKind.MUTE: lambda unit, deed, _: setattr(unit, "muted", bool(deed.value)),
            FaultKind.FREEZE: lambda unit, deed, _: setattr(unit.slave, "frozen", bool(deed.value)),
            FaultKind.FALL_BACK: lambda unit, deed, _: unit.slave.esc.fall_back(
                deed.value, deed.code
            ),
            FaultKind.STATION: lambda unit, deed, _: unit.camera.esc.write(
                STATION_ADDRESS, deed.value.to_bytes(2, "little")
            ),
            FaultKind.SERIAL: lambda unit, deed, _: _exchange(
                unit, replace(unit.identity, serial=deed.value)
            ),
            FaultKind.ALIAS: lambda unit, deed, _: _exchange(
                unit, replace(unit.identity, alias=deed.value)
            ),
            FaultKind.SWAP: self._swap,
            FaultKind.UNPLUG: lambda unit, *_: setattr(unit, "plugged", False),
            FaultKind.PLUG: _plug,
            FaultKind.CLOCK_JUMP: _jump,
            FaultKind.CLOCK_RATE: lambda unit, deed, now: unit.camera.esc.clock.set_rate(
                deed.value, now
            ),
            FaultKind.HANG_MAILBOX: lambda unit, deed, _: setattr(
                unit.camera, "mailbox_hangs", bool(deed.value)
            ),
            FaultKind.EMERGENCY: lambda unit, deed, _: unit.camera.emergency(
                deed.value, ErrorRegister.GENERIC if deed.value else 0
            ),
            FaultKind.FRAME_PERIOD: lambda unit, deed, _: setattr(
                unit.camera, "period_override", deed.value
            ),
            FaultKind.CORRUPT: self._corrupt,
            FaultKind.REMAP: lambda unit, deed, _: remap(unit.camera, deed.value, deed.code),
            FaultKind.LINK_ERRORS: lambda unit, deed, _: count_link_errors(
                unit.camera.esc, 0, deed.value
            ),
            FaultKind.BREAK: lambda unit, deed, _: setattr(unit, "broken_behind", bool(deed.value)),
        }

    def do(self, command: CameraDeed, now_ns: int) -> DeedAnswer:
        """Inject a fault and return the state after it."""
        units = self._chain.units
        error = ""
        utc_ns = time.time_ns()
        if not 0 <= command.camera < len(units):
            error = f"there is no camera {command.camera}"
        else:
            self._to_unit[command.do](units[command.camera], command, now_ns)
            self._chain.lay()
        return DeedAnswer(
            monotonic_ns=now_ns,
            utc_ns=utc_ns,
            order=tuple(number for number in self._chain.order if units[number].plugged),
            states=tuple(unit.slave.esc.memory[AL_STATUS] if unit.powered else 0 for unit in units),
            boots=tuple(unit.boots for unit in units),
            error=error,
        )

    def _swap(self, unit: Unit, command: CameraDeed, _now_ns: int) -> None:
        order, other = self._chain.order, self._chain.units[command.value]
        one, two = order.index(command.camera), order.index(command.value)
        order[one], order[two] = order[two], order[one]
        _restart(unit)
        _restart(other)

    def _corrupt(self, unit: Unit, command: CameraDeed, _now_ns: int) -> None:
        kind = command.value % SHARED
        if kind in (COPIED, EXCHANGED):
            self._exchange_inputs(command, exchanged=kind == EXCHANGED)
            return

        def spoil(memory: bytearray) -> None:
            with_sum = command.value == CORRUPT_WITH_SUM
            bit = int(self._random.integers(8 * (_TIMES_BYTES if with_sum else _SPOILED_BYTES)))
            memory[INPUT_START + bit // 8] ^= 1 << bit % 8
            if with_sum:
                inputs = memory[INPUT_START : INPUT_START + INPUT_DTYPE.itemsize]
                crc = NEWEST_LAYOUT.crc(inputs, unit.identity.serial)
                DATA_CRC.pack_into(memory, INPUT_START + DATA_CRC_AT, crc)

        unit.camera.esc.spoil = spoil if command.value else None
        if not command.value:
            for other in self._chain.units:
                other.camera.esc.spoil = None

    def _exchange_inputs(self, command: CameraDeed, *, exchanged: bool) -> None:
        """Let a camera send the inputs last sent by the next one, undamaged."""
        units = self._chain.units
        one, two = units[command.camera], units[(command.camera + 1) % 2]
        last: dict[int, bytes] = {}
        place = slice(INPUT_START, INPUT_START + INPUT_DTYPE.itemsize)
        share = _SHARE if command.value >= SHARED else 1.0

        def spoil(mine: int, other: int, memory: bytearray) -> None:
            last[mine] = bytes(memory[place])
            if other in last and self._random.random() < share:
                memory[place] = last[other]

        one.camera.esc.spoil = partial(spoil, 0, 1)
        # If only one is faulty, the other sends its own inputs.
        two.camera.esc.spoil = partial(spoil, 1, 0 if exchanged else 2)


def remap(camera: SoftwareCamera, position: int, mapping_index: int) -> None:
    """Assign another PDO at a position of the input assignment."""
    value = struct.pack("<H", mapping_index)
    camera.coe.set_value(SM_ASSIGNMENT + SM_INPUTS, position, value)


def count_link_errors(esc: Esc, port: int, count: int) -> None:
    """Count broken frames at a port, as after a damaged cable."""
    at = _RX_ERRORS + 2 * port
    esc.memory[at] = min(255, esc.memory[at] + count)


def _restart(unit: Unit) -> None:
    unit.switch_on(_CLOCK_STEP_NS * unit.boots)


def _jump(unit: Unit, command: CameraDeed, now_ns: int) -> None:
    esc = unit.camera.esc
    esc.clock.jump(command.value)
    esc.now_ns = now_ns
    unit.camera.buffer.look_again(esc.system_time_ns)


def _plug(unit: Unit, _deed: CameraDeed, _now_ns: int) -> None:
    unit.plugged = True
    _restart(unit)


def _exchange(unit: Unit, identity: CameraIdentity) -> None:
    unit.identity = identity
    _restart(unit)
