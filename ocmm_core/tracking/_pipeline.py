"""Tracking of frame blocks: the probe, and an optional reference body."""

from __future__ import annotations

from dataclasses import dataclass, field

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.camera import Rig
from ocmm_core.geometry import Int
from ocmm_core.tracking._body import ProbeBody
from ocmm_core.tracking._body_tracker import BodyTracker
from ocmm_core.tracking._body_tracker import TrackingOptions as TrackingOptions
from ocmm_core.tracking._reference import ReferenceTracker
from ocmm_core.tracking._reference_body import ReferenceBody
from ocmm_core.tracking._result import ReferenceHome, TrackBlock


@dataclass(slots=True)
class TrackingPipeline:
    """Track frames with one rig and one probe, independent of block boundaries; for one thread."""

    rig: Rig
    body: ProbeBody
    options: TrackingOptions = field(default_factory=TrackingOptions)
    reference: ReferenceBody | None = None
    """Reference body that positions are relative to, or None."""
    home: ReferenceHome | None = None
    """Its home; None to use its first good place."""
    _probe: BodyTracker = field(init=False)
    _reference: ReferenceTracker | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        self._probe = BodyTracker(self.rig, self.body.led_body, self.body.tip_probe, self.options)
        if self.reference is not None:
            self._reference = ReferenceTracker(self.rig, self.reference, self.options, self.home)

    @property
    def slot_of_led(self) -> Int | None:
        """Return the labels of the probe (C, L), None while it is not identified."""
        return self._probe.slot_of_led

    @property
    def reason(self) -> str:
        """Return why the probe is not identified, or empty text."""
        return self._probe.reason

    @property
    def reference_reason(self) -> str:
        """Return why the reference body is not usable yet, or empty text."""
        return self._reference.reason if self._reference is not None else ""

    @property
    def reference_motion(self) -> tuple[float, float] | None:
        """Return the motion of the reference body from home, mm and rad, or None."""
        return self._reference.motion if self._reference is not None else None

    def slot_leds(self) -> Int:
        """Return the probe's LED of each slot, (C, S), -1 if unknown."""
        return self._probe.slot_leds()

    def slot_references(self) -> Int | None:
        """Return the reference body's LED of each slot, or None without one."""
        return self._reference.tracker.slot_leds() if self._reference is not None else None

    def process(self, block: FrameBlock) -> TrackBlock:
        if self._reference is None:
            return self._probe.process(block)
        seen = self._reference.process(block)
        # The stationary reference body has priority on spots.
        probe = self._probe.process(self._reference.tracker.without_claimed(block))
        track = self._reference.relate(probe, seen, self._probe.without_claimed(block))
        self.home = self._reference.home
        return track
