"""Software cameras in cable order, and which end of the wire reaches them.

A frame entering at the first port is processed by each camera in turn. At a break (missing cable,
unpowered camera) it returns to its port; with a second port it leaves there. A frame from the
second port passes the cameras backwards unprocessed until a break returns it; then the cameras
behind the break process it in wire order (ETG.1000.4: the processing unit of a slave follows its
port 0).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ocmm_core.camera import CameraModel
from ocmm_core.fieldbus.described import DeviceDescription
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_sim.firmware import FirmwareBanks
from ocmm_sim.slave import (
    SENSOR_PX,
    CameraFrames,
    CameraStore,
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
