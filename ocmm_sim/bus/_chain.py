"""Software cameras in cable order, which end of the wire reaches them, and their faults.

A frame entering at the first port is processed by each camera in turn. At a break (missing cable,
unpowered camera) it returns to its port; with a second port it leaves there. A frame from the
second port passes the cameras backwards unprocessed until a break returns it; then the cameras
behind the break process it in wire order (ETG.1000.4: the processing unit of a slave follows its
port 0). Faults are the `CameraDeed` of `_faults`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ocmm_core.camera import CameraModel
from ocmm_core.fieldbus.described import DeviceDescription
from ocmm_core.fieldbus.device import (
    DATA_CRC,
    DATA_CRC_AT,
    INPUT_DTYPE,
    INPUT_START,
    NEWEST_LAYOUT,
    CameraIdentity,
    ErrorRegister,
)
from ocmm_sim.bus import _faults as faults
from ocmm_sim.bus._faults import FaultKind
from ocmm_sim.firmware import FirmwareBanks
from ocmm_sim.slave import (
    AL_STATUS,
    SENSOR_PX,
    STATION_ADDRESS,
    CameraFrames,
    CameraStore,
    ClockPattern,
    DescribedCamera,
    Segment,
    SoftwareCamera,
    checksum_of_configuration,
)


@dataclass(frozen=True, slots=True)
class FramePath:
    """Path of a frame that enters at one end."""

    segment: Segment
    """Cameras that process it."""
    leaves: int | None
    """Port where it leaves, 0 or 1; None if it is lost."""


class Unit:
    """A camera position: its current camera and its faults.

    ``sees`` is the camera number for the provider, ``boots`` the earlier power-ons, ``device`` and
    ``lens`` describe a camera of another maker. State: ``powered``, ``plugged``, ``muted`` (only
    forwards frames), ``broken_behind`` (cable to the next camera).
    """

    def __init__(
        self,
        sees: int,
        identity: CameraIdentity,
        provider: CameraFrames,
        boots: int = 0,
        device: DeviceDescription | None = None,
        lens: CameraModel | None = None,
    ) -> None:
        self._device = device
        self._lens = lens
        self.sees = sees
        self.identity = identity
        self.provider = provider
        self.boots = boots
        self._store = CameraStore()
        self._banks = FirmwareBanks()
        self.powered = self.plugged = True
        self.muted = self.broken_behind = False
        self.described: DescribedCamera | None = None
        """Described camera, on the wire instead of `camera`; None for our own."""
        self.camera = self.switch_on(0)

    @property
    def slave(self) -> SoftwareCamera | DescribedCamera:
        """Return the slave on the wire."""
        return self.camera if self.described is None else self.described

    def switch_on(self, clock_ns: int) -> SoftwareCamera:
        """Restart the camera, with its clock advanced by `clock_ns`."""
        self.boots += 1
        self.powered = True
        if self._device is not None:
            self.described = DescribedCamera(
                self.sees, self.identity.serial, self.identity.alias, self.provider,
                self._device, self._lens,
            )  # fmt: skip
            self.described.esc.clock.jump(clock_ns)
        self._banks.start()
        self.camera = SoftwareCamera(
            self.sees,
            self.identity.serial,
            self.identity.alias,
            self.provider,
            self.boots,
            self._store,
            banks=self._banks,
            sensor=(
                self.identity.sensor,
                self.identity.width or SENSOR_PX,
                self.identity.height or SENSOR_PX,
            ),
        )
        self.camera.esc.clock.jump(clock_ns)
        self.camera.esc.eeprom_written = self._keep_alias
        if isinstance(self.provider, ClockPattern):
            self.provider.watch(self.sees, self.camera.esc, self.camera.buffer, self.boots)
        return self.camera

    def _keep_alias(self, eeprom: bytes) -> None:
        alias = int.from_bytes(eeprom[8:10], "little")
        if checksum_of_configuration(eeprom[:14]) == eeprom[14]:
            self.identity = replace(self.identity, alias=alias)


class Chain:
    """Units of a wire from the first port on, with one or two ends at the master."""

    def __init__(self, units: Sequence[Unit], ends: int = 1) -> None:
        self.units = tuple(units)
        self.order = list(range(len(self.units)))
        self.links = [True] * ends
        """Link state of each end; without link a frame returns."""
        self.ways: tuple[FramePath, ...] = ()
        self.lay()

    def lay(self) -> None:
        """Recompute both paths after a change of units or order."""
        line = [self.units[number] for number in self.order if self.units[number].plugged]
        first, open_end = _reached(line)
        if not line or not line[0].powered:
            there = FramePath(Segment([]), None)
        else:
            passes = open_end and len(self.links) == 2 and self.links[1]
            there = FramePath(_segment(first), 1 if passes else 0)
        if len(self.links) == 1:
            self.ways = (there,)
            return
        if open_end and line:
            # Without a link at the first end the first camera returns the frame.
            back = FramePath(Segment([]), 0) if self.links[0] else FramePath(_segment(first), 1)
            self.ways = (there, back)
            return
        last = _reached_from_behind(line)
        back = FramePath(_segment(last), 1) if last else FramePath(Segment([]), None)
        self.ways = (there, back)


def _segment(units: Sequence[Unit]) -> Segment:
    return Segment([unit.slave.esc for unit in units if not unit.muted])


def _reached(line: Sequence[Unit]) -> tuple[list[Unit], bool]:
    """Return the units reached from the front, and whether the other end is reached."""
    reached: list[Unit] = []
    for unit in line:
        if not unit.powered:
            return reached, False
        reached.append(unit)
        if unit.broken_behind:
            return reached, False
    return reached, True


def _reached_from_behind(line: Sequence[Unit]) -> list[Unit]:
    reached: list[Unit] = []
    for unit in reversed(line):
        # A cable broken behind the last camera cuts off the second port.
        if not unit.powered or unit.broken_behind:
            break
        reached.append(unit)
    return reached[::-1]


_CLOCK_STEP_NS = 1_234_567_891
"""Clock offset of a restarted camera."""
_SHARE = 0.3
_SPOILED_BYTES = 160
"""Header and first two frames of a camera's inputs: always used, unlike the last frames."""
_TIMES_BYTES = 16
"""Frame counter, exposure time and period: start of the header."""


class FaultCommands:
    """Executes fault commands on a chain; `seed` selects the damaged bits."""

    def __init__(self, chain: Chain, seed: int = 0) -> None:
        self._chain = chain
        self._random = np.random.default_rng(seed)
        self._to_unit: dict[FaultKind, Callable[[Unit, faults.CameraDeed, int], object]] = {
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
            FaultKind.REMAP: lambda unit, deed, _: unit.camera.remap(deed.value, deed.code),
            FaultKind.LINK_ERRORS: lambda unit, deed, _: unit.camera.esc.count_link_errors(
                0, deed.value
            ),
            FaultKind.BREAK: lambda unit, deed, _: setattr(unit, "broken_behind", bool(deed.value)),
        }

    def do(self, command: faults.CameraDeed, now_ns: int) -> faults.DeedAnswer:
        units = self._chain.units
        error = ""
        utc_ns = time.time_ns()
        if not 0 <= command.camera < len(units):
            error = f"there is no camera {command.camera}"
        else:
            self._to_unit[command.do](units[command.camera], command, now_ns)
            self._chain.lay()
        return faults.DeedAnswer(
            monotonic_ns=now_ns,
            utc_ns=utc_ns,
            order=tuple(number for number in self._chain.order if units[number].plugged),
            states=tuple(unit.slave.esc.memory[AL_STATUS] if unit.powered else 0 for unit in units),
            boots=tuple(unit.boots for unit in units),
            error=error,
        )

    def _swap(self, unit: Unit, command: faults.CameraDeed, _now_ns: int) -> None:
        order, other = self._chain.order, self._chain.units[command.value]
        one, two = order.index(command.camera), order.index(command.value)
        order[one], order[two] = order[two], order[one]
        _restart(unit)
        _restart(other)

    def _corrupt(self, unit: Unit, command: faults.CameraDeed, _now_ns: int) -> None:
        kind = command.value % faults.SHARED
        if kind in (faults.COPIED, faults.EXCHANGED):
            self._exchange_inputs(command, exchanged=kind == faults.EXCHANGED)
            return

        def spoil(memory: bytearray) -> None:
            with_sum = command.value == faults.CORRUPT_WITH_SUM
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

    def _exchange_inputs(self, command: faults.CameraDeed, *, exchanged: bool) -> None:
        """Let a camera send the inputs last sent by the next one, undamaged."""
        units = self._chain.units
        one, two = units[command.camera], units[(command.camera + 1) % 2]
        last: dict[int, bytes] = {}
        place = slice(INPUT_START, INPUT_START + INPUT_DTYPE.itemsize)
        share = _SHARE if command.value >= faults.SHARED else 1.0

        def spoil(mine: int, other: int, memory: bytearray) -> None:
            last[mine] = bytes(memory[place])
            if other in last and self._random.random() < share:
                memory[place] = last[other]

        one.camera.esc.spoil = partial(spoil, 0, 1)
        # If only one is faulty, the other sends its own inputs.
        two.camera.esc.spoil = partial(spoil, 1, 0 if exchanged else 2)


def _restart(unit: Unit) -> None:
    unit.switch_on(_CLOCK_STEP_NS * unit.boots)


def _jump(unit: Unit, command: faults.CameraDeed, now_ns: int) -> None:
    esc = unit.camera.esc
    esc.clock.jump(command.value)
    esc.now_ns = now_ns
    unit.camera.buffer.look_again(esc.system_time_ns)


def _plug(unit: Unit, _deed: faults.CameraDeed, _now_ns: int) -> None:
    unit.plugged = True
    _restart(unit)


def _exchange(unit: Unit, identity: CameraIdentity) -> None:
    unit.identity = identity
    _restart(unit)
