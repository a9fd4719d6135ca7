"""One camera: a thread takes its buffers, checks them, and finds the spots."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import FrameFlag
from ocmm_core.camera import SpotFinder
from ocmm_core.errors import AcquisitionError
from ocmm_core.failure import REOPEN, contained
from ocmm_core.geometry import Float
from ocmm_genicam._black import BLACK_IMAGES, read_mending
from ocmm_genicam._client import COMPLETE, Camera, Image, unpack
from ocmm_genicam._set_up import Expected, SetUp
from ocmm_genicam._timing import CameraClock, ClockState

_TAKE_S = 0.05
_CLOCK_S = 1.0
_STOP_S = 0.9
_QUEUE = 256
_WRAP = 0xFFFF
_STEP_SHARE = 4
"""An exposure off the number of periods by a period over this one is a step of the clock."""
_LINES = "LineStatusAll"


@dataclass(slots=True)
class BufferAccount:
    """Every exposure of a camera: ``exposures == delivered + lost``."""

    exposures: int = 0
    delivered: int = 0
    lost: int = 0
    """Never arrived, incomplete, refused, or overwritten before they were joined."""
    incomplete: int = 0
    refused: int = 0
    overrun: int = 0
    """`incomplete`, `refused`, `overrun`: buffers, as parts of `lost`; refused ones were old."""


@dataclass(frozen=True, slots=True)
class Spots:
    """Spots of one exposure."""

    time_ns: int
    flags: int
    valid: int
    uv: Float
    """(S, 2), px."""
    exposure: int
    """Number of the exposure of its camera: 1, 2, 3 ..."""
    heard_s: float
    """Time of its arrival, on the monotonic clock of this computer."""


class Grabber:
    """Takes the buffers of one camera in a separate thread.

    `clock` is read once a second in the same thread: a camera has one owner; None: exposure times
    are not proven. `wake` is called after each new frame and at the end.
    """

    def __init__(
        self,
        camera: Camera,
        clock: CameraClock | None,
        set_up: SetUp,
        expected: Expected,
        wake: Callable[[], None],
    ) -> None:
        self.camera, self.account = camera, BufferAccount()
        self.frames: deque[Spots] = deque()
        """For the reader, who removes them from the left."""
        self.kept: deque[tuple[int, NDArray[np.uint16]]] = deque()
        """Time and counts (height, width) of images kept by `keep`."""
        self._keeps = 0
        self.clock_state: ClockState | None = None
        self.failure: Exception | None = None
        self.heard_s = time.monotonic()
        """Time of the last complete image, on the monotonic clock."""
        self._clock, self._set_up, self._expected, self._wake = clock, set_up, expected, wake
        pixels, window = set_up.pixels, set_up.window
        self._pixels, self._corner = pixels, np.array([window.left, window.top], np.float64)
        options = pixels.spot_options().at_period(expected.period_ns, window.width)
        lines = min(options.search_lines, -(-window.height // options.search_step))
        self._mending = read_mending(Path(expected.black), camera, set_up)
        options = replace(options, search_lines=lines, black_frames=BLACK_IMAGES)
        self._finder = SpotFinder(window.width, window.height, options, n_slots=expected.n_slots)
        # The first call may compile, which takes longer than a camera may be silent.
        dark = np.zeros(set_up.size, np.uint8)
        self._finder.find(unpack(pixels, dark, window.width, window.height))
        self._last: tuple[int, int] | None = None
        self._stop = threading.Event()
        # A daemon: the library may wait for a camera that is gone.
        self._thread = threading.Thread(
            target=self._run, name=f"ocmm-genicam-{camera.serial}", daemon=True
        )

    def start(self) -> None:
        self.heard_s = time.monotonic()
        self._thread.start()

    def keep(self, count: int) -> None:
        """Keep the next ``count`` images, and forget those before."""
        self._keeps = 0
        self.kept.clear()
        self._keeps = count

    @property
    def full_scale(self) -> int:
        """Return the counts from which pixels are overexposed."""
        return self._pixels.full_scale

    def close(self) -> None:
        """Stop the thread and release the camera, unless it no longer answers.

        Releasing would wait 15 s for its answers; it releases itself when its heartbeat ends.
        """
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(_STOP_S)
        if not self._thread.is_alive() and time.monotonic() - self.heard_s < _STOP_S:
            self.camera.close()

    def _run(self) -> None:
        try:
            self.camera.start()
            due = time.monotonic() + _CLOCK_S
            while not self._stop.is_set():
                image = self.camera.next_image(_TAKE_S)
                if image is not None:
                    self.process(image)
                if self._clock is not None and time.monotonic() > due:
                    self.clock_state = self._clock.state()
                    due = time.monotonic() + _CLOCK_S
        except Exception as error:
            self.failure = contained(error, f"Camera {self.camera.serial}", remedy=REOPEN)
        self._wake()

    def process(self, image: Image) -> None:
        """Check a buffer, and find its spots; AcquisitionError for a camera that has changed."""
        account, expected, set_up = self.account, self._expected, self._set_up
        as_set = set_up.is_of(image)
        if image.status != COMPLETE or (as_set and len(image.data) < set_up.size):
            # Its number and time are of another frame: the next complete one tells how many.
            account.incomplete += 1
            return
        if not as_set:
            window = set_up.window
            raise AcquisitionError(
                "genicam.image",
                f"Camera {self.camera.serial} sends {image.width} x {image.height} px from "
                f"({image.left}, {image.top}) on in format {image.pixel_format:#010x}, but was set "
                f"to {window.width} x {window.height} px from ({window.left}, {window.top}) on in "
                f"{self._pixels.name}.",
                "Close other programs that change the camera, then open the job again.",
            )
        if not image.time_ns:
            raise AcquisitionError(
                "genicam.no_time",
                f"Camera {self.camera.serial} sends images without time: lost ones cannot be "
                "counted.",
                "Use a camera, and a producer, with time stamps.",
            )
        gap = self._exposures_since(image)
        if gap is None:
            account.refused += 1
            return
        self._last = (image.number, image.time_ns)
        self.heard_s = time.monotonic()
        account.exposures += gap
        account.delivered += 1
        account.lost += gap - 1
        counts = unpack(self._pixels, image.data, image.width, image.height)
        self._mending.mend(counts)
        if self._keeps > 0:
            self._keeps -= 1
            self.kept.append((image.time_ns, counts.copy()))
        block = self._finder.find(counts, self._mending.black)
        flags = int(FrameFlag.SATURATED) if block.saturated[0] else 0
        # Read with each image: some frames late at most, and the ball rests for many.
        if expected.button_line >= 0 and (self.camera.integer(_LINES) >> expected.button_line & 1):
            flags |= FrameFlag.BUTTON
        if len(self.frames) >= _QUEUE:
            account.overrun += 1
            account.delivered -= 1
            account.lost += 1
        else:
            valid = int(np.uint64(block.valid[0]))
            uv = block.uv[0] + self._corner
            self.frames.append(
                Spots(image.time_ns, flags, valid, uv, account.exposures, self.heard_s)
            )
        self._wake()

    def _exposures_since(self, image: Image) -> int | None:
        """Return the exposures since the last complete image, this one included; None if old.

        AcquisitionError: number and time of the image contradict each other.
        """
        if self._last is None:
            return 1
        number, time_ns = self._last
        passed_ns = image.time_ns - time_ns
        gap = image.number - number
        if gap == 0:
            return None
        if gap < 0:
            gap += _WRAP
        period_ns = self._expected.period_ns
        if passed_ns > 0 and abs(passed_ns - gap * period_ns) <= period_ns // _STEP_SHARE:
            return gap
        if -_QUEUE < image.number - number < 0 and passed_ns <= 0:
            return None
        raise AcquisitionError(
            "genicam.clock_step",
            f"Camera {self.camera.serial}: {gap} exposures after the last one its clock has "
            f"advanced by {passed_ns * 1e-6:.3f} ms instead of {gap * period_ns * 1e-6:.3f} ms.",
            "The clock was set, the camera restarted, or its trigger is not the rate of the rig: "
            "check PTP, trigger and 'frame_rate_hz', then open the job again.",
        )
