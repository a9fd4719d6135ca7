"""Camera objects requested by one process and answered by another, over real pipes.

The other process runs the port of the bus process, with a dictionary in place of a bus.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator

import pytest

from ocmm_core.acquisition.bus_process import ChildProcess, RemoteObjects
from ocmm_core.acquisition.frames import FrameRing
from ocmm_core.errors import BusError, InputError, OcmmError
from ocmm_core.fieldbus.objects import MAX_VALUE_BYTES
from tests.host import HANG_S

OWNER = """
import sys, threading, time
from ocmm_core.acquisition.bus_process._commands import CommandPort, read_first_line
from ocmm_core.fieldbus.objects._requests import EepromRequest, ObjectReply

ended = threading.Event()
assert read_first_line(0) == b"configuration\\n"
port = CommandPort.from_standard_streams(ended.set)
sys.stdout.write("note of a library\\n")
sys.stdout.flush()
values = {}
cancelled = 0
while not ended.is_set():
    request = port.next_request()
    if request is None:
        time.sleep(0.001)
        continue
    number = request.number
    if isinstance(request, EepromRequest):
        port.reply(ObjectReply(number, finished=True, value=bytes(2 * request.words)))
    elif request.sub == 255:
        sys.exit(3)
    elif request.sub == 254:
        for step in range(1, 1000):
            if port.is_cancelled(number):
                cancelled += 1
                break
            port.reply(ObjectReply(number, 10 * step, 10000))
            time.sleep(0.002)
    elif request.sub == 253:
        port.reply(ObjectReply(number, finished=True, value=bytes([cancelled])))
    elif request.sub == 252:
        pass
    elif request.value is not None:
        values[request.camera, request.index, request.sub] = request.value
        port.reply(ObjectReply(number, finished=True))
    else:
        value = values.get((request.camera, request.index, request.sub))
        if value is None:
            port.reply(ObjectReply(number, 0, 0, True, b"", "bus.refused", "No.", "Do."))
        else:
            port.reply(ObjectReply(number, finished=True, value=value))
port.close()
"""


@pytest.fixture
def process() -> Iterator[ChildProcess]:
    ring = FrameRing.create(1)
    child = ChildProcess([sys.executable, "-c", OWNER], b"configuration\n", ring)
    child.start()
    yield child
    child.close_input()
    assert child.join(HANG_S)
    ring.close()


def test_what_is_written_is_read_again(process: ChildProcess) -> None:
    camera = RemoteObjects(process, "left")
    for size in (0, 1, 4, 70_000, MAX_VALUE_BYTES):
        value = bytes(k % 251 for k in range(size))
        camera.write(0x8010, 0, value)
        assert camera.read(0x8010, 0) == value
    assert camera.eeprom(0, 16) == bytes(32)
    assert process.objects.garbled == 1


def test_a_refusal_names_the_camera(process: ChildProcess) -> None:
    with pytest.raises(BusError, match=r"Camera 'left': No\. Do\.") as caught:
        RemoteObjects(process, "left").read(1, 0)
    assert caught.value.code == "bus.refused"


def test_what_cannot_be_sent_is_refused_here(process: ChildProcess) -> None:
    camera = RemoteObjects(process, "left")
    with pytest.raises(InputError, match="too long"):
        camera.write(1, 0, bytes(MAX_VALUE_BYTES + 1))
    with pytest.raises(InputError, match="no 2 words at 2047"):
        camera.eeprom(2047, 2)


def test_several_threads_get_their_own_answers(process: ChildProcess) -> None:
    wrong: list[str] = []

    def work(name: str) -> None:
        camera = RemoteObjects(process, name)
        for turn in range(50):
            value = f"{name} {turn}".encode() * 50
            camera.write(0x8000, 1, value)
            if camera.read(0x8000, 1) != value:
                wrong.append(f"{name} {turn}")

    threads = [threading.Thread(target=work, args=(f"camera {k}",)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(HANG_S)
    assert not any(thread.is_alive() for thread in threads)
    assert wrong == []


def test_who_gives_up_ends_the_transfer_in_the_other_process(process: ChildProcess) -> None:
    camera = RemoteObjects(process, "left")
    seen: list[tuple[int, int]] = []

    def progress(done: int, total: int) -> None:
        seen.append((done, total))
        if done >= 50:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        camera.read(1, 254, progress=progress)
    assert seen == [(done, 10000) for done in (10, 20, 30, 40, 50)]
    assert camera.read(1, 253) == b"\x01"


def test_a_silent_process_is_told_after_the_time_that_was_given(process: ChildProcess) -> None:
    camera = RemoteObjects(process, "left", timeout_s=0.2)
    RemoteObjects(process, "left").eeprom(0, 1)
    with pytest.raises(BusError, match=r"has not answered a request for 0\.2 s") as caught:
        camera.read(1, 252)
    assert caught.value.code == "bus.object_timeout"


def test_who_waits_when_the_process_ends_is_told(process: ChildProcess) -> None:
    told: list[OcmmError] = []
    waiting = threading.Event()

    def wait() -> None:
        waiting.set()
        try:
            RemoteObjects(process, "left").read(1, 252)
        except OcmmError as error:
            told.append(error)

    thread = threading.Thread(target=wait)
    thread.start()
    waiting.wait(HANG_S)
    time.sleep(0.05)
    with pytest.raises(BusError, match="has ended"):
        RemoteObjects(process, "right").read(1, 255)
    thread.join(HANG_S)
    assert [error.code for error in told] == ["bus.process"]
    with pytest.raises(BusError, match="has ended"):
        RemoteObjects(process, "right").read(1, 0)


def test_a_process_that_was_not_started_has_no_objects() -> None:
    ring = FrameRing.create(1)
    child = ChildProcess([sys.executable, "-c", "pass"], b"", ring)
    with pytest.raises(BusError, match="is not started"):
        RemoteObjects(child, "left").read(1, 0)
    ring.close()
