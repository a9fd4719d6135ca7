"""EEPROM contents of the camera's slave controller, shared with the ESI file."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from ocmm_core.fieldbus.device._camera_slave import (
    DEFAULT_FRAME_PERIOD_NS,
    INPUT_DTYPE,
    INPUT_START,
)

SII_BYTES = 4096
DEVICE_GROUP = "OpticalSensors"
"""Device group in ESI file and EEPROM."""
PHYSICAL_PORTS = 0x0011
"""A nibble per port, port 0 first: two MII ports, the others absent (YY in the ESI file)."""
MAILBOX_REPEATS = 0x04
"""Bit in the category General: mailboxes are repeated on request; `DataLinkLayer` in ESI."""
MEMORY_END = INPUT_START + 3 * INPUT_DTYPE.itemsize
"""Required controller memory: process data have three consecutive buffers."""
SYNC_PULSE_NS = 10_000
"""Pulse length of SYNC0 and SYNC1: shorter than their shortest distance."""


@dataclass(frozen=True, slots=True)
class ControllerWords:
    """Configuration loaded from a controller's EEPROM (ETG.1000.4, PDI registers)."""

    controller: str
    """The chip, and its connection to the camera's processor."""
    pdi_control: int
    """Registers 0x0140 and 0x0141: low byte PDI type (5: SPI, 0x80: on-chip bus); high byte bit 1
    enhanced link detection, and on an ET1100 bit 2 the SYNC0/SYNC1 output unit, without which no
    signal appears."""
    pdi_configuration: int
    """Registers 0x0150 and 0x0151: low byte PDI (SPI mode 3), high byte pins. 0xEE: both are
    outputs, push-pull, active high, and raise an interrupt. 0 makes them inputs."""

    @property
    def content(self) -> bytes:
        """Return the first 14 bytes of the EEPROM, without station alias."""
        pulse = SYNC_PULSE_NS // 10
        return struct.pack("<7H", self.pdi_control, self.pdi_configuration, pulse, 0, 0, 0, 0)


CONTROLLERS = (
    ControllerWords("ET1100, connected by SPI", 0x0E05, 0xEE03),
    ControllerWords("IP core in the camera's FPGA, on-chip bus", 0x0280, 0xEE00),
)
"""The first is used by ESI file and software camera; use another entry's words for other hardware.
"""
SII_CONFIGURATION = CONTROLLERS[0].content
"""First words of the EEPROM without station alias, loaded at power-on."""
DC_ACTIVATE = 0x0700
"""Value of the activation register (0x0980) for both signals."""


@dataclass(frozen=True, slots=True)
class ClockMode:
    """A distributed clock mode offered in ESI file and EEPROM."""

    name: str
    text: str
    activate: int
    sync0_factor: int = 0
    sync1_factor: int = 0
    """`sync0_factor`, `sync1_factor`: of the bus cycle; negative: fraction, positive: multiple."""


CLOCK_MODES = (
    ClockMode(
        "DcSync",
        f"Exposures at SYNC0, 8 in a bus cycle ({DEFAULT_FRAME_PERIOD_NS} ns at 1 ms)",
        DC_ACTIVATE, sync0_factor=-8, sync1_factor=1,
    ),
    ClockMode("FreeRun", "Exposures by the camera's own clock; for commissioning", 0),
)  # fmt: skip
