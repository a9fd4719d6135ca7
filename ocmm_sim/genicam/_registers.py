"""Memory of a software GigE Vision camera: bootstrap registers, features, and their XML.

Addresses and values follow GigE Vision 2 (big endian); the features are named after SFNC 2.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

SIZE = 0x4_0000
_XML = 0x2_0000

CONTROL, HEARTBEAT = 0x0A00, 0x0938
HOST_PORT, PACKET_SIZE, HOST_ADDRESS = 0x0D00, 0x0D04, 0x0D18
_TEST_PACKET = 1 << 31
_SIZE_MASK = 0xFFFF

FORMATS = {
    "Mono8": 0x0108_0001, "Mono10": 0x0110_0003, "Mono10Packed": 0x010C_0004,
    "Mono10p": 0x010A_0046, "Mono12": 0x0110_0005, "Mono12Packed": 0x010C_0006,
    "Mono12p": 0x010C_0047, "Mono16": 0x0110_0007, "RGB8": 0x0218_0014,
}  # fmt: skip
"""Codes of the Pixel Format Naming Convention."""
_SETS = {"Default": 0, "UserSet1": 1}
_PTP_STATES = {"Disabled": 3, "Uncalibrated": 8, "Slave": 9, "Master": 6}


class Feature(IntEnum):
    """Address of each feature; 8 bytes."""

    WIDTH = 0x1_0000
    HEIGHT = 0x1_0008
    OFFSET_X = 0x1_0010
    OFFSET_Y = 0x1_0018
    WIDTH_MAX = 0x1_0020
    HEIGHT_MAX = 0x1_0028
    PIXEL_FORMAT = 0x1_0030
    PAYLOAD = 0x1_0038
    EXPOSURE = 0x1_0040
    RATE = 0x1_0048
    START = 0x1_0050
    STOP = 0x1_0058
    LOCKED = 0x1_0060
    PTP_ENABLE = 0x1_0068
    PTP_STATUS = 0x1_0070
    PTP_LATCH = 0x1_0078
    PTP_OFFSET = 0x1_0080
    PTP_GRANDMASTER = 0x1_0088
    TRIGGER_MODE = 0x1_0090
    LINES = 0x1_0098
    GAMMA = 0x1_00A0
    EXPOSURE_AUTO = 0x1_00A8
    GAIN = 0x1_00B0
    USER_SET = 0x1_00B8
    USER_SET_SAVE = 0x1_00C0
    USER_SET_DEFAULT = 0x1_00C8
    RESULTING_RATE = 0x1_00D0


_LIMITS = {Feature.EXPOSURE: (10.0, 100_000.0), Feature.GAIN: (0.0, 24.0)}
"""Microseconds and decibels, clamped as cameras do."""


@dataclass(frozen=True, slots=True)
class GigeConfig:
    """A software camera: what a discovery of cameras reports, and its sensor."""

    serial: str
    address: str
    """IPv4 address; one camera each."""
    width: int
    height: int
    formats: tuple[str, ...] = ("Mono8", "Mono12", "Mono12p")
    packet_size: int = 8192
    """IP, UDP and GVSP headers included; the receiver may change it."""
    ptp: str = "Slave"
    """State that the camera reports once PTP is enabled; empty: a camera without PTP."""
    ptp_offset_ns: int = 120
    grandmaster: int = 0x0011_22FF_FE33_4455
    model: str = "Software Camera"
    keeps_gamma: bool = False
    """Gamma cannot be switched off."""
    link_hz: float = 10_000.0
    """Frames a second that the link carries."""


class Memory:
    """Registers of one camera; every access is checked against the memory size."""

    def __init__(self, config: GigeConfig) -> None:
        self.config = config
        self._bytes = bytearray(SIZE)
        self._fill()

    def read(self, address: int, count: int) -> bytes:
        """Return `count` bytes; IndexError outside the memory."""
        if not 0 <= address <= address + count <= SIZE:
            raise IndexError(f"{address:#x}")
        return bytes(self._bytes[address : address + count])

    def write(self, address: int, content: bytes) -> None:
        """Write bytes; IndexError outside the memory."""
        self.read(address, len(content))
        self._bytes[address : address + len(content)] = content

    def is_locked(self, address: int) -> bool:
        """Return whether an address cannot be written."""
        return self.config.keeps_gamma and Feature.GAMMA <= address < Feature.GAMMA + 8

    def u32(self, address: int) -> int:
        return int.from_bytes(self._bytes[address : address + 4], "big")

    def set_u32(self, address: int, value: int) -> None:
        self.write(address, struct.pack(">I", value))

    def integer(self, feature: Feature) -> int:
        return int.from_bytes(self._bytes[feature : feature + 8], "big", signed=True)

    def set_integer(self, feature: Feature, value: int) -> None:
        self.write(feature, struct.pack(">q", value))

    def real(self, feature: Feature) -> float:
        (value,) = struct.unpack_from(">d", self._bytes, feature)
        return float(value)

    def _set_real(self, feature: Feature, value: float) -> None:
        self.write(feature, struct.pack(">d", value))

    @property
    def format(self) -> str:
        """Return the name of the pixel format."""
        code = self.integer(Feature.PIXEL_FORMAT)
        return next((name for name, value in FORMATS.items() if value == code), "Mono8")

    @property
    def packet_size(self) -> int:
        return self.u32(PACKET_SIZE) & _SIZE_MASK

    def take_test_packet(self) -> bool:
        """Return whether a test packet is requested, and clear the request."""
        value = self.u32(PACKET_SIZE)
        self.set_u32(PACKET_SIZE, value & ~_TEST_PACKET)
        return value & _TEST_PACKET != 0

    def settle(self) -> None:
        """Update the registers that depend on others."""
        bits = FORMATS[self.format] >> 16 & 0xFF
        pixels = self.integer(Feature.WIDTH) * self.integer(Feature.HEIGHT)
        self.set_integer(Feature.PAYLOAD, pixels * bits // 8)
        for feature, (least, most) in _LIMITS.items():
            self._set_real(feature, min(max(self.real(feature), least), most))
        # No image is exposed while the one before is.
        rate = min(self.real(Feature.RATE), 1e6 / self.real(Feature.EXPOSURE))
        self._set_real(Feature.RATE, rate)
        self._set_real(Feature.RESULTING_RATE, min(rate, self.config.link_hz))
        enabled = self.integer(Feature.PTP_ENABLE) != 0
        state = _PTP_STATES[self.config.ptp if enabled and self.config.ptp else "Disabled"]
        self.set_integer(Feature.PTP_STATUS, state)
        self.set_integer(Feature.PTP_OFFSET, self.config.ptp_offset_ns)
        self.set_integer(Feature.PTP_GRANDMASTER, self.config.grandmaster)

    def _fill(self) -> None:
        config = self.config
        words = {
            0x0000: 0x0002_0000, 0x0004: 0x8000_0001, 0x0008: 0x0200, 0x000C: hash_of(config),
            0x0010: 7, 0x0014: 5, 0x0034: 0xFF00_0000, 0x0600: 1, 0x0900: 0, 0x0904: 1,
            0x0934: 0x0000_0007, HEARTBEAT: 3000, 0x093C: 0, 0x0940: 1_000_000_000,
            PACKET_SIZE: config.packet_size,
        }  # fmt: skip
        for address, value in words.items():
            self.set_u32(address, value)
        self.write(0x0024, bytes(int(part) for part in config.address.split(".")))
        xml = _xml(config).encode()
        texts = {
            0x0048: "OCMM", 0x0068: config.model, 0x0088: "1", 0x00D8: config.serial,
            0x0200: f"Local:camera.xml;{_XML:x};{len(xml):x}",
        }  # fmt: skip
        for address, text in texts.items():
            self.write(address, text.encode() + b"\0")
        self.write(_XML, xml)
        for feature, number in (
            (Feature.WIDTH, config.width), (Feature.WIDTH_MAX, config.width),
            (Feature.HEIGHT, config.height), (Feature.HEIGHT_MAX, config.height),
            (Feature.PIXEL_FORMAT, FORMATS[config.formats[0]]),
            # As after power-up: the image is processed, and the exposure an automatic one.
            (Feature.GAMMA, 1), (Feature.EXPOSURE_AUTO, 2),
        ):  # fmt: skip
            self.set_integer(feature, number)
        self._set_real(Feature.EXPOSURE, 100.0)
        self._set_real(Feature.RATE, 25.0)
        self.settle()


def hash_of(config: GigeConfig) -> int:
    """Return the lower half of a MAC address."""
    return int.from_bytes(bytes(int(part) for part in config.address.split(".")), "big")


def _xml(config: GigeConfig) -> str:
    """Return the GenICam description of the features."""
    F = Feature
    nodes = [
        _integer("Width", F.WIDTH, "RW", locked=True, step=8),
        _integer("Height", F.HEIGHT, "RW", locked=True, step=2),
        _integer("OffsetX", F.OFFSET_X, "RW", step=4),
        _integer("OffsetY", F.OFFSET_Y, "RW", step=2),
        _integer("WidthMax", F.WIDTH_MAX), _integer("HeightMax", F.HEIGHT_MAX),
        _integer("LineStatusAll", F.LINES), _integer("PayloadSize", F.PAYLOAD),
        _integer("TLParamsLocked", F.LOCKED, "RW"),
        _enumeration(
            "PixelFormat", F.PIXEL_FORMAT, {name: FORMATS[name] for name in config.formats}
        ),
        _enumeration("TriggerMode", F.TRIGGER_MODE, {"Off": 0, "On": 1}),
        _boolean("GammaEnable", F.GAMMA),
        _enumeration("ExposureAuto", F.EXPOSURE_AUTO, {"Off": 0, "Once": 1, "Continuous": 2}),
        _real("ExposureTime", F.EXPOSURE), _real("Gain", F.GAIN),
        _real("AcquisitionFrameRate", F.RATE), _real("ResultingFrameRate", F.RESULTING_RATE),
        _enumeration("UserSetSelector", F.USER_SET, _SETS),
        _enumeration("UserSetDefault", F.USER_SET_DEFAULT, _SETS),
        _command("UserSetSave", F.USER_SET_SAVE),
        _command("AcquisitionStart", F.START), _command("AcquisitionStop", F.STOP),
    ]  # fmt: skip
    if config.ptp:
        nodes += [
            _boolean("PtpEnable", F.PTP_ENABLE),
            _enumeration("PtpStatus", F.PTP_STATUS, _PTP_STATES, "RO"),
            _integer("PtpOffsetFromMaster", F.PTP_OFFSET),
            _integer("PtpGrandmasterClockID", F.PTP_GRANDMASTER),
            _command("PtpDataSetLatch", F.PTP_LATCH),
        ]
    names = "".join(f"<pFeature>{name}</pFeature>" for name, _ in nodes)
    return (
        '<?xml version="1.0" encoding="UTF-8"?>'
        '<RegisterDescription ModelName="GigeCamera" VendorName="OCMM" ToolTip="" '
        'StandardNameSpace="GEV" SchemaMajorVersion="1" SchemaMinorVersion="1" '
        'SchemaSubMinorVersion="0" MajorVersion="1" MinorVersion="0" SubMinorVersion="0" '
        'ProductGuid="0" VersionGuid="0" xmlns="http://www.genicam.org/GenApi/Version_1_1">'
        f'<Category Name="Root" NameSpace="Standard">{names}</Category>'
        + "".join(text for _, text in nodes)
        + '<Port Name="Device"/></RegisterDescription>'
    )


def _node(
    kind: str, name: str, address: int, access: str = "RW", before: str = "", behind: str = ""
) -> tuple[str, str]:
    """Return the name of a feature, and its node and register; ``behind`` follows its value."""
    register, ending = ("FloatReg", "") if kind == "Float" else ("IntReg", "<Sign>Signed</Sign>")
    return name, (
        f'<{kind} Name="{name}" NameSpace="Standard">{before}<pValue>{name}Reg</pValue>{behind}'
        f'</{kind}><{register} Name="{name}Reg"><Address>{address:#x}</Address><Length>8</Length>'
        f"<AccessMode>{access}</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable>"
        f"{ending}<Endianess>BigEndian</Endianess></{register}>"
    )


def _integer(
    name: str, address: int, access: str = "RO", *, locked: bool = False, step: int = 0
) -> tuple[str, str]:
    lock = "<pIsLocked>TLParamsLocked</pIsLocked>" if locked else ""
    least = f"<Min>{2 * step if locked else 0}</Min><Inc>{step}</Inc>" if step else ""
    return _node("Integer", name, address, access, lock, least)


def _boolean(name: str, address: int) -> tuple[str, str]:
    return _node("Boolean", name, address, behind="<OnValue>1</OnValue><OffValue>0</OffValue>")


def _enumeration(
    name: str, address: int, entries: dict[str, int], access: str = "RW"
) -> tuple[str, str]:
    rows = "".join(
        f'<EnumEntry Name="{entry}" NameSpace="Standard"><Value>{value}</Value></EnumEntry>'
        for entry, value in entries.items()
    )
    return _node("Enumeration", name, address, access, rows)


def _real(name: str, address: int) -> tuple[str, str]:
    return _node("Float", name, address)


def _command(name: str, address: int) -> tuple[str, str]:
    return _node("Command", name, address, behind="<CommandValue>1</CommandValue>")
