"""The configuration of the bus process: each fault is named."""

from __future__ import annotations

import msgspec
import pytest

from ocmm_core.acquisition.bus_process import BusConfig, read_config
from ocmm_core.errors import BusError, InputError
from ocmm_core.fieldbus.device import CameraIdentity, FoundDevice, assign

GOOD = BusConfig(interface="eth7", ring_path="/nowhere", cameras=(CameraIdentity("left", 1001, 1),))


def test_configuration_survives_the_pipe() -> None:
    assert read_config(GOOD.to_json()) == GOOD


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"interface": 5}, "interface"),
        ({"speed": 1}, "speed"),
        ({"cameras": []}, "'cameras'"),
        ({"cycle_period_ns": 1_100_000}, "1100000 ns"),
        ({"frame_period_ns": 10_000}, "10000 ns"),
        ({"cycle_period_ns": 2_000_000}, "2000000 ns"),
    ],
)
def test_wrong_fields_are_named(change: dict[str, object], words: str) -> None:
    fields = msgspec.json.decode(GOOD.to_json()) | change
    with pytest.raises(InputError, match=words):
        read_config(msgspec.json.encode(fields))


def test_text_that_is_no_json_is_refused() -> None:
    with pytest.raises(InputError, match="not valid"):
        read_config(b"")


def test_a_foreign_device_is_named_by_its_place() -> None:
    with pytest.raises(BusError, match=r"position 1 .*vendor 0x00000002"):
        assign([FoundDevice(2, 3, 4, None, 0)], [CameraIdentity("left", 1001, 1)])
