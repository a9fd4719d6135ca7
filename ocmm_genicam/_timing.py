"""Proof that the clocks of the cameras agree (IEEE 1588, PTP).

A frame joins exposures whose times differ by `MOST_SKEW_NS` at most. Those times prove something
only while every camera is bound to the same grandmaster with a small offset.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

from ocmm_core.errors import AcquisitionError
from ocmm_genicam._client import Camera
from ocmm_genicam._set_up import ptp_names

MOST_SKEW_NS = 10_000
_MOST_OFFSET_NS = 1_000
SKEW_BOUND_NS = MOST_SKEW_NS + 2 * _MOST_OFFSET_NS
"""Largest difference of the true exposure times in a frame: stamps and offsets of two clocks."""
_TICKS_PER_S = 1_000_000_000
_AGAIN_S = 0.1
_BOUND = ("Slave", "Master")
_REMEDY = (
    "Connect all cameras to one switch with one PTP master, wait until every camera reports "
    "'Slave', then open the job again."
)


@dataclass(frozen=True, slots=True)
class ClockState:
    """PTP state of one camera."""

    serial: str
    status: str
    offset_ns: int
    grandmaster: int

    @property
    def is_bound(self) -> bool:
        return self.status in _BOUND and abs(self.offset_ns) <= _MOST_OFFSET_NS


class CameraClock:
    """The clock of one camera; enables PTP. AcquisitionError if it cannot be proven."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        names = ptp_names(camera)
        missing = [
            one
            for one in (names.status, names.offset, names.grandmaster)
            if not camera.has(one)
        ] if names is not None else ["PtpEnable"]  # fmt: skip
        if names is None or missing:
            raise AcquisitionError(
                "genicam.no_ptp",
                f"Camera {camera.serial} has no feature {', '.join(missing)}: when it exposes "
                "cannot be proven.",
                "Use cameras with PTP (IEEE 1588).",
            )
        self._names = names
        camera.set_text(names.enable, names.on)
        ticks = camera.tick_frequency()
        if ticks != _TICKS_PER_S:
            raise AcquisitionError(
                "genicam.ticks",
                f"The clock of camera {camera.serial} reports {ticks} ticks a second, but with "
                f"PTP it must be {_TICKS_PER_S}.",
                "Update the firmware of the camera.",
            )

    def state(self) -> ClockState:
        """Read the state."""
        camera, names = self._camera, self._names
        if names.latch and camera.has(names.latch):
            camera.execute(names.latch)
        return ClockState(
            camera.serial,
            camera.text(names.status),
            camera.integer(names.offset),
            camera.integer(names.grandmaster),
        )


def require_bound(states: Sequence[ClockState]) -> None:
    """Raise AcquisitionError unless all clocks are bound to one grandmaster."""
    for one in states:
        if not one.is_bound:
            raise AcquisitionError(
                "genicam.ptp",
                f"The clock of camera {one.serial} is not bound to the others: PTP state "
                f"'{one.status}', offset {one.offset_ns} ns.",
                _REMEDY,
            )
    if (
        len({one.grandmaster for one in states}) > 1
        or [one.status for one in states].count("Master") > 1
    ):
        raise AcquisitionError(
            "genicam.grandmasters", "The cameras follow different PTP masters.", _REMEDY
        )


def wait_until_bound(clocks: Sequence[CameraClock], wait_s: float) -> None:
    """Wait until the clocks are bound; AcquisitionError after ``wait_s``."""
    deadline = time.monotonic() + wait_s
    while True:
        try:
            require_bound([one.state() for one in clocks])
        except AcquisitionError:
            if time.monotonic() > deadline:
                raise
            time.sleep(_AGAIN_S)
        else:
            return
