"""Scenarios of the wire tests inside a private network namespace; run as a program, not collected.

``python wire_scenarios.py NAME`` makes a virtual cable, starts software cameras in a separate
process, plays one scenario and prints its result as JSON.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter, deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.camera_faults import FaultKind, remap
from benchmarks.fault_rig import FaultRig
from benchmarks.faulty_cameras import FaultyWire
from ocmm_core.acquisition.bus_process import (
    BUS_PRIORITY,
    CAMERA_PRIORITY,
    EthercatSource,
    take_priority,
)
from ocmm_core.acquisition.frames import Cycle, quantise
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.cycle import BusSettings, CameraBus
from ocmm_core.fieldbus.device import NEWEST_LAYOUT, SM_ASSIGNMENT, SM_INPUTS, CameraIdentity
from ocmm_core.fieldbus.report import decode_report
from ocmm_core.fieldbus.wire import Master, check_interface, make_link
from ocmm_sim.bus import Chain, Unit
from ocmm_sim.slave import INIT, PREOP, TestPattern
from tests.core.fieldbus.bugs.bug_tools import late

LEFT, RIGHT = CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2)
HOST, FAR = "wire0", "wire1"
FRAME_NS, CYCLE_NS = 125_000, 1_000_000
_MOST_TIMES = 200
_MAILBOX_LATE_S = 0.12
"""Longer than the master waits for an answer, and shorter than it waits twice."""
_LATE_READS, _LATE_S = 100, 20.0
Cameras = list[Unit]


def cameras(*identities: CameraIdentity) -> Cameras:
    """Return software cameras that show the test pattern."""
    pattern = TestPattern()
    return [Unit(index, identity, pattern) for index, identity in enumerate(identities)]


def serve(made: Cameras, drop: float = 0.0) -> int:
    """Let cameras answer in a forked process; SIGUSR1 freezes the last, SIGUSR2 resets it."""
    parent = os.getpid()
    ready, tell = os.pipe()
    child = os.fork()
    if child:
        os.close(tell)
        os.read(ready, 1)
        os.close(ready)
        return child
    wire = FaultyWire(FAR, Chain(made), drop=drop, seed=1)
    signal.signal(signal.SIGUSR1, lambda *_: setattr(made[-1].camera, "frozen", True))
    signal.signal(signal.SIGUSR2, lambda *_: made[-1].camera.esc.fall_back(INIT, 0))
    take_priority(CAMERA_PRIORITY)
    os.write(tell, b"r")
    wire.run(lambda: os.getppid() != parent)
    os._exit(0)


def settings(*expected: CameraIdentity, interface: str = HOST) -> BusSettings:
    """Return the settings of the master."""
    return BusSettings(interface, expected, FRAME_NS, CYCLE_NS)


def read_for(source: EthercatSource, seconds: float) -> tuple[list[Cycle], float]:
    """Read cycles and return them with the time that passed, in cycles."""
    cycles = []
    begin = time.monotonic()
    while time.monotonic() - begin < seconds:
        cycles.append(source.read())
    return cycles, (time.monotonic() - begin) * 1e9 / CYCLE_NS


def _mixed(uv: np.ndarray[Any, np.dtype[np.float64]]) -> int:
    """Count frames whose two cameras show different exposures."""
    angle = np.arctan2((uv[..., 1] - 900.0) / 400.0, (uv[..., 0] - 1000.0) / 500.0)
    # Within one exposure the second camera is a radian ahead; of the next one a milliradian more.
    ahead = np.exp(1j * (angle[:, 1] - angle[:, 0] - 1.0))
    return int(np.count_nonzero(np.nanmax(np.abs(np.angle(ahead)), axis=1) > 5e-4))


def summary(read: list[Cycle], passed: float) -> dict[str, Any]:
    """Count verdicts and compare every frame with the pattern."""
    pattern = TestPattern()
    wrong = mixed = frames = 0
    last = -1
    in_order = True
    for cycle in read:
        block = cycle.frames
        if block is None:
            continue
        frames += len(block)
        in_order &= bool(block.counter[0] > last and np.all(np.diff(block.counter) > 0))
        last = int(block.counter[-1])
        first, count = int(block.counter[0]), last - int(block.counter[0]) + 1
        chosen = block.counter - first
        mixed += _mixed(block.uv)
        for camera in range(block.valid.shape[1]):
            valid, flags, uv = pattern.camera_frames(camera, first, count)
            same = (
                (block.valid[:, camera] == valid[chosen])
                & (block.flags & 1 == flags[chosen])
                & np.all(
                    (block.uv[:, camera] == quantise(uv)[chosen])
                    | np.isnan(block.uv[:, camera]) & np.isnan(uv[chosen]),
                    axis=(1, 2),
                )
            )
            wrong += int(np.count_nonzero(~same))
    verdicts = Counter(cycle.verdict.value for cycle in read)
    longest = without = 0
    for cycle in read:
        without = 0 if cycle.frames is not None else without + cycle.elapsed
        longest = max(longest, without, cycle.elapsed)
    elapsed = sum(cycle.elapsed for cycle in read)
    verdicts["late"] += elapsed - len(read)
    return {
        "verdicts": verdicts,
        "elapsed": elapsed,
        "passed": passed,
        "frames": frames,
        "frames_lost": sum(cycle.frames_lost for cycle in read),
        "last": last,
        "longest_ms": longest,
        "in_order": in_order,
        "mixed": mixed,
        "wrong": wrong,
        "reasons": Counter(cycle.reason for cycle in read if cycle.reason),
    }


def run() -> dict[str, Any]:
    """Measure for three seconds; the order of the cameras on the wire is reversed."""
    return _measured(cameras(LEFT, RIGHT)[::-1], 0.0, 3.0)


def drop() -> dict[str, Any]:
    """Measure while three answers in a hundred get lost, once the cameras are in operation."""
    return _measured(cameras(LEFT, RIGHT), 0.03, 2.0)


def _measured(made: Cameras, drop: float, seconds: float) -> dict[str, Any]:
    serve(made, drop)
    source = EthercatSource(settings(LEFT, RIGHT))
    try:
        source.open()
        return summary(*read_for(source, seconds))
    finally:
        source.close()


def refusals() -> dict[str, Any]:
    """Try to open buses that must be refused."""
    third = CameraIdentity("third", 1003, 3)
    cases: dict[str, tuple[Cameras, tuple[CameraIdentity, ...]]] = {
        "serial": (cameras(LEFT, CameraIdentity("other", 4711, 2)), (LEFT, RIGHT)),
        "missing": (cameras(LEFT, RIGHT), (LEFT, RIGHT, third)),
        "extra": (cameras(LEFT, RIGHT, third), (LEFT, RIGHT)),
        "duplicate": (cameras(LEFT, CameraIdentity("twin", 1001, 2)), (LEFT, RIGHT)),
        "swapped": (
            cameras(CameraIdentity("left", 1001, 2), CameraIdentity("right", 1002, 1)),
            (LEFT, RIGHT),
        ),
        "mapping": (cameras(LEFT, RIGHT), (LEFT, RIGHT)),
        "none": ([], (LEFT, RIGHT)),
        "sensor": (cameras(LEFT, RIGHT), (LEFT, CameraIdentity("right", 1002, 2, 0, 1024, 2048))),
        "sensor exchanged": (
            cameras(LEFT, RIGHT),
            (LEFT, CameraIdentity("right", 1002, 2, 77, 2048, 2048)),
        ),
        "two serials": (cameras(LEFT, RIGHT), (LEFT, RIGHT)),
        "too many": (cameras(*(CameraIdentity("x", n, n) for n in range(1, 6))), (LEFT, RIGHT)),
    }
    remap(cases["mapping"][0][1].camera, 3, 0x1A1F)
    cases["two serials"][0][1].camera.coe.set_value(0x1018, 4, (4711).to_bytes(4, "little"))
    return {name: _refusal(*case) for name, case in cases.items()}


def _descriptors() -> int:
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


def _refusal(made: Cameras, expected: tuple[CameraIdentity, ...]) -> list[str]:
    child = serve(made) if made else None
    before = _descriptors()
    bus = CameraBus(settings(*expected))
    try:
        bus.open()
    except BusError as error:
        return [error.code, error.what, str(_descriptors() - before)]
    finally:
        bus.close()
        if child is not None:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
    return ["accepted"]


def alarms() -> dict[str, Any]:
    """Let cameras report errors, their ends and broken frames, and pause the computer."""
    with tempfile.TemporaryDirectory() as folder, FaultRig(Path(folder), (LEFT, RIGHT)) as rig:
        rig.start_bus()
        ring = rig.ring
        assert ring is not None

        def events(code: str) -> list[list[str]]:
            report = decode_report(ring.report())
            found = () if report is None else report.events
            return [[each.camera, each.what, each.remedy] for each in found if each.code == code]

        def wait_for(code: str) -> None:
            end = time.monotonic() + 60.0
            while not events(code) and time.monotonic() < end:
                time.sleep(0.01)

        rig.command(FaultKind.EMERGENCY, 0, 0x5030)
        wait_for("bus.emergency")
        rig.command(FaultKind.EMERGENCY, 0, 0)
        wait_for("bus.error_over")
        rig.command(FaultKind.LINK_ERRORS, 1, 3)
        wait_for("bus.port_errors")
        for _ in range(3):
            rig.stall_bus(0.03)
            time.sleep(0.2)
        wait_for("bus.host_busy")
        report = decode_report(ring.report())
        assert report is not None
        codes = ("bus.emergency", "bus.error_over", "bus.port_errors", "bus.host_busy")
        return {
            **{code: events(code) for code in codes},
            "emergencies": [camera.emergencies for camera in report.cameras],
            "link errors": [camera.link_errors for camera in report.cameras],
        }


def interfaces() -> dict[str, Any]:
    """Ask for interfaces that must be refused."""
    subprocess.run(["ip", "address", "add", "10.11.12.13/24", "dev", FAR], check=True)
    subprocess.run(["ip", "link", "add", "dark0", "type", "veth", "peer", "dark1"], check=True)
    found = {}
    for name in ("nope0", "x" * 200, "../eth0", "", FAR, "dark0", "lo", HOST):
        try:
            check_interface(name)
            found[name] = ["accepted"]
        except BusError as error:
            found[name] = [error.code, error.what]
    check_interface(FAR, force=True)
    return found


def objects() -> dict[str, Any]:
    """Read and write objects of a camera."""
    serve(cameras(LEFT))
    master = Master(HOST)
    try:
        master.find()
        deque(master.steps_to(PREOP), maxlen=0)
        device = master.identify(0)
        blob = bytes(range(256)) * 4 + bytes(176)
        master.write_object(0, "'left'", 0x8010, 5, blob)
        found: dict[str, Any] = {
            "serial": device.serial,
            "alias": device.alias,
            "name": master.read_object(0, "'left'", 0x1008, 0).decode(),
            "segmented": master.read_object(0, "'left'", 0x8010, 5, 2000) == blob,
        }
        for key, index, sub, value in (
            ("read only", 0x1008, 0, b"x" * 17),
            ("no object", 0x5555, 0, b"\x00"),
            ("no entry", 0x8000, 9, b"\x00"),
            ("length", 0x8000, 1, b"\x00"),
        ):
            try:
                master.write_object(0, "'left'", index, sub, value)
                found[key] = "accepted"
            except BusError as error:
                found[key] = error.what
        return found
    finally:
        master.close()


def late_objects() -> dict[str, Any]:
    """Read entry after entry of one object from a camera that answers some of them too late."""
    made = cameras(LEFT)
    asked = [0]

    def when(_mailbox: bytes) -> bool:
        asked[0] += 1
        return asked[0] % 5 == 0

    late(_MAILBOX_LATE_S, when)(made[0].camera)
    serve(made)
    master = Master(HOST)
    wrong: list[str] = []
    unanswered = right = 0
    try:
        master.find()
        deque(master.steps_to(PREOP), maxlen=0)
        begin = time.monotonic()
        while right < _LATE_READS and time.monotonic() - begin < _LATE_S:
            for sub, pdo in enumerate(NEWEST_LAYOUT.input_pdos, start=1):
                try:
                    value = master.read_object(0, "'left'", SM_ASSIGNMENT + SM_INPUTS, sub)
                except BusError as error:
                    wrong += [error.what] if error.code != "bus.no_answer" else []
                    unanswered += 1
                    continue
                right += int.from_bytes(value, "little") == pdo.index
                if int.from_bytes(value, "little") != pdo.index:
                    wrong.append(f"entry {sub} is {value.hex()}")
        return {"right": right, "wrong": wrong, "unanswered": unanswered}
    finally:
        master.close()


def killed() -> dict[str, Any]:
    """Kill the cameras while they are measuring."""
    return _disturbed(signal.SIGKILL, 1.5)


def frozen() -> dict[str, Any]:
    """Let one camera repeat its last process data for ever."""
    return _disturbed(signal.SIGUSR1, 1.0)


def restarted() -> dict[str, Any]:
    """Let one camera lose its state."""

    def back(after: list[Cycle]) -> bool:
        # A busy computer takes longer, and a bus that does not come back ends the test.
        return sum(cycle.elapsed for cycle in after) > 30_000 or after[-1].frames is not None

    return _disturbed(signal.SIGUSR2, 2.0, back)


def _disturbed(
    number: signal.Signals, seconds: float, done: Callable[[list[Cycle]], bool] = lambda _: True
) -> dict[str, Any]:
    child = serve(cameras(LEFT, RIGHT))
    source = EthercatSource(settings(LEFT, RIGHT))
    after: list[Cycle] = []
    try:
        source.open()
        before, passed = read_for(source, 0.5)
        os.kill(child, number)
        error = ""
        begin = time.monotonic()
        between: list[Cycle] = []
        try:
            # Frames in transit may still arrive.
            between, _ = read_for(source, 0.05)
            while time.monotonic() - begin < seconds or not done(after):
                after.append(source.read())
        except BusError as caught:
            error = caught.code
        return {
            "before": summary(before, passed),
            "between": summary(between, 0.0),
            "after": summary(after, 0.0),
            "flagged": sorted({cycle.reason for cycle in between}),
            "error": error,
            "error_after_s": time.monotonic() - begin,
        }
    finally:
        source.close()


def stalled() -> dict[str, Any]:
    """Let the master sleep for longer than the watchdog, then go on."""
    serve(cameras(LEFT, RIGHT))
    source = EthercatSource(settings(LEFT, RIGHT))
    try:
        source.open()
        before, passed = read_for(source, 0.4)
        time.sleep(0.4)
        after, more = read_for(source, 0.5)
        # However busy this computer is: the last cycle has frames, so that nothing is still out.
        for _ in range(_MOST_TIMES):
            good = sum(cycle.frames is not None for cycle in after)
            if good > 500 and after[-1].frames is not None:
                break
            again, longer = read_for(source, 0.1)
            after += again
            more += longer
        return summary(before + after, passed + more + 400.0)
    finally:
        source.close()


_STRANGERS = {
    # Opens the interface and keeps quiet.
    "silent": "import pysoem, sys; m = pysoem.Master(); m.open(sys.argv[1]); print('open', "
    "flush=True); sys.stdin.read()",
    # Configures the cameras and sends process data.
    "sends": "import pysoem, sys\nm = pysoem.Master(); m.open(sys.argv[1]); print('open', "
    "flush=True)\nwhile m.config_init() <= 0: pass\nm.config_map()\n"
    "while True: m.send_processdata(); m.receive_processdata(2000)",
}


def second_master() -> dict[str, Any]:
    """Start masters of other processes on the interface of a running bus, and end them."""
    serve(cameras(LEFT, RIGHT))
    source = EthercatSource(settings(LEFT, RIGHT))
    seen: dict[str, Any] = {}
    try:
        source.open()
        before, _ = read_for(source, 1.0)
        seen["before"] = sorted({cycle.reason for cycle in before if cycle.frames is None})
        for name, program in _STRANGERS.items():
            with subprocess.Popen(
                [sys.executable, "-c", program, HOST],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            ) as other:  # fmt: skip
                assert other.stdout is not None
                os.set_blocking(other.stdout.fileno(), False)
                while not other.stdout.readline():
                    source.read()
                begin = time.monotonic()
                reasons: list[str] = []
                while "as an EtherCAT master" not in (reasons or [""])[-1]:
                    reasons.append(source.read().reason)
                    assert time.monotonic() - begin < _LATE_S, sorted(set(reasons))
                seen[name] = [time.monotonic() - begin, reasons[-1], source.report.alarm]
                during, _ = read_for(source, 0.3)
                seen[f"{name} frames"] = sum(cycle.frames is not None for cycle in during)
                other.kill()
            end = time.monotonic() + _LATE_S
            while source.read().frames is None or source.report.alarm:
                assert time.monotonic() < end, source.report.message
        return seen
    finally:
        source.close()


SCENARIOS: dict[str, Callable[[], dict[str, Any]]] = {
    scenario.__name__: scenario
    for scenario in (
        run, drop, refusals, alarms, interfaces, objects, late_objects, killed, frozen, restarted,
        second_master, stalled,
    )
}  # fmt: skip


if __name__ == "__main__":
    make_link(HOST, FAR)
    take_priority(BUS_PRIORITY)
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    sys.stdout.write(json.dumps(SCENARIOS[sys.argv[1]]()))
