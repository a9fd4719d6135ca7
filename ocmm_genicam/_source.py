"""All cameras of a rig as a frame source: exposures joined by the time on their common clock."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import Cycle, CycleVerdict, FrameBlock, SourceDescription
from ocmm_core.errors import AcquisitionError
from ocmm_core.geometry import Float
from ocmm_genicam._client import Camera, Cameras, scaled
from ocmm_genicam._grabber import BufferAccount, Grabber, Spots
from ocmm_genicam._link import loads_of, require_carried
from ocmm_genicam._set_up import Expected, set_up, settings_of
from ocmm_genicam._timing import MOST_SKEW_NS, CameraClock, require_bound, wait_until_bound

_READ_S = 0.1
_KEPT_IMAGES = 8
_CLOCK_S = 2.5
"""Cameras need longer after power-up; the job is then opened again."""


class GenicamSource:
    """A `FrameSource` of GenICam cameras, in the order of the rig.

    `silence_s`: a camera without complete image, or cameras without common exposure, for this time
    are a fault. `untimed`: frames are joined by counting exposures, without a common clock.
    """

    def __init__(
        self,
        description: SourceDescription,
        cameras: Cameras,
        serials: Sequence[str],
        expected: Sequence[Expected],
        silence_s: float,
        *,
        untimed: bool = False,
    ) -> None:
        self.description = description
        self._cameras, self._serials, self._expected = cameras, tuple(serials), tuple(expected)
        self._silence_s = silence_s
        self._count = ExposurePairing(expected[0].period_ns) if untimed else None
        self._grabbers: list[Grabber] = []
        self._opened: list[Camera] = []
        self._fresh = threading.Event()
        self.origin_ns: int | None = None
        """Time of the first frame on the clock of the cameras; frames count from it."""
        self._last: tuple[int, int] = (-1, 0)
        self._joined_s = 0.0
        self._apart_ns = 0

    @property
    def accounts(self) -> dict[str, BufferAccount]:
        """Return the account of each camera by serial number."""
        return {one.camera.serial: one.account for one in self._grabbers}

    def open(self) -> None:
        """Take control, set up, prove the common clock, start; AcquisitionError."""
        for serial in self._serials:
            self._opened.append(self._cameras.open(serial))
        set_ups = [
            set_up(camera, expected)
            for camera, expected in zip(self._opened, self._expected, strict=True)
        ]
        if not self.description.stretched:
            require_carried(loads_of(self._opened, set_ups, self._expected[0].period_ns))
        clocks: list[CameraClock | None] = [None] * len(self._opened)
        if self._count is None:
            _require_alike(self._opened)
            proven = [CameraClock(camera) for camera in self._opened]
            wait_until_bound(proven, _CLOCK_S)
            clocks = [*proven]
        self._grabbers = [
            Grabber(*one, self._fresh.set)
            for one in zip(self._opened, clocks, set_ups, self._expected, strict=True)
        ]
        for one in self._grabbers:
            one.start()
        self._joined_s = time.monotonic()

    def read(self) -> Cycle:
        """Return the frames complete in all cameras; AcquisitionError for a faulty camera."""
        deadline = time.monotonic() + _READ_S
        while time.monotonic() < deadline:
            self._fresh.wait(_READ_S)
            self._fresh.clear()
            for one in self._grabbers:
                if one.failure is not None:
                    raise one.failure
            require_bound([one.clock_state for one in self._grabbers if one.clock_state])
            joined = self._join()
            if joined:
                self._joined_s = time.monotonic()
                return self._cycle(joined)
        self._refuse_silence()
        return Cycle(CycleVerdict.LATE)

    def pictures(self, within_s: float) -> list[NDArray[np.uint16]]:
        """Return one image of each camera, (height, width), exposed at one time; full scale 65535.

        AcquisitionError as `read`, or if the cameras make none together.
        """
        for one in self._grabbers:
            one.keep(_KEPT_IMAGES)
        deadline = time.monotonic() + within_s
        while time.monotonic() < deadline:
            self.read()
            kept = [dict(one.kept) for one in self._grabbers]
            for time_ns in reversed(kept[0]):
                near = [
                    min(images, key=lambda each: abs(each - time_ns), default=0) for images in kept
                ]
                if all(near) and max(near) - min(near) <= MOST_SKEW_NS:
                    return [
                        scaled(images[each], one.full_scale)
                        for images, each, one in zip(kept, near, self._grabbers, strict=True)
                    ]
            if all(len(images) >= _KEPT_IMAGES for images in kept):
                for one in self._grabbers:
                    one.keep(_KEPT_IMAGES)
        raise AcquisitionError(
            "genicam.no_picture",
            f"The cameras made no picture at the same time within {within_s:.1f} s.",
            "Set a lower frame rate in the rig, and jumbo frames (MTU 9000) on network card and "
            "switch.",
        )

    def close(self) -> None:
        """Release all cameras; idempotent."""
        for one in self._grabbers or self._opened:
            one.close()

    def _join(self) -> list[list[Spots]]:
        """Return the exposures that all cameras made at one time; drop those of some only."""
        queues = [one.frames for one in self._grabbers]
        if self._count is not None:
            return self._count.join(queues)
        joined = []
        while all(queues):
            times = [queue[0].time_ns for queue in queues]
            newest = max(times)
            if newest - min(times) <= MOST_SKEW_NS:
                joined.append([queue.popleft() for queue in queues])
                continue
            self._apart_ns = newest - min(times)
            for queue, each in zip(queues, times, strict=True):
                if newest - each > MOST_SKEW_NS:
                    queue.popleft()
        return joined

    def _cycle(self, joined: list[list[Spots]]) -> Cycle:
        period_ns = self.description.frame_period_ns
        counters, times = [], []
        before, before_ns = self._last
        lost = 0
        for frame in joined:
            # Clocks without a common time: that of the first camera.
            time_ns = (frame[0] if self._count else min(frame, key=_time_of)).time_ns
            if self.origin_ns is None:
                self.origin_ns = before_ns = time_ns
                steps = 1
            else:
                steps = max(1, round((time_ns - before_ns) / period_ns))
            lost += steps - 1
            before, before_ns = before + steps, time_ns
            counters.append(before)
            times.append(time_ns - self.origin_ns)
        self._last = (before, before_ns)
        block = FrameBlock(
            counter=np.array(counters, np.int64),
            time_ns=np.array(times, np.int64),
            flags=np.array(
                [np.bitwise_or.reduce([one.flags for one in frame]) for frame in joined], np.uint32
            ),
            valid=np.array([[one.valid for one in frame] for frame in joined], np.uint64),
            uv=np.array([[one.uv for one in frame] for frame in joined]),
        )
        return Cycle(CycleVerdict.GOOD, frames=block, elapsed=len(joined), frames_lost=lost,
                     skipped=CycleVerdict.GOOD)  # fmt: skip

    def _refuse_silence(self) -> None:
        now = time.monotonic()
        for one in self._grabbers:
            if now - one.heard_s > self._silence_s:
                account = one.account
                raise AcquisitionError(
                    "genicam.silent",
                    f"Camera {one.camera.serial} sent no complete image for "
                    f"{self._silence_s:.1f} s ({account.delivered} before, "
                    f"{account.incomplete} incomplete).",
                    "Check its cable, power and trigger; if images are incomplete, set jumbo "
                    "frames (MTU 9000) on network card and switch, or a lower frame rate.",
                )
        if now - self._joined_s > self._silence_s:
            raise AcquisitionError(
                "genicam.apart",
                f"The cameras do not expose at the same time: their exposures are "
                f"{self._apart_ns * 1e-6:.3f} ms apart, and {MOST_SKEW_NS * 1e-6:.3f} ms is "
                "allowed.",
                "PTP aligns clocks, not exposures: trigger all cameras by one line, or by a signal "
                "that each derives from PTP.",
            )


def _time_of(spots: Spots) -> int:
    return spots.time_ns


def _require_alike(cameras: Sequence[Camera]) -> None:
    """Refuse cameras whose time stamps may mean different moments; AcquisitionError."""
    models = {camera.model for camera in cameras}
    exposures = {round(settings_of(camera)[0], 1) for camera in cameras}
    if len(models) > 1 or len(exposures) > 1:
        differ = sorted(models) if len(models) > 1 else [f"{one} us" for one in sorted(exposures)]
        raise AcquisitionError(
            "genicam.unlike",
            f"The cameras differ in model or exposure time ({', '.join(differ)}): their time "
            "stamps may mean different moments of the exposure.",
            "Use cameras of one model, and set the same exposure time in all.",
        )


_FIRST = 25
"""Exposures of each camera, paired by their arrival."""
_BLOCK, _LATELY = 64, 16
"""Pairs of a block, and the last blocks whose earliest arrivals are compared with the first ones:
no image arrives early, but all of them may be late for seconds, behind incomplete ones.
Free-running cameras drift apart by a period in minutes."""
_SLIP = 0.75
"""Paired exposures that arrive this many periods further apart than at first have slipped; less
than one, so that first pairs made of late images are made again."""


class ExposurePairing:
    """Pair the exposures of cameras that run at one rate without a common clock.

    The first pairs are the exposures that arrive together; then exposures are counted, so that the
    skew of the cameras does not depend on late or missing frames. Free-running cameras
    drift apart: after a period they are paired again, with a gap that ends all that was learnt of
    their skew.
    """

    def __init__(self, period_ns: int) -> None:
        self._period_s = period_ns * 1e-9
        self._offsets: list[int] | None = None
        self._first_apart_s = np.zeros(0)
        self._block: list[list[float]] = []
        self._earliest: deque[Float] = deque(maxlen=_LATELY)

    def join(self, queues: Sequence[deque[Spots]]) -> list[list[Spots]]:
        """Remove the pairs from the queues of the cameras, and return them."""
        if self._offsets is None:
            if min(map(len, queues)) < _FIRST:
                return []
            leads = np.array([min(map(self._lead, tuple(queue))) for queue in queues])
            self._first_apart_s = leads - leads[0]
            self._offsets = [round(one / self._period_s) for one in self._first_apart_s.tolist()]
            self._block.clear()
            self._earliest.clear()
            # A gap: nothing before it belongs to these pairs.
            for queue in queues:
                for _ in range(_FIRST):
                    queue.popleft()
        joined = []
        while all(queues):
            numbers = [
                queue[0].exposure + offset
                for queue, offset in zip(queues, self._offsets, strict=True)
            ]
            newest = max(numbers)
            if min(numbers) == newest:
                frame = [queue.popleft() for queue in queues]
                if self._slipped(frame):
                    self._offsets = None
                    break
                joined.append(frame)
                continue
            for queue, number in zip(queues, numbers, strict=True):
                if number < newest:
                    queue.popleft()
        return joined

    def _lead(self, one: Spots) -> float:
        """Return the arrival of an exposure, s, by the clock that counts the exposures."""
        return one.heard_s - one.exposure * self._period_s

    def _slipped(self, frame: list[Spots]) -> bool:
        self._block.append([self._lead(one) for one in frame])
        if len(self._block) < _BLOCK:
            return False
        self._earliest.append(np.min(self._block, axis=0))
        self._block.clear()
        leads = np.min(self._earliest, axis=0)
        moved = float(np.abs(leads - leads[0] - self._first_apart_s).max())
        return len(self._earliest) == _LATELY and moved > _SLIP * self._period_s
