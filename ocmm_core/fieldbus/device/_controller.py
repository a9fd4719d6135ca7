"""What the slave controller of the camera loads from its EEPROM, and what tools are told of it.

ESI file and EEPROM are made from it, so that they cannot say anything else.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from ocmm_core.fieldbus.device._camera_slave import (
    DEFAULT_FRAME_PERIOD_NS,
    INPUT_DTYPE,
    INPUT_START,
)

SII_BYTES = 4096
"""Size of the EEPROM."""
DEVICE_GROUP = "OpticalSensors"
"""What tools list the camera under: the same word in ESI file and EEPROM."""
PHYSICAL_PORTS = 0x0011
"""A nibble a port, port 0 first: two of MII, the others not there (YY in the ESI file)."""
MAILBOX_REPEATS = 0x04
"""Bit of the flags in the category General: the last mailbox is sent again when it is asked for;
`DataLinkLayer` in the ESI file."""
MEMORY_END = INPUT_START + 3 * INPUT_DTYPE.itemsize
"""So far the memory of a controller must reach: process data have three buffers in a row."""
SYNC_PULSE_NS = 10_000
"""How long a pulse of SYNC0 and SYNC1 is: shorter than their shortest distance."""


@dataclass(frozen=True, slots=True)
class ControllerWords:
    """Configuration that a slave controller loads from its EEPROM (ETG.1000.4, PDI registers)."""

    controller: str
    """The chip, and how the camera's processor is connected to it."""
    pdi_control: int
    """Registers 0x0140 and 0x0141: low byte the kind of connection (5: SPI, 0x80: on-chip bus);
    high byte bit 1 enhanced link detection, and on an ET1100 bit 2 the unit that gives SYNC0 and
    SYNC1 out: without it there is no signal, whatever a master activates."""
    pdi_configuration: int
    """Registers 0x0150 and 0x0151: low byte the connection (SPI mode 3: clock and data), high byte
    the pins. 0xEE: both are outputs, push-pull and active high, and both raise an interrupt. With 0
    they were inputs."""

    @property
    def content(self) -> bytes:
        """Return the first 14 bytes of the EEPROM, without station alias."""
        pulse = SYNC_PULSE_NS // 10
        return struct.pack("<7H", self.pdi_control, self.pdi_configuration, pulse, 0, 0, 0, 0)


CONTROLLERS = (
    ControllerWords("ET1100, connected by SPI", 0x0E05, 0xEE03),
    ControllerWords("IP core in the camera's FPGA, on-chip bus", 0x0280, 0xEE00),
)
"""The first is what ESI file and software camera have; who builds with another takes its words."""
SII_CONFIGURATION = CONTROLLERS[0].content
"""Its first words without station alias: what the controller loads at power-on."""
DC_ACTIVATE = 0x0700
"""What a master writes into the activation register (0x0980) for both signals."""


@dataclass(frozen=True, slots=True)
class ClockMode:
    """A way to use the distributed clock, as ESI file and EEPROM offer it."""

    name: str
    text: str
    """`name`, `text`: For people."""
    activate: int
    """Content of the activation register."""
    sync0_factor: int = 0
    sync1_factor: int = 0
    """`sync0_factor`, `sync1_factor`: Periods by the bus cycle: negative is a part of it, positive
    so many of it."""


CLOCK_MODES = (
    ClockMode(
        "DcSync",
        f"Exposures at SYNC0, 8 in a bus cycle ({DEFAULT_FRAME_PERIOD_NS} ns at 1 ms)",
        DC_ACTIVATE, sync0_factor=-8, sync1_factor=1,
    ),
    ClockMode("FreeRun", "Exposures by the camera's own clock; for commissioning", 0),
)  # fmt: skip
