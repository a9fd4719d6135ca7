"""Frames from the EtherCAT bus: one read is one bus cycle, judged and accounted for."""

from __future__ import annotations

import time

import numpy as np

from ocmm_core.acquisition.frames import Cycle, CycleVerdict
from ocmm_core.acquisition.join import FrameJoiner
from ocmm_core.acquisition.source import SourceDescription
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.bus import BusSettings, CameraBus, Exchange
from ocmm_core.fieldbus.camera_slave import (
    FRAME_DTYPE,
    FRAMES_PER_CYCLE,
    HEADER_STRUCT,
    decode_spots,
)
from ocmm_core.fieldbus.health import (
    CameraRecord,
    Fault,
    Trouble,
    advance,
    first_frame,
    judge,
)

_VERDICT = {Trouble.LOST: CycleVerdict.LOST, Trouble.BAD: CycleVerdict.BAD}
_ANSWER_SHARE = 0.7
"""Part of a cycle that is spent waiting for the answer."""
_GIVE_UP_S = 3.0


class EthercatSource:
    """Cameras on an EtherCAT bus, as a `FrameSource`.

    The cycle runs on the clock of this computer, by absolute deadlines. It need not be locked to
    the bus clock: the cameras keep their frames, and a cycle can carry more than are made in it.

    Parameters
    ----------
    settings
        Interface, cameras and periods.

    Attributes
    ----------
    lateness_ns
        How late the last cycle began.
    """

    def __init__(self, settings: BusSettings) -> None:
        self._settings = settings
        self._bus = CameraBus(settings)
        self._joiner: FrameJoiner | None = None
        self._records: list[CameraRecord] = []
        self._begin_ns = 0
        self._index = -1
        self._answered_ns = 0
        self.lateness_ns = 0

    @property
    def description(self) -> SourceDescription:
        """Return what the source says about itself."""
        return SourceDescription(
            name=f"EtherCAT ({self._settings.interface})",
            camera_serials=tuple(camera.serial for camera in self._settings.cameras),
            frame_period_ns=self._settings.frame_period_ns,
            cycle_period_ns=self._settings.cycle_period_ns,
            live=True,
        )

    def open(self) -> None:
        """Bring the cameras to operation; raise BusError with the remedy if that fails."""
        self._bus.open()
        schedule = self._bus.schedule
        self._records = [CameraRecord(camera.name) for camera in self._settings.cameras]
        self._joiner = FrameJoiner(len(self._records), schedule.start_ns, schedule.period_ns)
        self._begin_ns = self._answered_ns = time.monotonic_ns()
        self._index = -1

    def read(self) -> Cycle:
        """Run the next bus cycle.

        Raises
        ------
        BusError
            A camera was restarted, or the bus has been silent for seconds.
        """
        if self._joiner is None:
            raise BusError("bus.closed", "The camera bus is not open.", "Open it first.")
        period = self._settings.cycle_period_ns
        deadline = self._begin_ns + (self._index + 1) * period
        wait = deadline - time.monotonic_ns()
        if wait > 0:
            time.sleep(wait * 1e-9)
        now = time.monotonic_ns()
        self.lateness_ns = now - deadline
        index = (now - self._begin_ns) // period
        elapsed, self._index = index - self._index, index
        exchange = self._bus.exchange(
            [record.next_frame for record in self._records], int(_ANSWER_SHARE * period)
        )
        end = time.monotonic_ns()
        fault = judge(exchange.answer, self._records, self._bus.schedule)
        if fault is not None:
            self._watch_silence(fault, end)
            return Cycle(_VERDICT[fault.trouble], fault.reason, elapsed=elapsed)
        self._answered_ns = end
        self._take(exchange, self._joiner)
        joined = self._joiner.pull()
        late = end > self._begin_ns + (index + 1) * period
        return Cycle(
            CycleVerdict.LATE if late else CycleVerdict.GOOD,
            "The computer was busy and answered the cameras late." if late else "",
            frames=joined.frames,
            elapsed=elapsed,
            frames_lost=joined.lost,
        )

    def close(self) -> None:
        """Give the bus back; may be called twice, and after a failed open."""
        self._bus.close()
        self._joiner = None

    def _take(self, exchange: Exchange, joiner: FrameJoiner) -> None:
        """Hand the frames that are new to the joiner, by their counters."""
        schedule = self._bus.schedule
        for camera, (header, content) in enumerate(
            zip(exchange.answer.headers, exchange.inputs, strict=True)
        ):
            record = self._records[camera]
            first = first_frame(header, schedule)
            known = max(0, record.next_frame - first)
            frames = np.frombuffer(
                content, FRAME_DTYPE, count=FRAMES_PER_CYCLE, offset=HEADER_STRUCT.size
            )[known : header.frames_valid]
            if len(frames):
                counter = first + known + np.arange(len(frames))
                joiner.push(
                    camera,
                    schedule.start_ns + counter * schedule.period_ns,
                    frames["flags"],
                    frames["valid"],
                    decode_spots(frames),
                )
            self._records[camera] = advance(record, header, schedule)

    def _watch_silence(self, fault: Fault, now_ns: int) -> None:
        if now_ns - self._answered_ns > _GIVE_UP_S * 1e9:
            raise BusError(
                "bus.silent",
                f"The camera bus gave nothing usable for {_GIVE_UP_S:.0f} s: {fault.reason}",
                "Check cable and power of the cameras, then start again.",
            )
