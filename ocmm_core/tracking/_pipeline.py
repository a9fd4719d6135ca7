"""Blocks of frames in, tracked frames out: the probe, and a reference body where one is used."""

from __future__ import annotations

from dataclasses import dataclass, field

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.camera import Rig
from ocmm_core.geometry import Int
from ocmm_core.tracking._body import ProbeBody
from ocmm_core.tracking._body_tracker import BodyTracker, spot_sigma_px
from ocmm_core.tracking._body_tracker import TrackingOptions as TrackingOptions
from ocmm_core.tracking._reference import ReferenceTracker
from ocmm_core.tracking._reference_body import ReferenceBody
from ocmm_core.tracking._result import ReferenceHome, TrackBlock


@dataclass(slots=True)
class TrackingPipeline:
    """Track a stream of frames with one rig and one probe; used by one thread.

    Where the labels come into being does not depend on how the stream is cut into blocks.
    """

    rig: Rig
    body: ProbeBody
    options: TrackingOptions = field(default_factory=TrackingOptions)
    """`rig`, `body`, `options`: What to track with."""
    reference: ReferenceBody | None = None
    """Reference body to which everything is given; None where none is used."""
    home: ReferenceHome | None = None
    """Where it stood when the job began; None to take its first good place."""
    _probe: BodyTracker = field(init=False)
    _reference: ReferenceTracker | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        self._probe = BodyTracker(self.rig, self.body.led_body, self.body.tip_probe, self.options)
        if self.reference is not None:
            self._reference = ReferenceTracker(self.rig, self.reference, self.options, self.home)

    @property
    def sigma_px(self) -> float:
        """Return the standard deviation of one spot of one frame, px."""
        return spot_sigma_px(self.rig)

    @property
    def slot_of_led(self) -> Int | None:
        """Return the labels of the probe (C, L), None while it is not identified."""
        return self._probe.slot_of_led

    @property
    def reason(self) -> str:
        """Return why the probe is not identified, in words; empty otherwise."""
        return self._probe.reason

    @property
    def reference_reason(self) -> str:
        """Return why the reference body is of no use yet, in words; empty otherwise."""
        return self._reference.reason if self._reference is not None else ""

    @property
    def reference_motion(self) -> tuple[float, float] | None:
        """Return how far the reference body is from home, mm and rad; None if not known."""
        return self._reference.motion if self._reference is not None else None

    def slot_leds(self) -> Int:
        """Return the LED of the probe that each slot follows, (C, S), -1 where unknown."""
        return self._probe.slot_leds()

    def slot_references(self) -> Int | None:
        """Return the LED of the reference body that each slot follows, or None without one."""
        return self._reference.tracker.slot_leds() if self._reference is not None else None

    def process(self, block: FrameBlock) -> TrackBlock:
        """Return what the frames of ``block`` say."""
        if self._reference is None:
            return self._probe.process(block)
        seen = self._reference.process(block)
        # The reference body stands still and is known longest: its spots are its own.
        probe = self._probe.process(self._reference.tracker.without_claimed(block))
        track = self._reference.relate(probe, seen, self._probe.without_claimed(block))
        self.home = self._reference.home
        return track
