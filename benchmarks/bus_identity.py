"""Inputs of cameras that are swapped, copied, old or damaged: how many the judge of a cycle passes.

``python -m benchmarks.bus_identity [--n CYCLES] [--seed S]``; each kind gets its share. Every input
is one that a camera of the rig did send, whole and with the right check sum; what is wrong is its
place or its time. Flipped bits are the exception. Exit code 1 where one passes.
"""

from __future__ import annotations

import argparse
import struct
import sys
from collections import Counter
from dataclasses import dataclass

import numpy as np

from ocmm_core.fieldbus.cycle import CameraPast, CameraView, CycleAnswer, Schedule, WatchView, judge
from ocmm_core.fieldbus.device import (
    COUNTER_MODULUS,
    DATA_CRC_AT,
    NEWEST_LAYOUT,
    CameraStatus,
    Header,
    encode_frames,
)
from ocmm_sim.slave import TestPattern

KINDS = ("swapped", "copied", "old", "all old", "flipped")
_SERIALS = (1001, 1002)
_START_NS, _PERIOD_NS, _FRAMES, _CYCLE_NS = 10**12, 125_000, 8, 1_000_000
_LONGEST = 65_535
_SCHEDULE = Schedule(_START_NS, _PERIOD_NS, 0xBEEF)
_STATUS = CameraStatus.OPERATIONAL | CameraStatus.SYNCHRONISED
_VIEW = WatchView(0, 2, (CameraView(answers=1, state=8),) * 2)


@dataclass(frozen=True, slots=True)
class Found:
    """The numbers of tried cycles of each kind, and of passed ones."""

    tried: Counter[str]
    passed: Counter[str]


class Cameras:
    """What two cameras send in each cycle."""

    def __init__(self) -> None:
        self._frames = []
        for camera in range(len(_SERIALS)):
            valid, flags, uv = TestPattern().camera_frames(camera, 0, 12)
            self._frames.append(encode_frames(valid, flags, uv).tobytes())

    def sends(self, camera: int, cycle: int) -> bytes:
        """Return the input of a camera, 844 bytes."""
        first = _FRAMES * cycle
        header = Header(
            first % COUNTER_MODULUS, _START_NS + first * _PERIOD_NS, _PERIOD_NS, _FRAMES,
            cycle % NEWEST_LAYOUT.cycle_counters, _STATUS, _SCHEDULE.config_crc, 1,
        )  # fmt: skip
        content = bytearray(NEWEST_LAYOUT.encode(header) + self._frames[camera])
        crc = NEWEST_LAYOUT.crc(content, _SERIALS[camera])
        struct.pack_into("<I", content, DATA_CRC_AT, crc)
        return bytes(content)


def try_cycles(count: int, seed: int) -> Found:
    """Return the outcome of the given number of wrong cycles.

    Raises
    ------
    AssertionError
        A correct cycle was refused: then the others prove nothing.
    """
    rng = np.random.default_rng(seed)
    cameras = Cameras()
    found = Found(Counter(), Counter())
    for number in range(count):
        kind = KINDS[number % len(KINDS)]
        cycle = int(rng.integers(_LONGEST + 1, 1 << 24))
        right = [cameras.sends(camera, cycle) for camera in (0, 1)]
        if number % 1000 < len(KINDS):
            assert _passes(right, cycle), "a good cycle was refused"
        found.tried[kind] += 1
        found.passed[kind] += _passes(_spoiled(kind, right, cameras, cycle, rng), cycle)
    return found


def _spoiled(
    kind: str, right: list[bytes], cameras: Cameras, cycle: int, rng: np.random.Generator
) -> list[bytes]:
    camera = int(rng.integers(2))
    if kind == "swapped":
        return right[::-1]
    if kind == "copied":
        return [right[camera]] * 2
    if kind == "flipped":
        content = bytearray(right[camera])
        for bit in rng.choice(8 * len(content), int(rng.integers(1, 4)), replace=False):
            content[bit // 8] ^= 1 << bit % 8
        return [bytes(content) if place == camera else right[place] for place in (0, 1)]
    before = cycle - int(rng.integers(1, _LONGEST + 1))
    return [
        cameras.sends(place, before) if kind == "all old" or place == camera else right[place]
        for place in (0, 1)
    ]


def _passes(inputs: list[bytes], cycle: int) -> bool:
    records = [
        CameraPast(
            name, _FRAMES * cycle, (cycle - 1) % NEWEST_LAYOUT.cycle_counters, 1,
            mark=NEWEST_LAYOUT.mark(serial),
        )
        for name, serial in zip(("left", "right"), _SERIALS, strict=True)
    ]  # fmt: skip
    answer = CycleAnswer(
        whole=True, working_counter=6, expected_working_counter=6,
        clock_ns=_START_NS + (cycle + 1) * _CYCLE_NS, clock_plausible=True, view=_VIEW,
        inputs=tuple(inputs), headers=tuple(map(NEWEST_LAYOUT.decode, inputs)),
    )  # fmt: skip
    return judge(answer, records, _SCHEDULE) is None


def main() -> int:
    """Print the table; return 1 if a wrong cycle passed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=20261125)
    options = parser.parse_args()
    found = try_cycles(options.n, options.seed)
    sys.stdout.write(f"{'kind':10} {'cycles':>9} {'GOOD':>6}\n")
    for kind in KINDS:
        sys.stdout.write(f"{kind:10} {found.tried[kind]:9} {found.passed[kind]:6}\n")
    return 1 if any(found.passed.values()) else 0


if __name__ == "__main__":
    raise SystemExit(main())
