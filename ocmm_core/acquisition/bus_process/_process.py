"""The program ``ocmm-acq``: the camera bus in a separate process.

Only this part needs network rights and a real-time priority, and could be ended by a fault of the
EtherCAT library. It reads its configuration as one line of JSON from a file or standard input,
fills a ring in shared memory and ends on request in the ring, on SIGTERM, or when its parent is
gone (end of standard input).
"""

from __future__ import annotations

import gc
import signal
import sys
import threading
import time
from functools import partial
from pathlib import Path

import msgspec

from ocmm_core.acquisition.bus_process import _rights as rights
from ocmm_core.acquisition.bus_process._commands import CommandPort, read_first_line
from ocmm_core.acquisition.bus_process._ethercat import EthercatSource
from ocmm_core.acquisition.bus_process._launch import BusConfig, read_config
from ocmm_core.acquisition.frames import AcquisitionWorker, FrameRing, RingHeaderField, leave_error
from ocmm_core.documents import read_bytes
from ocmm_core.failure import REOPEN, exit_with
from ocmm_core.fieldbus.cycle import BusSettings
from ocmm_core.fieldbus.wire import HostTime

_EARLY_NS = 6_000_000
"""Batch length; waking up per cycle costs more than the cycle."""
_DEBT_NS = 100_000_000
"""Maximum delay that is made up."""
_PATIENCE = 50
"""Cameras on the same busy computer answer late during configuration."""
_WINDOW_NS = 1_000_000_000
"""Averaging window of the pace."""


class SteppedTime(HostTime):
    """Time of a virtual bus, which advances per cycle and waits for a busy computer.

    Master and software cameras share it through words of the ring. During bring-up it flows like
    the computer's clock. Once exposures are programmed it stops between cycles and only the master
    advances it, so a slow computer slows the bus without losses: no exposure happens and no
    watchdog runs meanwhile. Short delays are made up by back-to-back cycles; beyond `_DEBT_NS` they
    are dropped, and reported as pace: bus time over real time.
    """

    stretched = True
    patience = _PATIENCE

    def __init__(self, ring: FrameRing) -> None:
        self._ring = ring
        self._held = False
        self._now_ns = self._offset_ns = 0
        self._lead_ns = 0
        self._taken = self._answered = 0
        self._window = (0, 0)
        self._spent_ns = self._passed_ns = 0

    def now_ns(self) -> int:
        """Return the current bus time."""
        return self._now_ns if self._held else time.monotonic_ns() + self._offset_ns

    def wait_until(self, deadline_ns: int) -> int:
        """Advance to `deadline_ns`, not too early; return the lateness, ns."""
        if not self._held:
            time.sleep(max(0, deadline_ns - self.now_ns()) * 1e-9)
            return self.now_ns() - deadline_ns
        early_ns = deadline_ns - self._lead_ns - time.monotonic_ns()
        if early_ns > _EARLY_NS:
            time.sleep(early_ns * 1e-9)
        elif early_ns < -_DEBT_NS:
            self._lead_ns += early_ns + _DEBT_NS
        self._set(max(self._now_ns, deadline_ns))
        self._measure()
        return max(0, time.monotonic_ns() + self._lead_ns - deadline_ns)

    def passage(self, sent_ns: int, answered_ns: int) -> tuple[int, int]:
        """Return the bus time twice: it stops while frames are in transit."""
        if self._held:
            return self._now_ns, self._now_ns
        return sent_ns + self._offset_ns, answered_ns + self._offset_ns

    def hold(self) -> None:
        """Advance from cycle to cycle from now on."""
        if self._held:
            return
        host_ns = time.monotonic_ns()
        self._set(host_ns + self._offset_ns)
        self._held = True
        self._ring.set_word(RingHeaderField.BUS_STEPS, 1)
        self._lead_ns = self._offset_ns
        self._window = (host_ns, self._now_ns)

    def flow(self) -> None:
        """Let time flow freely from now on."""
        if not self._held:
            return
        self._offset_ns = self._now_ns - time.monotonic_ns()
        # Before the word that lets the cameras use it.
        self._ring.set_word(RingHeaderField.BUS_OFFSET_NS, self._offset_ns)
        self._held = False
        self._ring.set_word(RingHeaderField.BUS_STEPS, 0)

    def mark(self) -> None:
        self._taken = self._ring.word(RingHeaderField.FRAMES_TAKEN)
        self._answered = self._ring.word(RingHeaderField.FRAMES_ANSWERED)

    def on_their_way(self, sent: int, came: int) -> bool:
        """Return whether cameras miss frames, or answers are outstanding."""
        # The cameras count an answer before the frame that it answers.
        if self._ring.word(RingHeaderField.FRAMES_TAKEN) - self._taken < sent:
            return True
        return came < self._ring.word(RingHeaderField.FRAMES_ANSWERED) - self._answered

    def _set(self, now_ns: int) -> None:
        self._now_ns = now_ns
        self._ring.set_word(RingHeaderField.BUS_NOW_NS, now_ns)

    def _measure(self) -> None:
        host_ns = time.monotonic_ns()
        since_ns, then_ns = self._window
        spent_ns, passed_ns = host_ns - since_ns, self._now_ns - then_ns
        if spent_ns < _WINDOW_NS:
            return
        self._window = (host_ns, self._now_ns)
        self._spent_ns += spent_ns
        self._passed_ns += passed_ns
        self._tell(passed_ns / spent_ns)

    def _tell(self, pace: float) -> None:
        self.pace = pace = min(1.0, pace)
        mean = self._passed_ns / self._spent_ns
        for word, value in (
            (RingHeaderField.PACE_PPM, pace),
            (RingHeaderField.MEAN_PACE_PPM, mean),
        ):
            # Zero marks a bus in real time.
            self._ring.set_word(word, max(1, round(1e6 * min(1.0, value))))


def main() -> None:
    """Run ``ocmm-acq [--interface NAME | CONFIG.json]``, or by standard input."""
    try:
        sys.exit(_run(sys.argv[1:]))
    except Exception as error:
        exit_with(error, "The bus process", REOPEN)


def _run(arguments: list[str]) -> int:
    fixed = arguments[1] if arguments[:1] == ["--interface"] and len(arguments) > 1 else ""
    from_parent = bool(fixed) or not arguments
    content = read_first_line(sys.stdin.fileno()) if from_parent else read_bytes(Path(arguments[0]))
    config = read_config(content)
    if fixed:
        config = msgspec.structs.replace(
            config, interface=fixed, redundant_interface="", force=False, stretched=False
        )
    ring = FrameRing.attach(config.ring_path)
    port: CommandPort | None = None
    stop = threading.Event()
    try:
        notes = tuple(
            missing
            for missing in (
                rights.take_priority(rights.BUS_PRIORITY),
                rights.lock_memory(),
                rights.take_processor(config.processor),
            )
            if missing
        )
        for note in notes:
            sys.stderr.write(f"note: {note}\n")
        if from_parent:
            port = CommandPort.from_standard_streams(stop.set, partial(leave_error, ring))
        source = EthercatSource(
            _settings(config),
            ring.set_report,
            port,
            notes,
            SteppedTime(ring) if config.stretched else None,
        )
        worker = AcquisitionWorker(source, ring, stop)
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda _number, _frame: worker.request_stop())
        # A collection takes milliseconds; the source runs one when time is not critical.
        gc.collect()
        gc.freeze()
        gc.disable()
        return worker.run_program()
    finally:
        if port is not None:
            port.close()
        ring.close()


def _settings(config: BusConfig) -> BusSettings:
    return BusSettings(
        config.interface,
        config.cameras,
        config.frame_period_ns,
        config.cycle_period_ns,
        config.force,
        config.redundant_interface,
        config.device,
        config.lenses,
    )


if __name__ == "__main__":
    main()
