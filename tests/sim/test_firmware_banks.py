"""Firmware in two banks: a loss of power at any moment leaves a camera that starts."""

from __future__ import annotations

import struct

import pytest

from benchmarks.firmware_updates import MAILBOX_BYTES, firmware, interrupted, send, server_of
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import PRODUCT_CODE
from ocmm_core.fieldbus.objects import FIRMWARE_NAME, FoeWrite
from ocmm_sim.firmware import FirmwareBanks, FoeServer


def test_new_firmware_runs_on_trial_and_stays_once_it_is_confirmed() -> None:
    banks = FirmwareBanks()
    assert banks.version == "3.0.0"
    send(server_of(banks), firmware("3.1.0"))
    # Until the next start the old one runs.
    assert banks.version == "3.0.0"
    banks.start()
    assert banks.version == "3.1.0"
    banks.confirm()
    for _ in range(3):
        banks.start()
        assert banks.version == "3.1.0"


def test_firmware_that_no_master_can_use_is_rolled_back() -> None:
    banks = FirmwareBanks()
    send(server_of(banks), firmware("6.6.6"))
    banks.start()
    assert banks.version == "6.6.6"
    # Nobody brought it to PREOP: the next start goes back, and stays there.
    for _ in range(3):
        banks.start()
        assert banks.version == "3.0.0"


@pytest.mark.parametrize("size", [1, 239, 240, 241, 480, 5000, 100_000])
def test_a_file_of_any_length_arrives_whole(size: int) -> None:
    banks = FirmwareBanks()
    send(server_of(banks), firmware("3.2.0", size))
    banks.start()
    assert banks.version == "3.2.0"


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda image: image[:-1], "cut off"),
        (lambda image: image[:200] + b"\x00" + image[201:], "checksum|sign"),
        (lambda image: image[:-1] + bytes([image[-1] ^ 1]), "did not sign"),
        (lambda _image: firmware("3.1.0", product=PRODUCT_CODE + 1), "is for product"),
        (lambda _image: b"OCFW" + bytes(500), "unknown kind"),
        (lambda image: image + bytes(2 << 20), "too large"),
    ],
)
def test_what_the_maker_did_not_sign_for_this_camera_is_refused(spoil, words: str) -> None:  # type: ignore[no-untyped-def]  # a table of functions
    banks = FirmwareBanks()
    with pytest.raises(BusError, match=words):
        send(server_of(banks), spoil(firmware("3.1.0")))
    banks.start()
    assert banks.version == "3.0.0"


def test_only_in_boot_and_only_the_firmware_is_taken() -> None:
    banks = FirmwareBanks()
    with pytest.raises(BusError, match="only in BOOT"):
        send(FoeServer(banks, MAILBOX_BYTES, lambda: False), firmware("3.1.0"))
    transfer = FoeWrite(b"passwords", b"x", MAILBOX_BYTES)
    with pytest.raises(BusError, match="no such file"):
        transfer.answer(server_of(banks).answer(transfer.request(1)[6:]))


def test_a_packet_that_comes_twice_is_taken_once_and_a_missing_one_is_refused() -> None:
    banks = FirmwareBanks()
    server = server_of(banks)
    image = firmware("3.1.0", 2000)
    transfer = FoeWrite(FIRMWARE_NAME, image, MAILBOX_BYTES)
    while not transfer.done:
        body = transfer.request(1)[6:]
        server.answer(body)
        # That answer was lost, and the packet came again.
        transfer.answer(server.answer(body))
    banks.start()
    assert banks.version == "3.1.0"
    skipping = server_of(FirmwareBanks())
    skipping.answer(struct.pack("<BBI", 2, 0, 0) + FIRMWARE_NAME)
    assert skipping.answer(struct.pack("<BBI", 3, 0, 2) + bytes(240))[6] == 5


def test_no_camera_is_dead_after_its_update_was_interrupted() -> None:
    old, new, dead = interrupted(200, 1)
    assert dead == 0
    assert old + new == 200
    # Both happen: before the record was written, and after it.
    assert min(old, new) > 10
