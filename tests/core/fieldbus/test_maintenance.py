"""Alias and firmware of a camera over an idle wire, on real slave controllers without a network."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from ocmm_core.errors import BusError, InputError
from ocmm_core.fieldbus.device import (
    MAILBOX_BYTES,
    MAILBOX_OUT_START,
    PRODUCT_CODE,
    REVISION,
    CameraIdentity,
    Firmware,
)
from ocmm_core.fieldbus.objects import _maintenance, find_camera, update_firmware, write_alias
from ocmm_core.fieldbus.wire import Command, Datagram, decode_frame, encode_frame, scan_devices
from ocmm_sim.bus import Chain, Unit
from ocmm_sim.firmware import maker_key
from ocmm_sim.slave import INIT, TestPattern

IDENTITIES = (CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2))


class Idle:
    """A wire with two cameras and no master."""

    def __init__(self) -> None:
        self.units = [Unit(n, identity, TestPattern()) for n, identity in enumerate(IDENTITIES)]
        self.chain = Chain(self.units)
        self.now_ns = 10**12
        self.left = -1

    def exchange(self, datagram: Datagram) -> Datagram:
        if self.left == 0:
            raise BusError("bus.silent", "The cable was pulled.", "Plug it in.")
        self.left -= 1
        self.now_ns += 50_000
        frame = bytearray(encode_frame(1, [datagram]))
        assert self.chain.ways[0].segment.process(frame, self.now_ns)
        return decode_frame(bytes(frame))[1][0]

    def power_cycle(self, place: int) -> None:
        self.units[place].switch_on(0)
        self.chain.lay()

    def version(self, place: int) -> str:
        return self.units[place].camera.coe.value(0x100A, 0).decode()


def firmware(version: str, size: int = 2000, revision: int = REVISION) -> bytes:
    content = np.random.default_rng(size).bytes(size)
    return Firmware(version, PRODUCT_CODE, (revision, revision), content).signed(maker_key())


def test_an_alias_is_in_force_after_power_on() -> None:
    wire = Idle()
    assert write_alias(wire.exchange, 1002, 77) == 2
    assert [each.device.alias for each in scan_devices(wire.exchange)] == [1, 77]
    esc = wire.units[1].camera.esc
    # The controller loads it when it is switched on.
    assert esc.memory[0x12] == 2
    wire.power_cycle(1)
    assert wire.units[1].camera.esc.memory[0x12] == 77
    assert find_camera(wire.exchange, 1002)[1].device.alias == 77


@pytest.mark.parametrize(
    ("serial", "alias", "error", "words"),
    [
        (1002, 0, InputError, "not 1 to 65535"),
        (1002, 65536, InputError, "not 1 to 65535"),
        (1002, 1, BusError, "serial number 1001 has the alias 1"),
        (4711, 5, BusError, "No cameras .* 4711; found: 1001, 1002"),
    ],
)
def test_an_alias_that_cannot_be_is_refused(
    serial: int, alias: int, error: type[Exception], words: str
) -> None:
    wire = Idle()
    with pytest.raises(error, match=words):
        write_alias(wire.exchange, serial, alias)
    assert [each.device.alias for each in scan_devices(wire.exchange)] == [1, 2]


def test_firmware_is_sent_started_and_stays() -> None:
    wire = Idle()
    told: list[tuple[int, int]] = []
    found = update_firmware(wire.exchange, 1002, firmware("3.4.5"), lambda *each: told.append(each))
    assert found.version == "3.4.5"
    assert (wire.version(0), wire.version(1)) == ("3.0.0", "3.4.5")
    assert told == sorted(told)
    assert told[-1][0] == told[-1][1]
    assert wire.units[1].camera.esc.state == INIT
    for _ in range(3):
        wire.power_cycle(1)
        assert wire.version(1) == "3.4.5"


def test_firmware_of_another_device_is_refused_before_anything_is_sent() -> None:
    wire = Idle()
    with pytest.raises(InputError, match="is for product"):
        update_firmware(wire.exchange, 1002, firmware("9.0.0", revision=REVISION + 1))
    assert wire.units[1].camera.esc.state == INIT
    with pytest.raises(InputError, match="unknown kind"):
        update_firmware(wire.exchange, 1002, bytes(1000))


def test_firmware_that_its_maker_did_not_sign_is_refused_by_the_camera() -> None:
    wire = Idle()
    image = bytearray(firmware("6.6.6"))
    image[-1] ^= 1
    with pytest.raises(BusError, match="did not sign"):
        update_firmware(wire.exchange, 1002, bytes(image))
    wire.power_cycle(1)
    assert wire.version(1) == "3.0.0"


def test_mailboxes_that_come_twice_are_one(monkeypatch: pytest.MonkeyPatch) -> None:
    wire, image = Idle(), firmware("3.4.5", 3000)
    plain = wire.exchange

    def twice(datagram: Datagram) -> Datagram:
        # The first way back was lost, so that the line sends the frame again.
        if datagram.command is Command.APWR and datagram.register == MAILBOX_OUT_START:
            plain(datagram)
        return plain(datagram)

    monkeypatch.setattr(_maintenance, "_POLL_S", 0.0)
    assert update_firmware(twice, 1002, image).version == "3.4.5"
    assert wire.version(1) == "3.4.5"


def test_a_camera_that_is_busy_for_ever_or_starts_the_old_firmware_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_maintenance, "_ERASE_S", 0.05)
    monkeypatch.setattr(_maintenance, "_BUSY_S", 0.01)
    wire = Idle()
    camera = wire.units[1].camera
    busy = struct.pack("<HHBBBBI", 6, 0, 0, 0x14, 6, 0, 0)
    monkeypatch.setattr(camera, "answer", lambda _mailbox: busy)
    with pytest.raises(BusError, match="stopped answering"):
        update_firmware(wire.exchange, 1002, firmware("3.4.5"))
    assert camera.esc.state == INIT
    # It acknowledges the file, and leaves BOOT unchanged.
    wire = Idle()
    monkeypatch.setattr(wire.units[1].camera, "_start_firmware", lambda: None)
    with pytest.raises(BusError, match=r"took the firmware 3\.4\.5, but runs 3\.0\.0"):
        update_firmware(wire.exchange, 1002, firmware("3.4.5"))


def test_of_a_file_whose_last_packet_is_not_answered_nothing_is_claimed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_maintenance, "_ANSWER_S", 0.02)
    wire, image = Idle(), firmware("3.4.5", 700)
    camera = wire.units[1].camera
    before, taken = camera.answer, [0]

    def answer(mailbox: bytes) -> bytes | None:
        taken[0] += 1
        found = before(mailbox)
        return None if taken[0] == 2 + len(image) // (MAILBOX_BYTES - 12) else found

    monkeypatch.setattr(camera, "answer", answer)
    with pytest.raises(BusError, match="did not say whether it takes it") as caught:
        update_firmware(wire.exchange, 1002, image)
    assert "still runs" not in caught.value.remedy
    # It did take it.
    assert wire.version(1) == "3.4.5"


def test_an_update_that_the_cable_interrupts_leaves_a_camera_that_works() -> None:
    image = firmware("3.4.5", 1200)
    whole = Idle()
    whole.left = 10**9
    update_firmware(whole.exchange, 1002, image)
    datagrams = 10**9 - whole.left
    random = np.random.default_rng(3)
    versions = set()
    for _ in range(40):
        wire = Idle()
        wire.left = int(random.integers(1, datagrams))
        with pytest.raises(BusError, match="cable was pulled"):
            update_firmware(wire.exchange, 1002, image)
        wire.power_cycle(1)
        versions.add(wire.version(1))
        wire.left = -1
        # Whatever runs: it can be updated.
        assert update_firmware(wire.exchange, 1002, image).version == "3.4.5"
        assert wire.version(1) == "3.4.5"
    assert versions <= {"3.0.0", "3.4.5"}
