"""Does it hold? Cameras, wire and window for minutes, undisturbed, with losses and with freezes.

Three runs at 1 kHz with 8 kHz frames: two software cameras that show the virtual rig, a cable that
writes down what it carries and can lose frames, the bus process, and the window with its tracking,
drawn in memory; each of the four in a process of its own.

1. undisturbed;
2. the cable loses 1 % of the answers, seeded;
3. the window stands still for 2 s every 10 s, holding the lock of its interpreter.

Prints the books of the bus process beside those of the cable, which must agree to the cycle, and
ends with 1 where a limit is broken; above it how late the doctor's own measurement woke up before
the run and during it. From 20 minutes on the memory of each process is judged by what
it grows after the first ten. Run: ``python -m benchmarks.soak [SECONDS]``; the first
run takes so long (600 by default), the others a fifth of it. ``--stepped``: see `soak_stepped`.
"""

from __future__ import annotations

import ctypes
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import msgspec
from PySide6.QtCore import QTimer

from benchmarks import soak_stepped
from benchmarks.faulty_line import LineDirection, LineRule, ProxyConfig, Trick
from benchmarks.soak_books import (
    WARM_UP_S,
    Cable,
    Outcome,
    Usage,
    WakeUps,
    children_of,
    counters,
    judge,
    mapped_ring,
    once_in_operation,
    words,
)
from benchmarks.soak_observer import Observer, run_observed
from ocmm_core.acquisition.frames import read_status
from ocmm_core.camera import load_rig
from ocmm_core.composition import DEMO_PLAN, RECOMMENDED_RIG, StationRequest, build_station
from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus.report import decode_report
from ocmm_core.fieldbus.wire import make_link, namespace_command
from ocmm_core.inspection.plan import load_plan
from ocmm_gui.app import make_application
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import NoticeCentre
from ocmm_gui.window import MainWindow
from ocmm_sim.bus import READY
from ocmm_sim.sources import segment_of

SECONDS = 600.0
OTHERS = 0.2
"""Length of the second and third run against the first."""
SAMPLE_S, MOST_SAMPLES = 2.0, 300
"""The samples are kept in the window's process, whose memory they measure."""
DROPPED = 0.01
SEED = 7
FREEZE_S, FREEZE_EVERY_S = 2.0, 10.0
START_S = 60.0
FOLLOWS_FRAMES = 2000
FRAME_PERIOD_NS = 125_000

_HOST, _NEAR, _FAR, _CAMERAS = "host0", "near0", "far0", "cameras0"
_INSIDE, _MODULE = "--inside", "benchmarks.soak"


def start(module: str, first_line: bytes) -> subprocess.Popen[bytes]:
    """Start one of our programs and wait until it is ready."""
    child = subprocess.Popen(  # noqa: S603 - our own interpreter and modules, no shell
        [sys.executable, "-m", module], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert child.stdin is not None
    assert child.stdout is not None
    child.stdin.write(first_line)
    child.stdin.flush()
    assert child.stdout.readline().decode().strip() == READY
    return child


def stop(child: subprocess.Popen[bytes]) -> None:
    """End it by the end of its input."""
    assert child.stdin is not None
    assert child.stdout is not None
    child.stdin.close()
    child.wait(10.0)
    child.stdout.close()


def bus_pid() -> int:
    """Return the number of the bus process, a child of this one."""
    for child, command in children_of(os.getpid()):
        if b"ocmm_core.acquisition.bus_process._start" in command:
            return child
    raise RuntimeError("there is no bus process")


def play(folder: Path, seconds: float, rules: tuple[LineRule, ...], *, freeze: bool) -> Outcome:
    """Play one run inside a private namespace."""
    make_link(_HOST, _NEAR)
    make_link(_FAR, _CAMERAS)
    proxy = ProxyConfig(
        master_side=_NEAR, camera_side=_FAR, control=str(folder / "cable"), seed=SEED
    )
    request = StationRequest(
        plan=DEMO_PLAN, out=folder / "jobs", source=f"ethercat:{_HOST}", uncalibrated=True
    )
    segment = segment_of(request, load_plan(DEMO_PLAN), load_rig(RECOMMENDED_RIG))
    segment = msgspec.structs.replace(segment, interface=_CAMERAS)
    cable_process = start("benchmarks.faulty_line", msgspec.json.encode(proxy) + b"\n")
    cameras_process = start("ocmm_sim.bus._camera_process", segment.to_json())
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ask:
        ask.bind(str(folder / "asker"))
        ask.settimeout(5.0)
        try:
            cable = Cable(folder / "cable", ask)
            pids = {"cable": cable_process.pid, "cameras": cameras_process.pid}
            return _with_window(request, cable, pids, seconds, rules, freeze=freeze)
        finally:
            stop(cable_process)
            stop(cameras_process)


def _with_window(
    request: StationRequest,
    cable: Cable,
    pids: dict[str, int],
    seconds: float,
    rules: tuple[LineRule, ...],
    *,
    freeze: bool,
) -> Outcome:
    app = make_application()
    station = build_station(request).station
    ring = mapped_ring()
    observer = Observer(None, FRAME_PERIOD_NS)
    bridge = StationBridge(station)
    window = MainWindow(bridge, NoticeCentre())
    window.resize(1920, 1080)
    window.show()
    usage = {name: Usage() for name in ("window", "bus", *pids)}
    first: dict[str, int] = {}
    moments: list[float] = []
    freezes = 0
    libc = ctypes.PyDLL(None)

    def wait_until_it_follows() -> None:
        # Code that is compiled at the first run takes longer than the ring lasts on slow machines.
        if read_status(ring).frames - station.looks.live().frame_counter < FOLLOWS_FRAMES:
            begin()
        else:
            QTimer.singleShot(100, wait_until_it_follows)

    def begin() -> None:
        pids.update(window=os.getpid(), bus=bus_pid())
        cable.order(rules)
        observer.clear()
        first.update(counters(read_status(ring)))
        moments.append(time.monotonic())
        sampling.start()
        if freeze:
            freezing.start()
        QTimer.singleShot(round(1000 * seconds), end)

    def sample() -> None:
        cable.order()
        for name, held in usage.items():
            held.look(pids[name], time.monotonic() - moments[0])

    def stand_still() -> None:
        nonlocal freezes
        freezes += 1
        # A library that is called this way keeps the interpreter's lock.
        libc.usleep(round(FREEZE_S * 1e6))

    def end() -> None:
        sampling.stop()
        freezing.stop()
        moments.append(time.monotonic())
        window.close()

    sampling, freezing = QTimer(), QTimer()
    sampling.setInterval(round(1000 * max(SAMPLE_S, seconds / MOST_SAMPLES)))
    sampling.timeout.connect(sample)
    freezing.setInterval(round(1000 * FREEZE_EVERY_S))
    freezing.timeout.connect(stand_still)
    once_in_operation(station, ring, START_S, wait_until_it_follows, window.close)
    run_observed(app, bridge, station, observer)
    cable.order(())
    report = decode_report(ring.report())
    status = read_status(ring)
    ring.close()
    if not moments or report is None:
        raise RuntimeError(f"the bus did not come to operation: {status.message}")
    return Outcome(
        moments[1] - moments[0], counters(status), first, report,
        cable.exchanged, len(cable.spoilt), cable.answers, cable.dropped, freezes, usage,
        observer.frames, observer.gaps, observer.stale,
    )  # fmt: skip


RUNS = (
    ("undisturbed", (), False),
    (
        "1 % of answers dropped",
        (LineRule(do=Trick.DROP, way=LineDirection.ANSWER, share=DROPPED),),
        False,
    ),
    ("window stands still", (), True),
)


def inside(arguments: Sequence[str]) -> int:
    """Play one run and leave its outcome in a file."""
    number, seconds, folder = int(arguments[0]), float(arguments[1]), Path(arguments[2])
    _name, rules, freeze = RUNS[number]
    outcome = play(folder, seconds, rules, freeze=freeze)
    (folder / "outcome.json").write_bytes(msgspec.json.encode(outcome))
    return 0


def main() -> int:
    """Play the runs in private namespaces, print the tables and return the exit code."""
    arguments = sys.argv[1:]
    if arguments[:1] == [_INSIDE]:
        return inside(arguments[1:])
    if arguments[:1] == ["--stepped"]:
        return soak_stepped.main(arguments[1:])
    try:
        prefix = namespace_command()
    except OcmmError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    seconds = float(arguments[0]) if arguments else SECONDS
    kept = True
    for number, (name, _rules, _freeze) in enumerate(RUNS):
        with tempfile.TemporaryDirectory() as folder:
            lasts = seconds if number == 0 else OTHERS * seconds
            before, beside = WakeUps(WARM_UP_S).words(), WakeUps(lasts + WARM_UP_S)
            done = subprocess.run(  # noqa: S603 - this module again
                [*prefix, sys.executable, "-m", _MODULE, _INSIDE, str(number), str(lasts), folder],
                cwd=Path(__file__).resolve().parents[1],
                check=False,
            )
            if done.returncode:
                return 2
            content = (Path(folder) / "outcome.json").read_bytes()
        seen = msgspec.json.decode(content, type=Outcome)
        rows = judge(name, seen)
        print(f"== {name}", *words(seen), sep="\n")
        print(f"wakes up late before {before}", f"wakes up late beside {beside.words()}", sep="\n")
        for row in rows:
            print(
                f"{row.name:30s} {row.value:>22s}  {row.limit:28s} "
                f"{'ok' if row.kept else 'BROKEN'}",
                flush=True,
            )
        kept = kept and all(row.kept for row in rows)
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
