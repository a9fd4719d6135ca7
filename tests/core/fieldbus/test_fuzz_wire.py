"""Data from the wire are untrusted: 100,000 corrupted messages into every decoder.

Each is accepted or refused with an `OcmmError`; no other exception may be raised, nothing may take
long (every loop is bounded by the length of its input; the test command ends a test that hangs) and
no decoder may keep its input.
"""

from __future__ import annotations

import resource
import struct
from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ocmm_core.camera import USUAL_SLOTS
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.cycle import CameraPast, CycleAnswer, Schedule, advance, first_frame, judge
from ocmm_core.fieldbus.cycle._watch import CameraView, StateWatch, WatchView
from ocmm_core.fieldbus.device import (
    DATA_CRC,
    DATA_CRC_AT,
    FRAME_DTYPE,
    FRAMES_PER_CYCLE,
    HEADER_STRUCT,
    INPUT_DTYPE,
    MAILBOX_BYTES,
    NEWEST_LAYOUT,
    CameraStatus,
    DiagnosisMessage,
    Header,
    Intrinsics,
    data_mark,
    decode_spots,
    encode_frames,
)
from ocmm_core.fieldbus.device._object_entries import Access, octets, variable
from ocmm_core.fieldbus.objects import MailboxAreas
from ocmm_core.fieldbus.objects._mailbox_line import MailboxLine, parse_emergency
from ocmm_core.fieldbus.objects._sdo import MAX_COUNTER, SdoRead, SdoTransfer, SdoWrite
from ocmm_core.fieldbus.wire import (
    Command,
    Datagram,
    EepromRead,
    ServiceChannel,
    decode_frame,
    decode_scan,
    encode_frame,
    frame_index,
    scan_devices,
)
from ocmm_sim.slave import (
    SII_BYTES,
    CoeServer,
    Esc,
    Segment,
    SoftwareCamera,
    TestPattern,
    sii_image,
)
from tests.core.fieldbus.fuzzing import outcomes, spoiled

FRAMES, IMAGES, ANSWERS, REQUESTS, SERVICE, SII, BLOCKS = (
    22_000, 24_000, 22_000, 12_000, 12_000, 2_000, 6_000,
)  # fmt: skip
START_NS, PERIOD_NS = 1_000_000_000, 125_000
INDEX = 0x8010


def test_there_are_100_000_messages() -> None:
    assert FRAMES + IMAGES + ANSWERS + REQUESTS + SERVICE + SII + BLOCKS == 100_000


@pytest.fixture(autouse=True)
def _bounded_memory() -> Iterator[None]:
    """Nothing that is decoded here is larger than a few kilobytes."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    yield
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 100_000, f"{grown} KiB more"


def make_frames() -> list[bytes]:
    datagrams = [
        Datagram(Command.LRW, 0, 0, bytes(870), 6),
        Datagram(Command.FPRD, 0x1001, 0x0130, bytes(6), 1),
        Datagram(Command.BRD, 0, 0, b"\x11", 2),
        Datagram(Command.FRMW, 0x1001, 0x0910, bytes(8), 2),
    ]
    return [encode_frame(7, datagrams[:1]), encode_frame(0x80, datagrams[1:]), bytes(60)]


def test_frames() -> None:
    def decode(content: bytes) -> None:
        index = frame_index(content)
        found, datagrams = decode_frame(content)
        assert found == index
        assert sum(len(datagram.data) for datagram in datagrams) < len(content)

    taken, refused = outcomes(decode, spoiled(1, FRAMES, make_frames()))
    # Changes of the payload do not make a frame unreadable.
    assert taken > FRAMES // 10
    assert refused > FRAMES // 10


SERIAL = 1001


def make_image(first: int, count: int, cycle: int) -> bytes:
    status = CameraStatus.OPERATIONAL | CameraStatus.SYNCHRONISED
    head = NEWEST_LAYOUT.encode(
        Header(first, START_NS + first * PERIOD_NS, PERIOD_NS, count, cycle, status, 5, 1)
    )
    valid, flags, uv = TestPattern().camera_frames(0, first, FRAMES_PER_CYCLE)
    content = bytearray(head + encode_frames(valid, flags, uv).tobytes())
    DATA_CRC.pack_into(content, DATA_CRC_AT, NEWEST_LAYOUT.crc(content, SERIAL))
    return bytes(content)


def test_process_images() -> None:
    """Half of them with a check sum that is right, as a camera with a fault would send them."""
    schedule = Schedule(START_NS, PERIOD_NS, 5)
    view = WatchView(0, 1, (CameraView(state=8),))
    record = CameraPast("left", 80, 9, 1, mark=NEWEST_LAYOUT.mark(SERIAL))
    clock_ns = START_NS + 90 * PERIOD_NS
    samples = [make_image(first, count, 10) for first, count in ((80, 8), (72, 12), (80, 0))]
    accepted = 0

    def decode(content: bytes) -> None:
        nonlocal accepted
        whole = content[: INPUT_DTYPE.itemsize].ljust(INPUT_DTYPE.itemsize, b"\x00")
        data_mark(content)
        for image in (whole, _signed(whole)):
            header = NEWEST_LAYOUT.decode(image)
            answer = CycleAnswer(True, 3, 3, clock_ns, True, view, (image,), (header,))
            frames = np.frombuffer(image, FRAME_DTYPE, FRAMES_PER_CYCLE, HEADER_STRUCT.size)
            spots = decode_spots(frames)
            assert spots.shape == (FRAMES_PER_CYCLE, USUAL_SLOTS, 2)
            if judge(answer, [record], schedule) is not None:
                continue
            accepted += 1
            # Accepted data fit the schedule and the earlier state.
            assert header.frames_valid <= FRAMES_PER_CYCLE
            assert header.period_ns == PERIOD_NS
            after = advance(record, header, first_frame(header, schedule))
            assert after.next_frame <= record.next_frame + 20
            used = frames[: header.frames_valid]
            assert np.all(np.isfinite(spots[: len(used)][_seen(used)]))

    taken, refused = outcomes(decode, spoiled(2, IMAGES // 2, samples))
    assert (taken, refused) == (IMAGES // 2, 0)
    assert accepted > 100


def _signed(image: bytes) -> bytes:
    content = bytearray(image)
    DATA_CRC.pack_into(content, DATA_CRC_AT, NEWEST_LAYOUT.crc(content, SERIAL))
    return bytes(content)


def _seen(
    frames: np.ndarray[tuple[int], np.dtype[np.void]],
) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    seen: np.ndarray[tuple[int, int], np.dtype[np.bool_]] = (
        frames["valid"][:, None] >> np.arange(USUAL_SLOTS, dtype=np.uint16)
    ) & 1 == 1
    return seen


def coe(service: int, body: bytes) -> bytes:
    content = struct.pack("<H", service << 12) + body
    return struct.pack("<HHBB", len(content), 0, 0, 0x13) + content


def make_answers() -> list[bytes]:
    address = struct.pack("<HB", INDEX, 0)
    return [
        coe(3, b"\x43" + address + b"\x01\x02\x03\x04"),
        coe(3, b"\x41" + address + struct.pack("<I", 700) + bytes(240)),
        coe(3, b"\x00" + bytes(247)),
        coe(3, b"\x11" + bytes(247)),
        coe(3, b"\x01" + bytes(213)),
        coe(3, b"\x60" + address + bytes(4)),
        coe(3, b"\x20" + bytes(7)),
        coe(3, b"\x30" + bytes(7)),
        coe(2, b"\x80" + address + struct.pack("<I", 0x06020000)),
        coe(1, struct.pack("<HB5s", 0x4210, 9, bytes(5))),
        struct.pack("<HHBBHH", 4, 0, 0, 0x10, 1, 2),
    ]


def test_answers_to_transfers() -> None:
    """Every second answer of a server is spoiled, or another one comes in its place."""
    entry = octets("Value", 700, access=Access.WRITE, live=False, value=bytes(700))
    server = CoeServer({INDEX: variable(entry)}, MAILBOX_BYTES, {})
    makers: list[Callable[[], SdoTransfer]] = [
        lambda: SdoRead(INDEX, 0, 4096, mailbox_bytes=MAILBOX_BYTES),
        lambda: SdoWrite(INDEX, 0, bytes(700), mailbox_bytes=MAILBOX_BYTES),
        lambda: SdoWrite(INDEX, 0, bytes(4), mailbox_bytes=MAILBOX_BYTES),
    ]
    samples = make_answers()
    ended: Counter[str] = Counter()
    count = 0
    while count < 2 * ANSWERS:
        transfer = makers[count % len(makers)]()
        # 700 bytes are four mailboxes.
        for _ in range(5):
            good = server.answer(transfer.request(1))
            assert good is not None
            content = good
            if count % 2:
                content = next(spoiled(count, 1, [good, *samples]))
            count += 1
            parse_emergency(content)
            try:
                transfer.answer(content)
            except BusError as error:
                ended[error.code] += 1
                break
            done, total = transfer.progress
            assert 0 <= done <= total <= 4096
            assert len(transfer.result) <= total
            if transfer.done:
                ended["done"] += 1
                break
        else:
            raise AssertionError("the transfer does not end")
    assert min(ended["done"], ended["bus.mailbox"], ended["bus.refused"]) > ANSWERS // 100


def make_requests() -> list[bytes]:
    made = []
    for index, sub in ((0x1018, 4), (0x1008, 0), (0x8000, 1), (0x8010, 1), (0x10F3, 2)):
        made.append(SdoRead(index, sub, 4096, mailbox_bytes=MAILBOX_BYTES).request(1))
        for size in (1, 4, 300):
            write = SdoWrite(index, sub, bytes(size), mailbox_bytes=MAILBOX_BYTES)
            made.append(write.request(1))
    made += [coe(2, b"\x60" + bytes(7)), coe(2, b"\x00" + bytes(100)), coe(2, b"\x11" + bytes(7))]
    made += [coe(8, struct.pack("<BBHH", kind, 0, 0, 0x1018)) for kind in (1, 3, 5)]
    return made


def test_requests_to_the_software_camera() -> None:
    """The camera is not to be ended by a master either: an answer, an error reply or nothing."""
    camera = SoftwareCamera(0, 1001, 1, TestPattern())

    def decode(content: bytes) -> None:
        answer = camera.answer(content[:MAILBOX_BYTES])
        assert answer is None or 6 < len(answer) <= MAILBOX_BYTES

    taken, refused = outcomes(decode, spoiled(4, REQUESTS, make_requests()))
    assert (taken, refused) == (REQUESTS, 0)
    # It still works.
    read = SdoRead(0x1018, 4, 4, mailbox_bytes=MAILBOX_BYTES)
    answer = camera.answer(read.request(1))
    assert answer is not None
    read.answer(answer)
    assert read.result == struct.pack("<I", 1001)


def test_answers_in_the_service_channel() -> None:
    """States, mailboxes and EEPROM words of a camera whose answers are spoiled on the way."""
    channel = ServiceChannel()
    delivered: list[bytes] = []
    watch = StateWatch([0x1001])
    areas = MailboxAreas(0x1000, MAILBOX_BYTES, 0x1100, MAILBOX_BYTES, repeat=False)
    line = MailboxLine(0x1001, areas, delivered.append)
    camera = SoftwareCamera(0, 1001, 1, TestPattern())
    segment = Segment([camera.esc])
    read = SdoRead(0x1008, 0, 4096, mailbox_bytes=MAILBOX_BYTES)
    words = EepromRead(0x1001, 0, 2000)
    _give_address(segment)

    def jobs() -> Iterator[object]:
        yield from watch.jobs()
        yield from line.jobs()
        yield from words.jobs()

    spoil = spoiled(5, SERVICE, make_frames())
    for number in range(SERVICE // 2):
        if number % 20 == 0:
            line.send(read.request(number // 20 % MAX_COUNTER + 1))
        if words.error is not None or words.done:
            words = EepromRead(0x1001, 0, 2000)
        sent = channel.compose(jobs())  # type: ignore[arg-type]  # jobs of three kinds of owners
        assert sent is not None
        frame = bytearray(sent)
        segment.process(frame, 1_000_000 * number)
        # A foreign frame, then the corrupted answer: each is accepted or left out.
        channel.receive(next(spoil))
        channel.receive(next(spoiled(number, 1, [bytes(frame)])))
        delivered.clear()
    assert channel.stray > SERVICE // 4
    assert channel.answered > 100


def _give_address(segment: Segment) -> None:
    frame = bytearray(
        encode_frame(1, [Datagram(Command.APWR, 0, 0x0010, struct.pack("<H", 0x1001))])
    )
    segment.process(frame, 0)


def test_eeprom_images() -> None:
    """A device whose EEPROM holds anything is listed or named as unreadable."""

    def decode(content: bytes) -> None:
        segment = Segment([Esc(content.ljust(SII_BYTES, b"\xff")[:SII_BYTES], 0, camera)])
        devices = scan_devices(lambda datagram: _through(segment, datagram))
        assert len(devices) == 1

    camera = SoftwareCamera(0, 1001, 1, TestPattern())
    taken, refused = outcomes(decode, spoiled(6, SII, [sii_image(1001, 1)]))
    assert taken > SII // 2
    assert taken + refused == SII


def _through(segment: Segment, datagram: Datagram) -> Datagram:
    frame = bytearray(encode_frame(1, [datagram]))
    segment.process(frame, 0)
    return decode_frame(bytes(frame))[1][0]


@pytest.mark.parametrize(
    ("decode", "sample"),
    [
        (
            Intrinsics.decode,
            Intrinsics(
                1001, 0, 512, 512, 0.012, 8.0, 1.0, 256.0, 256.0, 0.0, 0.0, 0.0, 0.0
            ).encode(),
        ),
        (DiagnosisMessage.decode, DiagnosisMessage(0x4210, 1, 9, bytes(5)).encode()),
        (
            decode_scan,
            b'[{"device":{"vendor":1,"product":2,"revision":3,"serial":4,"alias":5},"state":"OP"}]',
        ),
    ],
)
def test_blocks(decode: Callable[[bytes], object], sample: bytes) -> None:
    decode(sample)
    _taken, refused = outcomes(decode, spoiled(7, BLOCKS // 3, [sample]))
    assert refused > BLOCKS // 6


@given(
    st.lists(
        st.builds(
            Datagram,
            st.sampled_from(Command),
            st.integers(0, 0xFFFF),
            st.integers(0, 0xFFFF),
            st.binary(max_size=200),
            st.integers(0, 0xFFFF),
        ),
        min_size=1,
        max_size=6,
    ),
    st.integers(0, 255),
)
@settings(max_examples=200, derandomize=True, deadline=None)
def test_every_frame_is_read_as_it_was_made(datagrams: list[Datagram], index: int) -> None:
    plain = [datagram._replace(command=int(datagram.command)) for datagram in datagrams]
    assert decode_frame(encode_frame(index, plain)) == (index, tuple(plain))


@given(st.binary(min_size=1, max_size=3000), st.integers(16, 1024))
@settings(max_examples=200, derandomize=True, deadline=None)
def test_every_value_survives_its_transfer_in_as_few_mailboxes_as_it_needs(
    value: bytes, mailbox_bytes: int
) -> None:
    write = SdoWrite(INDEX, 0, value, mailbox_bytes=mailbox_bytes)
    received = bytearray()
    limit = len(value) // (mailbox_bytes - 9) + 2
    for turn in range(limit):
        body = write.request(1)[8:]
        if turn == 0:
            first = body[4 : 4 + len(value)] if body[0] & 2 else body[8:][: len(value)]
            received += first
            write.answer(coe(3, struct.pack("<BHBI", 0x60, INDEX, 0, 0)))
        else:
            received += body[1:][: len(value) - len(received)]
            write.answer(coe(3, bytes([0x20 | (turn + 1) % 2 << 4]) + bytes(7)))
        if write.done:
            break
    assert write.done
    assert bytes(received) == value
