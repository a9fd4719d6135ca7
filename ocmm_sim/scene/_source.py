"""The virtual rig as a frame source, paced or as fast as the reader, and as a script."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Protocol, TypeVar

import msgspec

from ocmm_core.acquisition.frames import Cycle, CycleVerdict, FrameBlock, SourceDescription
from ocmm_core.calibration.probe_design import leds_behind_body, load_design, shipped_design
from ocmm_core.camera import load_rig
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.tracking import load_probe, load_reference
from ocmm_sim.scene._artefacts import load_part
from ocmm_sim.scene._hand import rotation_vector
from ocmm_sim.scene._operator import Missing, Motion, Touches
from ocmm_sim.scene._rig import VirtualRig
from ocmm_sim.scene._world import WorldOptions

S = TypeVar("S", bound=msgspec.Struct)
"""Kinds of scripts."""


class RigScript(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Serialisable description of a `VirtualRig`, with the paths of its documents."""

    rig: str
    probe: str
    part: str
    touches: tuple[tuple[str, int], ...]
    seed: int
    options: WorldOptions = WorldOptions()
    frame_rate_hz: int = 0
    """`seed`, `options`, `frame_rate_hz`: as in `VirtualRig`; rate 0: as in the rig document."""
    reference: str = ""
    paths: dict[str, float] = {}
    scans: dict[str, str] = {}
    """As in `Operator`."""

    def to_json(self) -> str:
        return msgspec.json.encode(self).decode("utf-8")

    def build(self) -> VirtualRig:
        """Load the documents and return the rig."""
        body = load_probe(Path(self.probe))
        return VirtualRig(
            load_rig(Path(self.rig)),
            body,
            load_part(Path(self.part)),
            self.touches,
            self.seed,
            self.options,
            self.frame_rate_hz or None,
            load_reference(Path(self.reference)) if self.reference else None,
            _behind_body(self.probe, body.identity),
            self.paths,
            self.scans,
        )


@lru_cache(maxsize=8)
def _behind_body(probe: str, identity: str) -> tuple[int, ...]:
    """Return the LEDs hidden by the body of a probe, by its shipped design, if any.

    Tests half a million directions, so it is cached per probe document by its ``identity``.
    """
    body = load_probe(Path(probe))
    design = shipped_design(body)
    return () if design is None else leds_behind_body(body, load_design(design, body))


def decode_script(text: str | bytes, kind: type[S]) -> S:
    """Return the script in `text`; raise InputError if it is invalid."""
    try:
        return msgspec.json.decode(text, type=kind)
    except msgspec.DecodeError as error:
        raise InputError(
            "simulation.script",
            f"The script of the virtual rig cannot be read: {error}.",
            "Start the virtual rig again with the ocmm command.",
        ) from error


BLOCK_NS = 10_000_000
"""Frames of 10 ms per read."""

MOST_ROUNDS = 3
"""Maximum retries of missing touches by an unattended operator."""

SLOWEST = 0.1
"""Below this speed one read would take longer than a source may block."""


class LedHand(Protocol):
    """Holder of the probe instead of the scripted operator."""

    def pick_up(self, tip_world: Float, attitude: Float) -> None:
        """Take the probe: ball centre (3,), mm, and rotation vector (3,), rad."""
        ...

    def motion(self, times_s: Float) -> Motion:
        """Advance, and return the probe at the times (n,), s, of the next frames."""
        ...

    def place(self) -> tuple[Float, Float]:
        """Return ball centre and attitude in the form of `pick_up`."""
        ...


class SimulatedSource:
    """A `FrameSource` that reads a virtual rig.

    Not live: rig time waits for slow readers, and no frame is lost. ``speed`` is a multiple of real
    time; zero is as fast as frames are read. With ``hover`` the probe rests at home for ever after
    the script, at ``rest_speed`` if ``speed`` is zero, because an open window would keep a core
    busy.
    """

    def __init__(
        self, rig: VirtualRig, speed: float = 0.0, *, hover: bool = False, rest_speed: float = 0.0
    ) -> None:
        if speed != 0.0 and not SLOWEST <= speed <= 1000.0:
            raise InputError(
                "simulation.speed",
                f"The speed of the virtual rig is {speed:g}.",
                f"Give {SLOWEST:g} to 1000 times real time, or 0 for as fast as possible.",
            )
        self.ask: Callable[[], Missing] | None = None
        """Called at the end of the script for missing points, which are then touched at their
        original places. The reader must lag by half a second at most. None disables it."""
        self._asked = 0
        self._rig = rig
        self._speed = speed
        self._hover = hover
        self._rest_speed = speed or rest_speed
        self._block = max(1, BLOCK_NS // rig.frame_period_ns)
        self._next_frame = 0
        self._due_s = 0.0
        self._lock = threading.Lock()
        self._hand: LedHand | None = None

    @property
    def description(self) -> SourceDescription:
        rig = self._rig
        return SourceDescription(
            name=f"simulated ({rig.rig.name}, seed {rig.seed})",
            camera_serials=tuple(camera.serial for camera in rig.rig.cameras),
            frame_period_ns=rig.frame_period_ns,
            cycle_period_ns=self._block * rig.frame_period_ns,
            live=False,
            simulated=True,
            n_slots=rig.n_slots,
        )

    def open(self) -> None:
        """Start at the first frame; compiles the loops if necessary."""
        self._rig.frames(0, 1)
        self._next_frame = 0
        self._due_s = time.monotonic()

    def read(self) -> Cycle:
        """Return the next block; wait for its time if the source is paced."""
        led = self._read_led()
        if led is not None:
            self._pace(len(led), self._speed)
            return Cycle(CycleVerdict.GOOD, frames=led, finished=False)
        with self._lock:
            first = self._next_frame
            left = self._rig.n_frames - first
            if left <= self._block and self._ask_for_more(first):
                left = self._rig.n_frames - first
            count = self._block if self._hover else min(self._block, max(left, 0))
            self._next_frame = first + count
        frames = self._rig.frames(first, count) if count else None
        self._pace(count, self._speed if left > 0 else self._rest_speed)
        return Cycle(
            CycleVerdict.GOOD, frames=frames, finished=not self._hover and left <= self._block
        )

    def close(self) -> None:
        """Do nothing: the source holds no resources."""

    def extend(self, touches: Touches) -> None:
        """Append touches after the script or the blocks in progress; thread-safe."""
        with self._lock:
            self._rig.extend(touches, self._next_frame + self._block)

    def touch(self, surface_world: Float, normal_world: Float) -> None:
        """Append one touch at a place (3,), mm, with a normal (3,), unit; thread-safe."""
        with self._lock:
            self._rig.touch(surface_world, normal_world, self._next_frame + self._block)

    def interrupt(self) -> None:
        """Drop the touches that are not finished; thread-safe."""
        with self._lock:
            self._rig.interrupt(self._next_frame + self._block)

    def take_over(self, hand: LedHand) -> None:
        """Give the probe to a hand from the next frame, dropping pending touches; thread-safe."""
        with self._lock:
            now = self._rig.operator_motion(self._next_frame, 1)
            hand.pick_up(now.tip_world[0], rotation_vector(now.rotation_world_from_probe[0]))
            self._rig.interrupt(self._next_frame)
            self._hand = hand

    def hand_back(self) -> None:
        """Return the probe to the operator, who goes home and checks for missing points."""
        with self._lock:
            if self._hand is not None:
                self._rig.resume(*self._hand.place(), self._next_frame + self._block)
                self._hand = None

    def _read_led(self) -> FrameBlock | None:
        """Return the next block of the led hand, exchanged only between blocks, or None."""
        with self._lock:
            if self._hand is None:
                return None
            first = self._next_frame
            self._next_frame = first + self._block
            return self._rig.led_frames(self._hand.motion, first, self._block)

    def _ask_for_more(self, first: int) -> bool:
        if self.ask is None or (self._asked >= MOST_ROUNDS and not self._hover):
            return False
        missing = self.ask()
        touches = [(name, count) for name, count in missing.touches if count > 0]
        if not touches:
            return False
        self._asked += 1
        self._rig.complete(Missing(touches, missing.taken), first + self._block)
        return True

    def _pace(self, count: int, speed: float) -> None:
        if not speed:
            return
        self._due_s += count * self._rig.frame_period_ns * 1e-9 / speed
        wait = self._due_s - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)
        else:
            # A slow reader's delay is not caught up by a burst of frames.
            self._due_s -= wait
