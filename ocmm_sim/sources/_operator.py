"""Operator of a virtual rig for a station: intents, repeated touches, and a led hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ocmm_core.acquisition.frames import FrameRing
from ocmm_core.composition import Remaining
from ocmm_sim.bus import VirtualBus
from ocmm_sim.hand import HandAtRig
from ocmm_sim.scene import MOST_ROUNDS, REST_S, Missing, SimulatedSource, VirtualRig

_MARGIN_S = 0.25


@dataclass(frozen=True, slots=True)
class VirtualOperator:
    """The scripted operator in this process (`source`) or at the far end of a wire (`bus`)."""

    virtual: VirtualRig
    ring: FrameRing
    source: SimulatedSource | None = None
    bus: VirtualBus | None = None

    @property
    def features(self) -> frozenset[str]:
        """Return the features that the part has."""
        return frozenset(each.name for each in self.virtual.part.artefacts)

    def intent(self, frame: int) -> str | None:
        """Return the feature that is touched at an exposure."""
        margin = round(_MARGIN_S * 1e9 / self.virtual.frame_period_ns)
        for touch in reversed(self.virtual.truth.touches):
            if touch.first_frame - margin <= frame <= touch.last_frame:
                return touch.feature
        return None

    def follow(self, ask: Callable[[], Remaining], *, stay: bool) -> Callable[[int], None] | None:
        """Touch again what `ask` returns; a result is to be called with each frame counter."""
        if self.source is not None:
            self.source.ask = lambda: Missing(*ask())
        return self._over_the_wire(self.bus, ask, stay=stay) if self.bus is not None else None

    def hand(self) -> HandAtRig | None:
        """Return the probe for a user who holds it; None over a wire."""
        return HandAtRig(self.source, self.virtual) if self.source is not None else None

    def _over_the_wire(
        self, bus: VirtualBus, ask: Callable[[], Remaining], *, stay: bool
    ) -> Callable[[int], None]:
        second = round(1e9 / self.virtual.frame_period_ns)
        rest, rounds, due = round(REST_S * second), 0, 0

        def follow(frame: int) -> None:
            nonlocal rounds, due
            begin = max(due, self.virtual.n_frames - rest)
            if frame < begin or (rounds >= MOST_ROUNDS and not stay):
                return
            due = frame + second // 10
            missing = Missing(*ask())
            if missing.touches:
                rounds += 1
                # The cameras are ahead of the reader, and both rigs must contain the same script.
                after = frame + (self.ring.capacity - self.ring.free()) + second
                self.virtual.complete(missing, after)
                bus.touch_again(missing, after)

        return follow
