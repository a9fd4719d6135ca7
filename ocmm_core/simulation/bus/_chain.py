"""Software cameras in the order of their cables: who is reached from which end of the wire.

A frame that enters at the first port is worked on by each camera in turn. Where the wire ends, by
a missing cable or a camera without power, it turns round and leaves where it came in; with a
second port it leaves there. A frame that enters at the second port passes the cameras from behind,
without being worked on, until it turns round at a break; then the cameras behind that break work
on it on its way back, in the order of the wire (ETG.1000.4: the processing unit of a slave
follows its port 0).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ocmm_core.camera import CameraModel
from ocmm_core.fieldbus.described import DeviceDescription
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_core.simulation.described_slave import DescribedCamera
from ocmm_core.simulation.firmware import FirmwareBanks
from ocmm_core.simulation.slave import (
    SENSOR_PX,
    CameraFrames,
    CameraStore,
    ClockPattern,
    Segment,
    SoftwareCamera,
    checksum_of_configuration,
)


@dataclass(frozen=True, slots=True)
class FramePath:
    """What happens to a frame that enters at one end."""

    segment: Segment
    """Who works on it."""
    leaves: int | None
    """At which port it comes out, 0 or 1; None where it is lost."""


class Unit:
    """One place for a camera: the camera that is there now, and what is wrong with it.

    Parameters
    ----------
    sees
        Number of the camera for the provider.
    identity
        Who it is.
    provider
        What it sees.
    boots
        How often it was switched on before.
    device, lens
        Description of a camera that is not ours, and what it corrects with.

    Attributes
    ----------
    powered, plugged, muted
        Whether it has current, is on the wire, and only lets frames pass.
    broken_behind
        The cable to the next camera is broken.
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
        self._provider = provider
        self.boots = boots
        """How often it was switched on, this time included."""
        self._store = CameraStore()
        self._banks = FirmwareBanks()
        self.powered = self.plugged = True
        self.muted = self.broken_behind = False
        self.described: DescribedCamera | None = None
        """The same where a description made it; the other one then is not on the wire."""
        self.camera = self.switch_on(0)
        """The camera as it was last switched on."""

    @property
    def slave(self) -> SoftwareCamera | DescribedCamera:
        """Return who answers on the wire; `camera` where it is one of ours."""
        return self.camera if self.described is None else self.described

    def switch_on(self, clock_ns: int) -> SoftwareCamera:
        """Start the camera anew, with a clock that shows so much more than it would."""
        self.boots += 1
        self.powered = True
        if self._device is not None:
            self.described = DescribedCamera(
                self.sees, self.identity.serial, self.identity.alias, self._provider,
                self._device, self._lens,
            )  # fmt: skip
            self.described.esc.clock.jump(clock_ns)
        self._banks.start()
        self.camera = SoftwareCamera(
            self.sees,
            self.identity.serial,
            self.identity.alias,
            self._provider,
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
        if isinstance(self._provider, ClockPattern):
            self._provider.watch(self.sees, self.camera.esc, self.camera.buffer, self.boots)
        return self.camera

    def _keep_alias(self, eeprom: bytes) -> None:
        """Remember the alias in the EEPROM: the controller loads it when it is switched on."""
        alias = int.from_bytes(eeprom[8:10], "little")
        if checksum_of_configuration(eeprom[:14]) == eeprom[14]:
            self.identity = replace(self.identity, alias=alias)


class Chain:
    """The units of a wire with one or two ends.

    Parameters
    ----------
    units
        In the order in which a frame from the first port passes them.
    ends
        How many ends of the wire lead to the master, 1 or 2.
    """

    def __init__(self, units: Sequence[Unit], ends: int = 1) -> None:
        self.units = tuple(units)
        self.order = list(range(len(self.units)))
        self.links = [True] * ends
        """Whether there is a link at each end; a frame turns round where there is none."""
        self.ways: tuple[FramePath, ...] = ()
        self.lay()

    def lay(self) -> None:
        """Work out both ways anew, after anything about the units or their order changed."""
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
            # Without a link at the first end the first camera turns the frame round.
            back = FramePath(Segment([]), 0) if self.links[0] else FramePath(_segment(first), 1)
            self.ways = (there, back)
            return
        last = _reached_from_behind(line)
        back = FramePath(_segment(last), 1) if last else FramePath(Segment([]), None)
        self.ways = (there, back)


def _segment(units: Sequence[Unit]) -> Segment:
    return Segment([unit.slave.esc for unit in units if not unit.muted])


def _reached(line: Sequence[Unit]) -> tuple[list[Unit], bool]:
    """Return who is reached from the front, and whether the other end is."""
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
        # A cable broken behind the last camera cuts the second port off altogether.
        if not unit.powered or unit.broken_behind:
            break
        reached.append(unit)
    return reached[::-1]
