"""Does a camera map its process data as the device model says? Compared value by value."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import (
    INPUT_DTYPE,
    NEWEST_LAYOUT,
    OUTPUT_DTYPE,
    OUTPUT_PDO,
    SM_ASSIGNMENT,
    SM_INPUTS,
    SM_OUTPUTS,
    InputLayout,
)

IO_MAP_BYTES = 4096
"""What pysoem can map; it writes over its own memory beyond that."""

_REMEDY = "Install the camera firmware that matches this program, or update this program."


def check_room(n_cameras: int) -> None:
    """Raise BusError where the process data of so many cameras cannot be mapped."""
    size = INPUT_DTYPE.itemsize + OUTPUT_DTYPE.itemsize
    if n_cameras * size > IO_MAP_BYTES:
        raise BusError(
            "bus.too_many",
            f"There are {n_cameras} cameras on the bus; their process data of {size} bytes each "
            f"do not fit into the {IO_MAP_BYTES} bytes of one bus.",
            f"Connect at most {IO_MAP_BYTES // size} cameras to the bus.",
        )


def check_mapping(
    name: str, read: Callable[[int, int], bytes], layout: InputLayout = NEWEST_LAYOUT
) -> Iterator[None]:
    """Compare what a camera maps with the device model, value by value.

    Yields after each of them, so that the caller can do something else in between.

    Parameters
    ----------
    name
        Of the camera, for messages.
    read
        Returns a value of the camera's object dictionary, by index and entry.
    layout
        That the camera's revision has.

    Raises
    ------
    BusError
        Something is mapped otherwise; the first difference is named.
    """
    for index, sub, form, expected in _expected(layout):
        found = read(index, sub)
        if found != struct.pack(form, expected):
            raise BusError(
                "bus.mapping",
                f"Camera '{name}' maps process data unknown to this program: object "
                f"{index:#06x}:{sub:02x} is 0x{found[::-1].hex()}, but should be "
                f"0x{struct.pack(form, expected)[::-1].hex()}.",
                _REMEDY,
            )
        yield


def _expected(layout: InputLayout) -> Iterator[tuple[int, int, str, int]]:
    """Yield index, entry, format and value of every object that describes the mapping."""
    for sync_manager, pdos in ((SM_OUTPUTS, (OUTPUT_PDO,)), (SM_INPUTS, layout.input_pdos)):
        assignment = SM_ASSIGNMENT + sync_manager
        yield assignment, 0, "<B", len(pdos)
        for position, pdo in enumerate(pdos, start=1):
            yield assignment, position, "<H", pdo.index
    for pdo in (OUTPUT_PDO, *layout.input_pdos):
        yield pdo.index, 0, "<B", len(pdo.entries)
        for sub, entry in enumerate(pdo.entries, start=1):
            yield pdo.index, sub, "<I", entry.mapping
