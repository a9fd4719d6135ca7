"""What masters that nobody here wrote find out about the software cameras, as JSON.

Run inside a network namespace, ``python benchmarks/second_master.py MASTER INTERFACE``, where
MASTER is ``kickcat`` (its wheel) or ``pysoem``, which is used as its own basic example does:
config_init, config_map, SAFEOP, process data in a thread, OP. None of our master is in it.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from datetime import timedelta

import kickcat
import msgspec
import pysoem

_CYCLES = 5
_PATIENCE_S = 60.0
_WATCHDOG_S = 6.0
"""KickCAT sets it at the cameras; it holds 6.5 s at most."""
_EXCHANGE_MS = 30
"""KickCAT waits so long for the cameras, and in every exchange for its second, absent interface.

With less, a computer that pauses breaks its reading of the memory of a camera.
"""
NOT_STARTED = "KickCAT could not start the bus"
"""Beginning of its message if it reached no query of a camera's state."""
_OUTPUT_ASSIGNMENT, _INPUT_ASSIGNMENT = 0x1C12, 0x1C13
_IDENTITY, _NAME = 0x1018, 0x1008
_OP_TRIES = 40
Read = Callable[[int, int, int], bytes]
"""Index, entry and greatest length to value."""


class Mapped(msgspec.Struct, frozen=True):
    """One mapped variable: its place in the dictionary, its bits, and its name if given."""

    index: int
    sub: int
    bits: int
    name: str = ""


class FoundCamera(msgspec.Struct, frozen=True, kw_only=True):
    """A master's findings about one camera."""

    name: str
    vendor: int
    product: int
    revision: int
    serial: int
    input_bytes: int
    output_bytes: int
    state: str
    outputs: dict[int, tuple[Mapped, ...]]
    inputs: dict[int, tuple[Mapped, ...]]


def describe(
    read: Read, entry_name: Callable[[int, int], str], sizes: tuple[int, int], state: str
) -> FoundCamera:
    """Read identity and mapping over SDO."""

    def number(index: int, sub: int) -> int:
        return int.from_bytes(read(index, sub, 4), "little")

    def mapping(assignment: int) -> dict[int, tuple[Mapped, ...]]:
        found = {}
        for position in range(1, number(assignment, 0) + 1):
            pdo = number(assignment, position)
            words = [number(pdo, sub) for sub in range(1, number(pdo, 0) + 1)]
            found[pdo] = tuple(
                Mapped(word >> 16, word >> 8 & 0xFF, word & 0xFF,
                       entry_name(word >> 16, word >> 8 & 0xFF))
                for word in words
            )  # fmt: skip
        return found

    return FoundCamera(
        name=read(_NAME, 0, 64).rstrip(b"\0").decode(),
        vendor=number(_IDENTITY, 1),
        product=number(_IDENTITY, 2),
        revision=number(_IDENTITY, 3),
        serial=number(_IDENTITY, 4),
        input_bytes=sizes[0],
        output_bytes=sizes[1],
        state=state,
        outputs=mapping(_OUTPUT_ASSIGNMENT),
        inputs=mapping(_INPUT_ASSIGNMENT),
    )


def with_kickcat(interface: str) -> list[FoundCamera]:
    """Bring the cameras to operation with KickCAT."""
    patience = timedelta(seconds=_PATIENCE_S)
    link = kickcat.create_link(interface, "")
    link.set_timeout(timedelta(milliseconds=_EXCHANGE_MS))
    bus = kickcat.Bus(link)
    try:
        bus.init(timedelta(seconds=_WATCHDOG_S))
    except RuntimeError as error:
        message = f"{NOT_STARTED}: {error}"
        raise RuntimeError(message) from error
    bus.create_mapping()
    bus.request_state(kickcat.State.SAFE_OP)
    bus.wait_for_state(kickcat.State.SAFE_OP, patience)
    for slave in bus.slaves():
        slave.set_output_bytes(bytes(slave.output_size))
    bus.process_data()
    bus.request_state(kickcat.State.OPERATIONAL)
    bus.wait_for_state(kickcat.State.OPERATIONAL, patience, bus.process_data)
    for _ in range(_CYCLES):
        bus.process_data()
        time.sleep(0.002)
    reached = [bus.get_state(slave).name for slave in bus.slaves()]
    found = []
    for slave, state in zip(bus.slaves(), reached, strict=True):

        def read(index: int, sub: int, room: int, slave: object = slave) -> bytes:
            return bytes(bus.read_sdo(slave, index, sub, kickcat.Access.PARTIAL, room, patience))

        sizes = (slave.input_size, slave.output_size)
        found.append(describe(read, lambda _index, _sub: "", sizes, state))
    return found


def with_pysoem(interface: str) -> list[FoundCamera]:
    """Bring the cameras to operation as the basic example of pysoem does."""
    master = pysoem.Master()
    master.open(interface)
    stop = threading.Event()
    try:
        if master.config_init() <= 0:
            raise RuntimeError("no camera found")
        master.config_map()
        if master.state_check(pysoem.SAFEOP_STATE, 50_000) != pysoem.SAFEOP_STATE:
            raise RuntimeError("SAFEOP was not reached")
        # In OP the outputs must not wait for so long.
        found = [_describe_slave(slave) for slave in master.slaves]

        def process_data() -> None:
            while not stop.is_set():
                master.send_processdata()
                master.receive_processdata(10_000)
                time.sleep(0.002)

        pump = threading.Thread(target=process_data)
        pump.start()
        master.state = pysoem.OP_STATE
        master.write_state()
        for _ in range(_OP_TRIES):
            master.state_check(pysoem.OP_STATE, 50_000)
            if master.state == pysoem.OP_STATE:
                break
        master.read_state()
        stop.set()
        pump.join()
        return [
            msgspec.structs.replace(
                one, state="OPERATIONAL" if slave.state == pysoem.OP_STATE else f"{slave.state:#x}"
            )
            for one, slave in zip(found, master.slaves, strict=True)
        ]
    finally:
        stop.set()
        master.state = pysoem.INIT_STATE
        master.write_state()
        master.close()


def _describe_slave(slave: pysoem.CdefSlave) -> FoundCamera:
    objects = {item.index: item for item in slave.od}

    def entry_name(index: int, sub: int) -> str:
        raw = objects[index].entries[sub].name
        return raw.decode() if isinstance(raw, bytes) else str(raw)

    sizes = (len(slave.input), len(slave.output))
    return describe(slave.sdo_read, entry_name, sizes, "")


MASTERS = {"kickcat": with_kickcat, "pysoem": with_pysoem}


if __name__ == "__main__":
    answer = MASTERS[sys.argv[1]](sys.argv[2])
    sys.stdout.write("\n" + msgspec.json.encode(answer).decode() + "\n")
