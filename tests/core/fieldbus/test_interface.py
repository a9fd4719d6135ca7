"""Which interface may be the bus: by name and kind, before anything is sent."""

from __future__ import annotations

import pytest

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.wire._interface import check_interface


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "sixteen-letters-x"])
def test_what_is_no_name_is_refused(name: str) -> None:
    with pytest.raises(BusError) as caught:
        check_interface(name)
    assert caught.value.code == "bus.interface_name"


def test_what_is_not_there_is_named_beside_what_is() -> None:
    with pytest.raises(BusError, match=r"available: .*lo") as caught:
        check_interface("nothere0")
    assert caught.value.code == "bus.no_interface"


def test_the_loopback_is_no_bus_even_where_it_is_forced() -> None:
    with pytest.raises(BusError) as caught:
        check_interface("lo", force=True)
    # A user without rights gets these errors first.
    assert caught.value.code in ("bus.loopback", "bus.rights")
