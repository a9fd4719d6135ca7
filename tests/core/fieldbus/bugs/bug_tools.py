"""Firmware bugs, planted into the software camera.

A bug reaches into the camera's internals, which other code must not do; so a camera is `Any` here.
Each bug names the rule that must find it; the good camera breaks no rule.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ocmm_core.fieldbus.device import (
    DATA_CRC,
    DATA_CRC_AT,
    FRAME_DTYPE,
    HEADER_STRUCT,
    INPUT_DTYPE,
    INPUT_START,
    NEWEST_LAYOUT,
    Header,
)
from ocmm_sim.slave import Abort, AbortError, checksum_of_configuration

# ruff: noqa: SLF001 - see the module
Plant = Callable[[Any], object]
_FRAME = FRAME_DTYPE.itemsize
_HEAD = INPUT_START + HEADER_STRUCT.size
BUGS: list[Bug] = []


@dataclass(frozen=True, slots=True)
class Bug:
    """One bug: its nature, the rule that must find it, and its plant in a camera."""

    name: str
    rule: str
    plant: Plant


def bug(rule: str, name: str) -> Callable[[Plant], Plant]:
    def keep(plant: Plant) -> Plant:
        BUGS.append(Bug(name, rule, plant))
        return plant

    return keep


def add(rule: str, name: str, plant: Plant) -> None:
    BUGS.append(Bug(name, rule, plant))


def eeprom(at: int, content: bytes, *, seal: bool = False) -> Plant:
    def plant(camera: Any) -> None:
        camera.esc._sii[at : at + len(content)] = content
        if seal:
            camera.esc._sii[14] = checksum_of_configuration(bytes(camera.esc._sii[:14]))

    return plant


def entry(index: int, sub: int, **changes: object) -> Plant:
    def plant(camera: Any) -> None:
        objects = camera.coe._objects
        item = objects[index]
        changed = replace(item.entries[sub], **changes)
        objects[index] = replace(item, entries={**item.entries, sub: changed})
        if "value" in changes:
            camera.coe._values._values[index, sub] = changed.value

    return plant


def live(index: int, sub: int, value: Callable[[bytes], bytes]) -> Plant:
    """Let an entry that is worked out when it is read say something else."""

    def plant(camera: Any) -> None:
        before = camera.coe._values._live[index, sub]
        camera.coe._values._live[index, sub] = lambda: value(before())

    return plant


def header(change: Callable[[Header], Header]) -> Plant:
    """Change the header of every input, and let its check sum fit."""

    def plant(camera: Any) -> None:
        begin = camera._crc_begin

        def spoil(memory: bytearray) -> None:
            end = INPUT_START + INPUT_DTYPE.itemsize
            header = change(NEWEST_LAYOUT.decode(bytes(memory[INPUT_START:end])))
            memory[INPUT_START:_HEAD] = NEWEST_LAYOUT.encode(header._replace(data_crc=0))
            crc = zlib.crc32(memory[INPUT_START:end], begin)
            DATA_CRC.pack_into(memory, INPUT_START + DATA_CRC_AT, crc)

        camera.esc.spoil = spoil

    return plant


def frames(change: Callable[[bytearray], object]) -> Plant:
    """Change the frames of every input, and let its check sum fit."""

    def plant(camera: Any) -> None:
        begin = camera._crc_begin

        def spoil(memory: bytearray) -> None:
            end = INPUT_START + INPUT_DTYPE.itemsize
            frames = memory[_HEAD:end]
            change(frames)
            memory[_HEAD:end] = frames
            DATA_CRC.pack_into(memory, INPUT_START + DATA_CRC_AT, 0)
            crc = zlib.crc32(memory[INPUT_START:end], begin)
            DATA_CRC.pack_into(memory, INPUT_START + DATA_CRC_AT, crc)

        camera.esc.spoil = spoil

    return plant


def crc(work_out: Callable[[bytes, int], int]) -> Plant:
    def plant(camera: Any) -> None:
        def spoil(memory: bytearray) -> None:
            DATA_CRC.pack_into(memory, INPUT_START + DATA_CRC_AT, 0)
            content = bytes(memory[INPUT_START : INPUT_START + INPUT_DTYPE.itemsize])
            crc = work_out(content, camera._crc_begin)
            DATA_CRC.pack_into(memory, INPUT_START + DATA_CRC_AT, crc)

        camera.esc.spoil = spoil

    return plant


def refusal(change: Callable[[int, int, int], int]) -> Plant:
    """Change the controller's answer to a request, from the code, the state and the request."""

    def plant(camera: Any) -> None:
        before = camera.esc._refusal

        def refuse(current: int, request: int) -> int:
            return change(before(current, request), current, request)

        camera.esc._refusal = refuse

    return plant


def aborting(change: Callable[[Abort], Abort | None]) -> Plant:
    """Change how writing is refused; None lets it pass without doing anything."""

    def plant(camera: Any) -> None:
        values = camera.coe._values
        before = values.write

        def write(index: int, sub: int, value: bytes) -> None:
            try:
                before(index, sub, value)
            except AbortError as abort:
                other = change(abort.reason)
                if other is not None:
                    raise AbortError(other) from abort

        values.write = write

    return plant


def answers(change: Callable[[Any, bytes, bytes | None], bytes | None]) -> Plant:
    """Change the mailbox that answers a mailbox."""

    def plant(camera: Any) -> None:
        before = camera.answer
        camera.answer = lambda asked: change(camera, asked, before(asked))

    return plant


def late(seconds: float, when: Callable[[bytes], bool]) -> Plant:
    """Answer some mailboxes late, and those behind them after them: mailboxes keep their order."""

    def plant(camera: Any) -> None:
        before, poll = camera.answer, camera.esc.poll
        waiting: list[tuple[int, bytes]] = []
        late_ns = round(seconds * 1e9)

        def answer(asked: bytes) -> Any:
            found = before(asked)
            if found is not None and (waiting or when(asked)):
                due_ns = waiting[-1][0] + late_ns // 8 if waiting else camera.esc.now_ns + late_ns
                waiting.append((due_ns, found))
                return None
            return found

        def polled(now_ns: int) -> None:
            poll(now_ns)
            while waiting and waiting[0][0] <= now_ns:
                camera.esc._replies.append(waiting.pop(0)[1])
                camera.esc._load_reply()

        camera.answer, camera.esc.poll = answer, polled

    return plant


def replaced(path: str, value: object) -> Plant:
    """Replace an attribute of the camera or of a part of it."""

    def plant(camera: Any) -> None:
        *way, last = path.split(".")
        owner: object = camera
        for step in way:
            owner = getattr(owner, step)
        setattr(owner, last, value)

    return plant


def abort_code(camera: Any, wrong: Abort, told: Abort) -> None:
    before = camera.coe.answer

    def answer(mailbox: bytes) -> Any:
        found = before(mailbox)
        code = wrong.value.to_bytes(4, "little")
        if found is not None and found[8:9] == b"\x80" and found[12:16] == code:
            return found[:12] + told.value.to_bytes(4, "little")
        return found

    camera.coe.answer = answer
