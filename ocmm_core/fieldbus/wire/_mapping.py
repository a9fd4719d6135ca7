"""Comparison of a camera's process data mapping with the device model."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.described import ProcessImage
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
"""Limit of pysoem's mapping; it overwrites its own memory beyond that."""

_Objects = list[tuple[int, list[int]]]
_REMEDY = "Install the camera firmware that matches this program, or update this program."


def check_room(n_cameras: int, size: int = INPUT_DTYPE.itemsize + OUTPUT_DTYPE.itemsize) -> None:
    """Raise BusError if `n_cameras` with `size` bytes each cannot be mapped."""
    if n_cameras * size > IO_MAP_BYTES:
        raise BusError(
            "bus.too_many",
            f"There are {n_cameras} cameras on the bus; their process data of {size} bytes each "
            f"do not fit into the {IO_MAP_BYTES} bytes of one bus.",
            f"Connect at most {IO_MAP_BYTES // size} cameras to the bus.",
        )


def check_mapping(
    name: str, read: Callable[[int, int], bytes], layout: InputLayout | ProcessImage = NEWEST_LAYOUT
) -> Iterator[None]:
    """Compare a camera's mapping with the device model; raise BusError if different.

    Yields after each value, so that the caller can do other work. `read` returns a value of the
    object dictionary by index and entry.
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


def _expected(layout: InputLayout | ProcessImage) -> Iterator[tuple[int, int, str, int]]:
    """Yield index, entry, format and value of every mapping object."""
    outputs, inputs = _objects(layout)
    for sync_manager, objects in ((SM_OUTPUTS, outputs), (SM_INPUTS, inputs)):
        assignment = SM_ASSIGNMENT + sync_manager
        yield assignment, 0, "<B", len(objects)
        for position, (index, _mappings) in enumerate(objects, start=1):
            yield assignment, position, "<H", index
    for index, mappings in (*outputs, *inputs):
        yield index, 0, "<B", len(mappings)
        for sub, mapping in enumerate(mappings, start=1):
            yield index, sub, "<I", mapping


def _objects(layout: InputLayout | ProcessImage) -> tuple[_Objects, _Objects]:
    """Return the mapping objects of outputs and inputs with their contents."""
    if isinstance(layout, ProcessImage):
        pairs = (layout.outputs, layout.inputs)
        return (
            [(index, [entry.mapping for entry in entries]) for index, entries in pairs[0]],
            [(index, [entry.mapping for entry in entries]) for index, entries in pairs[1]],
        )
    return (
        [(OUTPUT_PDO.index, [entry.mapping for entry in OUTPUT_PDO.entries])],
        [(pdo.index, [entry.mapping for entry in pdo.entries]) for pdo in layout.input_pdos],
    )
