"""What a reference body costs in accuracy, and what it saves when cameras or table move.

Each world draws true cameras, probe, reference body and sensor patterns from what the documents say
of their errors. The reference body takes its first place (250 ms of frames); then part, reference
body and probe are carried against the cameras by a nudge, and the probe rests at places of the part
for 250 ms. Printed for each nudge: the error of the ball against the truth in the world of the job,
what the product states for it, how often the truth lies inside k = 2, and the same without a
reference body. "Between points" is the error of distances of about 200 mm between two of them,
which is what features are made of.

Then the noise of single frames, and how far the live position lags behind a table that drifts.
Run: ``python benchmarks/reference.py [--worlds 200] [--probe standard4]``.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass

from ocmm_core.blas import use_one_thread

use_one_thread()

import numpy as np  # noqa: E402 - the number of BLAS threads is set before numpy is loaded

from ocmm_core.acquisition.frames import from_records, to_records  # noqa: E402 - as above
from ocmm_core.camera import Rig, load_rig  # noqa: E402 - as above
from ocmm_core.documents import resource  # noqa: E402 - as above
from ocmm_core.geometry import Float, rotation_from_vector  # noqa: E402 - as above
from ocmm_core.measuring import systematic_covariance  # noqa: E402 - as above
from ocmm_core.tracking import (  # noqa: E402 - as above  # noqa: E402 - as above  # noqa: E402 - as above  # noqa: E402 - as above  # noqa: E402 - as above
    FrameStatus,
    ProbeBody,
    ReferenceBody,
    TipSensitivity,
    TrackingPipeline,
    home_of,
    in_rig,
    join,
    load_probe,
    load_reference,
    ordered_spots,
    relative_sensitivity,
    simultaneous,
    tip_sensitivity,
)
from ocmm_sim.scene import Motion, Part, ScriptedNudge, VirtualRig, WorldOptions, load_part, nudged  # noqa: E402 - as above  # noqa: E402 - as above

FRAMES = 2000
"""A quarter of a second at 8 kHz."""
PLACES = 6
PLACE = np.array([50.0, -20.0, -40.0])
NUDGES = {
    "at rest": ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "1 mm and 1 mrad": ((0.58e-3, -0.58e-3, 0.58e-3), (0.58, 0.58, -0.58)),
    "30 mm and 30 mrad": ((17e-3, 17e-3, -17e-3), (17.0, -17.0, 17.0)),
}
LEAST_SHARE, MOST_SHARE = 0.93, 0.98
MOST_COST = 3.0
"""Times the error of a point at rest, against the cameras alone, that a small nudge may cost."""


@dataclass(frozen=True, slots=True)
class Bench:
    """The simulation."""

    rig: Rig
    body: ProbeBody
    reference: ReferenceBody
    part: Part

    @classmethod
    def of(cls, probe: str) -> Bench:
        """Return the bench with one of the shipped probes."""
        return cls(
            load_rig(resource("rigs", "recommended.toml")),
            load_probe(resource("probes", f"{probe}.toml")),
            load_reference(resource("references", "plate.toml")),
            load_part(resource("parts", "demo.toml")),
        )

    def world(self, seed: int, *nudges: ScriptedNudge) -> VirtualRig:
        """Return a virtual rig with a probe that rests; nudges are carried out as they come."""
        return VirtualRig(
            self.rig, self.body, self.part, [], seed, WorldOptions(nudges=nudges),
            reference=self.reference,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Places:
    """Errors at the places of one world and what is stated, with and without a reference body.

    Attributes
    ----------
    error, covariance
        (3 P,) and (3 P, 3 P), mm, mm^2: relative to the reference body.
    plain
        (3 P,), mm: errors without one.
    """

    error: Float
    covariance: Float
    plain: Float


def measure(bench: Bench, seed: int, nudge: ScriptedNudge) -> Places:
    """Return errors of points taken after a nudge, in one world."""
    world = bench.world(seed, nudge)
    rng = np.random.default_rng([seed, 77])
    truth = world.truth
    at_home = world.frames_of(resting(world, np.zeros(3), np.zeros(3), 0), 0)
    spots = ordered_spots(at_home.uv, truth.reference_slots).mean(axis=0)
    home = home_of(spots, FRAMES, bench.rig, bench.reference)
    items: list[TipSensitivity] = []
    errors, plain, noise = [], [], []
    low, high = 0.6 * bench.rig.volume_world
    for number in range(PLACES):
        first = nudge.first_frame + number * FRAMES
        tip = rng.uniform(low, high)
        motion = resting(world, tip, rng.uniform(-0.2, 0.2, 3), first)
        frames = world.frames_of(motion, first)
        probe = ordered_spots(frames.uv, truth.slots).mean(axis=0)
        beside = ordered_spots(frames.uv, truth.reference_slots).mean(axis=0)
        item = relative_sensitivity(probe, beside, home, bench.rig, bench.body, bench.reference)
        items.append(item)
        errors.append(item.tip_world - tip)
        plain.append(tip_sensitivity(probe, bench.rig, bench.body).tip_world - tip)
        # The home is the same for all points: its noise is in the joint covariance.
        own = item.by_spots[:, : -np.count_nonzero(np.isfinite(spots[..., 0]))].reshape(3, -1)
        noise.append(bench.rig.noise.white_px**2 / FRAMES * own @ own.T)
    covariance = systematic_covariance(items, bench.rig, bench.body)
    for number, block in enumerate(noise):
        part = slice(3 * number, 3 * number + 3)
        covariance[part, part] += block
    return Places(np.concatenate(errors), covariance, np.concatenate(plain))


def resting(world: VirtualRig, tip: Float, turn: Float, first: int) -> Motion:
    """Return a probe that rests at a place of the part, carried by the nudges of the world."""
    carried, shift = nudged(world.options.nudges, np.arange(first, first + FRAMES))
    rest = np.zeros(FRAMES, dtype=np.bool_)
    return Motion(carried @ rotation_from_vector(turn), carried @ tip + shift, rest, rest)


def distances(values: Float) -> Float:
    """Return the differences of neighbouring places, mm, from (3 P,)."""
    return np.diff(values.reshape(-1, 3), axis=0).ravel()


def share_inside(found: list[Places]) -> float:
    """Return how often the truth lies inside k = 2, over all coordinates."""
    inside = [np.abs(item.error) <= 2.0 * np.sqrt(np.diag(item.covariance)) for item in found]
    return float(np.mean(inside))


def share_inside_between(found: list[Places]) -> float:
    """Return the same for the differences of neighbouring places."""
    inside = []
    for item in found:
        step = np.eye(len(item.error))[3:] - np.eye(len(item.error))[:-3]
        sigma = np.sqrt(np.diag(step @ item.covariance @ step.T))
        inside.append(np.abs(step @ item.error) <= 2.0 * sigma)
    return float(np.mean(inside))


def report(bench: Bench, worlds: int) -> bool:
    """Print accuracy with and without a reference body; return whether the claims hold."""
    print(f"probe {bench.body.name}, reference body {bench.reference.name}, {worlds} worlds")
    print(
        f"{'um, root mean square':22} {'point':>7} {'stated':>7} {'k=2':>6} {'between':>8} "
        f"{'k=2':>6} {'without':>9} {'between':>8}"
    )
    holds, alone = True, 0.0
    for name, (turn, shift) in NUDGES.items():
        nudge = ScriptedNudge(FRAMES, 0, turn, shift)
        found = [measure(bench, seed, nudge) for seed in range(worlds)]
        error = _rms([item.error for item in found])
        stated = float(np.sqrt(np.mean([np.mean(np.diag(item.covariance)) for item in found])))
        between = _rms([distances(item.error) for item in found])
        plain = _rms([item.plain for item in found])
        plain_between = _rms([distances(item.plain) for item in found])
        inside, inside_between = share_inside(found), share_inside_between(found)
        print(
            f"{name:22} {1e3 * error:7.1f} {1e3 * stated:7.1f} {100 * inside:5.1f}% "
            f"{1e3 * between:8.1f} {100 * inside_between:5.1f}% {1e3 * plain:9.1f} "
            f"{1e3 * plain_between:8.1f}"
        )
        alone = alone or plain
        small = name != "30 mm and 30 mrad"
        holds &= all(LEAST_SHARE <= share <= MOST_SHARE for share in (inside, inside_between))
        holds &= not small or error <= MOST_COST * alone
    return holds


def report_frames(bench: Bench) -> None:
    """Print the noise of single frames and the lag of the live position behind a drift."""
    for speed in (0.0, 0.1, 1.0, 10.0):
        nudge = ScriptedNudge(3 * FRAMES, 8 * FRAMES, (0.0, 0.0, 0.0), (speed * 2.0 / 1.875, 0, 0))
        world = bench.world(0, nudge)
        pipeline = TrackingPipeline(bench.rig, bench.body, reference=bench.reference)
        pieces = []
        for first in range(0, 12 * FRAMES, FRAMES):
            motion = resting(world, PLACE, np.zeros(3), first)
            pieces.append(pipeline.process(world.frames_of(motion, first)))
        track = join(pieces)
        good = track.status == FrameStatus.OK
        good[: 3 * FRAMES] = False
        error = track.tip_world - PLACE
        # Half a second of the mean takes the noise away; what stays is bias and lag.
        smooth = np.array([part.mean(axis=0) for part in np.array_split(error[good], 90)])
        lag = float(np.abs(smooth[:, 0] - np.median(smooth[:5, 0])).max())
        if speed == 0.0:
            kinds = {"cameras alone": in_rig(track), "this frame's reference pose": None}
            kinds["averaged reference pose"] = track
            for name, block in kinds.items():
                tips = (block or simultaneous(track)).tip_world[good]
                print(f"noise of one frame, {name}: {1e3 * float(tips.std(axis=0).max()):.1f} um")
        else:
            print(f"table drifts at up to {speed:g} mm/s: live position lags {1e3 * lag:.1f} um")


def report_cost(bench: Bench) -> None:
    """Print what following a reference body costs beside following the probe."""
    world = bench.world(0)
    for reference in (None, bench.reference):
        pipeline = TrackingPipeline(bench.rig, bench.body, reference=reference)
        times = []
        for first in range(0, 6 * FRAMES, FRAMES):
            records = to_records(world.frames_of(resting(world, PLACE, np.zeros(3), first), first))
            blocks = [from_records(records[start : start + 80]) for start in range(0, FRAMES, 80)]
            begin = time.thread_time()
            for block in blocks:
                pipeline.process(block)
            times.append((time.thread_time() - begin) / FRAMES)
        name = "with" if reference is not None else "without"
        print(f"tracking {name} reference body: {1e6 * min(times[2:]):.1f} us per frame")


def _rms(values: list[Float]) -> float:
    return float(np.sqrt(np.mean(np.square(np.concatenate(values)))))


def main() -> int:
    """Run the benchmark; 1 where a claim does not hold."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, default=200)
    parser.add_argument("--probe", default="standard4")
    given = parser.parse_args()
    bench = Bench.of(given.probe)
    start = time.monotonic()
    holds = report(bench, given.worlds)
    report_frames(bench)
    report_cost(bench)
    print(f"took {time.monotonic() - start:.0f} s")
    return int(not holds)


if __name__ == "__main__":
    sys.exit(main())
