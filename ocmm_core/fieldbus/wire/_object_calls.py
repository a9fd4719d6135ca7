"""Objects read and written through the master library, with matched answers and a time limit.

The library accepts the next answer and compares the index, not the entry. A camera that answers
after the library gave up is one answer behind from then on: entry 10 would be accepted as entry 11
of the same object, a plausible wrong value (seen on a busy computer: a good camera was reported
with other firmware). Mailboxes keep their order. So before the first call, which may follow one
that an earlier master gave up, and after an unanswered one the camera's type, an object of another
index, is read until answered: nothing older is in transit then, and a later type answer is refused
by its index.

Calls of the library that would not end if the cable breaks have a time limit. A camera's process
data mapping is compared with the device model.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import struct
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

from ocmm_core.errors import BusError
from ocmm_core.fieldbus import device
from ocmm_core.fieldbus.described import ProcessImage

_TRIES = 2
_SETTLING_TRIES = 5


class ObjectCalls:
    """Calls of one master, and the cameras that still owe an answer.

    ``ask_type`` reads an object of the camera with an index that `call` never uses; ``failures``:
    library exceptions for a missing or mismatched answer; ``pause_s``: delay before a camera in
    arrears is queried again, for late answers, which the library discards before a query.
    """

    def __init__(
        self,
        ask_type: Callable[[int], object],
        failures: tuple[type[Exception], ...],
        pause_s: float,
    ) -> None:
        self._ask_type = ask_type
        self._failures = failures
        self._pause_s = pause_s
        self._behind: set[int] = set()
        self._met: set[int] = set()

    def call(self, position: int, name: str, index: int, action: Callable[[], bytes]) -> bytes:
        """Return the result of `action`, one transfer; retry after lost frames.

        BusError ``bus.no_answer``, or an exception of `action`, as if the camera refuses.
        """
        if position not in self._met:
            self._met.add(position)
            self._settled(position, pause=False)
        for _ in range(_TRIES):
            if position in self._behind and not self._settled(position):
                break
            try:
                return action()
            except self._failures:
                self._behind.add(position)
        raise BusError(
            "bus.no_answer",
            f"Camera {name} gives an unexpected answer (object {index:#06x}).",
            "Check its cable; power-cycle the camera.",
        )

    def _settled(self, position: int, *, pause: bool = True) -> bool:
        for number in range(_SETTLING_TRIES):
            if pause or number:
                time.sleep(self._pause_s)
            try:
                self._ask_type(position)
            except self._failures:
                continue
            self._behind.discard(position)
            return True
        return False


_FUSE_STRETCHED_S = 30.0
_FUSE_S = 0.1
_FUSE_RET_US, _FUSE_RET_RING_US = 50, 1000


class _Timeouts(Protocol):
    ret: int
    eeprom: int


@contextlib.contextmanager
def fuse(
    timeouts: _Timeouts, sockets: Sequence[socket.socket], *, stretched: bool, ring: bool
) -> Iterator[None]:
    """Limit how long pysoem waits if the cable breaks during mapping.

    It would read thousands of EEPROM words, wait 8 ms for each and hold the GIL: 84 s for this
    process (measured). After a moment a helper process makes the shared socket non-blocking; the
    rest then takes half a second.
    """
    kept = timeouts.ret, timeouts.eeprom
    fuse_s = _FUSE_S
    if stretched:
        fuse_s = _FUSE_STRETCHED_S
    else:
        # No effect with one blocking socket, but with two; the EEPROM is not needed.
        timeouts.ret = timeouts.eeprom = _FUSE_RET_RING_US if ring else _FUSE_RET_US
    helper = _fork_quietly()
    if helper == 0:
        try:
            time.sleep(fuse_s)
            set_blocking(sockets, blocking=False)
        finally:
            os._exit(0)
    try:
        yield
    finally:
        os.kill(helper, signal.SIGKILL)
        os.waitpid(helper, 0)
        set_blocking(sockets, blocking=True)
        timeouts.ret, timeouts.eeprom = kept


def set_blocking(sockets: Sequence[socket.socket], *, blocking: bool) -> None:
    """Make these open sockets blocking or not, for all processes that share them."""
    for own in sockets:
        # Only the flag of the open file, which pysoem's own descriptor shares.
        os.set_blocking(own.fileno(), blocking)


def _fork_quietly() -> int:
    """Fork; the threads warning concerns children with more than one system call."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return os.fork()


IO_MAP_BYTES = 4096
"""Limit of pysoem's mapping; it overwrites its own memory beyond that."""

_Objects = list[tuple[int, list[int]]]
_REMEDY = "Install the camera firmware that matches this program, or update this program."


def check_room(
    n_cameras: int, size: int = device.INPUT_DTYPE.itemsize + device.OUTPUT_DTYPE.itemsize
) -> None:
    """Raise BusError if `n_cameras` with `size` bytes each cannot be mapped."""
    if n_cameras * size > IO_MAP_BYTES:
        raise BusError(
            "bus.too_many",
            f"There are {n_cameras} cameras on the bus; their process data of {size} bytes each "
            f"do not fit into the {IO_MAP_BYTES} bytes of one bus.",
            f"Connect at most {IO_MAP_BYTES // size} cameras to the bus.",
        )


def check_mapping(
    name: str,
    read: Callable[[int, int], bytes],
    layout: device.InputLayout | ProcessImage = device.NEWEST_LAYOUT,
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


def _expected(layout: device.InputLayout | ProcessImage) -> Iterator[tuple[int, int, str, int]]:
    """Yield index, entry, format and value of every mapping object."""
    outputs, inputs = _objects(layout)
    for sync_manager, objects in ((device.SM_OUTPUTS, outputs), (device.SM_INPUTS, inputs)):
        assignment = device.SM_ASSIGNMENT + sync_manager
        yield assignment, 0, "<B", len(objects)
        for position, (index, _mappings) in enumerate(objects, start=1):
            yield assignment, position, "<H", index
    for index, mappings in (*outputs, *inputs):
        yield index, 0, "<B", len(mappings)
        for sub, mapping in enumerate(mappings, start=1):
            yield index, sub, "<I", mapping


def _objects(layout: device.InputLayout | ProcessImage) -> tuple[_Objects, _Objects]:
    """Return the mapping objects of outputs and inputs with their contents."""
    if isinstance(layout, ProcessImage):
        pairs = (layout.outputs, layout.inputs)
        return (
            [(index, [entry.mapping for entry in entries]) for index, entries in pairs[0]],
            [(index, [entry.mapping for entry in entries]) for index, entries in pairs[1]],
        )
    return (
        [(device.OUTPUT_PDO.index, [entry.mapping for entry in device.OUTPUT_PDO.entries])],
        [(pdo.index, [entry.mapping for entry in pdo.entries]) for pdo in layout.input_pdos],
    )
