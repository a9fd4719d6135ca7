"""Cables, ring, power and clocks of the software cameras, frame by frame, without a network."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from benchmarks.camera_faults import CameraDeed, FaultCommands, FaultKind
from benchmarks.clock_pattern import ClockPattern, ClockUnit, read_clock
from ocmm_core.fieldbus.device import INPUT_START, CameraIdentity
from ocmm_core.fieldbus.wire import Command, Datagram, decode_frame, encode_frame
from ocmm_sim.bus import Chain
from ocmm_sim.slave import (
    STATION_ALIAS,
    SYSTEM_TIME,
    TIME_DIFFERENCE,
    SlaveClock,
    difference_register,
    time_difference,
)

NOW = 1_000_000_000


def make_chain(ends: int, count: int = 3) -> Chain:
    pattern = ClockPattern()
    return Chain(
        [ClockUnit(n, CameraIdentity(f"c{n}", 1001 + n, 11 + n), pattern) for n in range(count)],
        ends,
    )


def pass_through(chain: Chain, entry: int) -> tuple[list[int], int | None]:
    """Return the aliases of the cameras that process a frame, in order, and its exit."""
    asked = [Datagram(Command.APRD, -place & 0xFFFF, STATION_ALIAS, bytes(2)) for place in range(4)]
    frame = bytearray(encode_frame(1, asked))
    way = chain.ways[entry]
    assert way.segment.process(frame, NOW)
    answers = [one for one in decode_frame(bytes(frame))[1] if one.working_counter]
    return [int.from_bytes(one.data, "little") for one in answers], way.leaves


def do(chain: Chain, what: FaultKind, camera: int, value: int = 0) -> None:
    assert FaultCommands(chain).do(CameraDeed(do=what, camera=camera, value=value), NOW).error == ""


def test_a_line_turns_round_at_its_end_and_at_what_is_broken() -> None:
    chain = make_chain(1)
    assert pass_through(chain, 0) == ([11, 12, 13], 0)
    do(chain, FaultKind.BREAK, 1, 1)
    assert pass_through(chain, 0) == ([11, 12], 0)
    do(chain, FaultKind.BREAK, 1, 0)
    do(chain, FaultKind.POWER_OFF, 1)
    assert pass_through(chain, 0) == ([11], 0)
    do(chain, FaultKind.POWER_ON, 1)
    do(chain, FaultKind.MUTE, 0, 1)
    assert pass_through(chain, 0) == ([12, 13], 0)
    do(chain, FaultKind.POWER_OFF, 0)
    assert pass_through(chain, 0) == ([], None)


def test_cameras_are_unplugged_exchanged_and_come_back_restarted() -> None:
    chain = make_chain(1)
    do(chain, FaultKind.UNPLUG, 1)
    assert pass_through(chain, 0)[0] == [11, 13]
    do(chain, FaultKind.PLUG, 1)
    do(chain, FaultKind.SWAP, 0, 2)
    assert pass_through(chain, 0)[0] == [13, 12, 11]
    do(chain, FaultKind.ALIAS, 2, 99)
    assert pass_through(chain, 0)[0] == [99, 12, 11]
    assert [unit.boots for unit in chain.units] == [2, 2, 3]


@pytest.mark.parametrize(
    ("broken", "from_first", "from_second"),
    [
        (None, ([11, 12, 13], 1), ([], 0)),
        (0, ([11], 0), ([12, 13], 1)),
        (1, ([11, 12], 0), ([13], 1)),
        (2, ([11, 12, 13], 0), ([], None)),
    ],
)
def test_a_ring_with_one_break_still_reaches_every_camera(
    broken: int | None,
    from_first: tuple[list[int], int | None],
    from_second: tuple[list[int], int | None],
) -> None:
    chain = make_chain(2)
    if broken is not None:
        do(chain, FaultKind.BREAK, broken, 1)
    assert pass_through(chain, 0) == from_first
    assert pass_through(chain, 1) == from_second


def test_a_ring_with_a_camera_off_reaches_the_others_from_both_ends() -> None:
    chain = make_chain(2)
    do(chain, FaultKind.POWER_OFF, 1)
    assert pass_through(chain, 0) == ([11], 0)
    assert pass_through(chain, 1) == ([13], 1)


def test_a_clock_follows_the_reference_and_tells_how_far_it_is_off() -> None:
    chain = make_chain(1, 2)
    slaves = [unit.camera.esc for unit in chain.units]
    slaves[1].clock.set_rate(200_000, NOW)
    # Both show the same now, as after the delays were measured.
    offset = 7_000_000_000
    slaves[0].write(0x0920, struct.pack("<q", offset))
    differences = []
    for cycle in range(200):
        if cycle == 150:
            slaves[1].clock.jump(-3_000_000)
        frame = bytearray(encode_frame(1, [Datagram(Command.ARMW, 0, SYSTEM_TIME, bytes(8))]))
        chain.ways[0].segment.process(frame, NOW + cycle * 1_000_000)
        register = int.from_bytes(slaves[1].read(TIME_DIFFERENCE, 4) or b"", "little")
        amount = register & 0x7FFFFFFF
        differences.append(-amount if register >> 31 else amount)
    # 200 ppm are 200 ns a cycle; the control loop leaves at most that of one cycle.
    assert np.max(np.abs(differences[2:150])) == pytest.approx(200, abs=10)
    assert differences[150] == pytest.approx(-3_000_000, abs=1000)
    # At a thousandth of the time it needs three seconds.
    assert differences[199] < -2_900_000


def test_time_differences_survive_the_turn_of_32_bits_and_have_a_sign() -> None:
    assert time_difference(5, (2**32 - 5).to_bytes(4, "little")) == 10
    assert time_difference(2**40 - 5, (5).to_bytes(8, "little")) == -10
    assert difference_register(-10) == 1 << 31 | 10
    clock = SlaveClock(100)
    clock.jump(7)
    assert clock.local_ns(NOW) == NOW + 107


def test_clock_pattern_tells_exposure_camera_and_boot() -> None:
    chain = make_chain(1, 2)
    do(chain, FaultKind.RESTART, 1)
    unit = chain.units[1]
    unit.camera.esc.now_ns = NOW
    start = unit.camera.esc.system_time_ns + 5_000_000
    unit.camera.buffer.start(start, 125_000)
    pattern = ClockPattern()
    pattern.watch(1, unit.camera.esc, unit.camera.buffer, unit.boots)
    valid, _flags, uv = pattern.camera_frames(1, 80, 4)
    seen = read_clock(valid, uv)
    assert seen.intact.all()
    assert set(seen.camera) == {1}
    assert set(seen.boots) == {2}
    assert list(seen.bus_us) == [(start + k * 125_000) // 1000 for k in range(80, 84)]
    assert list(seen.host_us) == [(NOW + 5_000_000 + k * 125_000) // 1000 for k in range(80, 84)]
    uv[2, 1, 0] += 1.0
    assert list(read_clock(valid, uv).intact) == [True, True, False, True]


def test_spoiled_inputs_differ_in_one_bit_each_time() -> None:
    chain = make_chain(1, 1)
    do(chain, FaultKind.CORRUPT, 0, 1)
    memory = chain.units[0].camera.esc.memory
    spoil = chain.units[0].camera.esc.spoil
    assert spoil is not None
    before = bytes(memory)
    spoil(memory)
    changed = [at for at in range(len(before)) if before[at] != memory[at]]
    assert len(changed) == 1
    assert INPUT_START <= changed[0] < INPUT_START + 200
    assert (before[changed[0]] ^ memory[changed[0]]).bit_count() == 1
