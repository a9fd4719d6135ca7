"""Whether a ball that moves during its touch is refused, a still one accepted, and U honest.

    python -m benchmarks.stillness [--n N] [--rate HZ] [--seed SEED]
    python -m benchmarks.stillness --pixels STILL DRIFT SLIP [--seed SEED]

The first form: N touches that drift by 10 to 50 µm, N that slip by as much, N that do less than
10 µm of either, and N of a steady hand (`simulation.hand`). Each has its own place in the volume,
attitude and direction of motion, all at random; ten in turn share a world, which is drawn from the
covariance of its documents, and a session, which learns their noise. The hand trembles in all of
them. Frames come from the virtual rig, with its noise, through tracking and averaging to the point.

A motion of 10 µm cannot be detected in every direction: along the depth of a rig noise is too
great. So the shares are printed by size and by whether most of the motion was along the depth, and
accepted touches are compared with U: along each axis it must contain the place of the ball at the
start of a drift, and the one that it occupied longer, before or after a slip.

The second form: that many demonstration jobs (91 touches) with rendered cameras at 1 kHz, as
`ethercat:pixels` has them, all of whose touches rest, drift or slip by 10 to 50 µm. Every touch is
judged twice: with independent frames, and with the noise learnt from the session.
"""

from __future__ import annotations

import argparse
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise
from multiprocessing import get_context

import numpy as np

from benchmarks.steady_hand import steady_hand
from ocmm_core.blas import use_one_thread
from ocmm_core.camera import load_rig
from ocmm_core.composition import DEMO_PART, DEMO_PLAN, RECOMMENDED_RIG, STANDARD_PROBE
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, rotation_xyz
from ocmm_core.inspection.plan import load_plan
from ocmm_core.measuring import (
    PointOptions,
    Refusal,
    RefusalCode,
    TouchCollector,
    TouchNoise,
    average,
    systematic_covariance,
)
from ocmm_core.tracking import FrameStatus, TrackingPipeline, load_probe, tip_sensitivity
from ocmm_sim.scene import Motion, PixelFrames, VirtualRig, load_part

RIGS = (("recommended", "standard"), ("thesis", "thesis"))
"""Rig and probe."""

KINDS = ("still", "less", "drift", "slip")
LIMIT_MM, LARGEST_MM = 0.010, 0.050
SIZES_MM = (0.010, 0.012, 0.015, 0.020, 0.030, 0.050)
MOST_STILL_REFUSED, LEAST_MOVING_REFUSED, COVERED = 0.01, 0.99, (0.94, 0.98)
MOST_PIXELS_REFUSED = 0.003
PIXEL_RATE_HZ, _PIECE = 1000, 160
_IN_A_WORLD = 10
_TILT = np.radians([20.0, 20.0, 10.0])
_ALONG_DEPTH = 0.8


@dataclass(frozen=True, slots=True)
class Touch:
    """One touch.

    Attributes
    ----------
    rig, kind
        Of `RIGS` by name, of `KINDS`.
    size
        mm.
    depth
        Part of the motion along the depth (Y), 0 to 1.
    word
        Of the refusal; "" where the touch was accepted.
    ratio
        (3,): error along each axis over its standard uncertainty; NaN where refused.
    motion_u, u
        mm: standard uncertainty in the worst direction, by undetected motion and in all.
    milliseconds
        That `average` took.
    """

    rig: str
    kind: str
    size: float
    depth: float
    word: str
    ratio: Float
    motion_u: float
    u: float
    milliseconds: float


def touches_of_world(rig_name: str, probe: str, kind: str, rate: int, seed: int) -> list[Touch]:
    """Return ten touches of one kind in one world."""
    rig = load_rig(resource("rigs", f"{rig_name}.toml"))
    body = load_probe(resource("probes", f"{probe}.toml"))
    part = load_part(resource("parts", "demo.toml"))
    rng = np.random.default_rng([seed, KINDS.index(kind), len(rig_name)])
    world = VirtualRig(rig, body, part, [("BED", 1)], int(rng.integers(2**62)), None, rate)
    options, noise = PointOptions(), TouchNoise(rig, body)
    count = round(options.window_s * rate)
    times = np.arange(count) / rate
    found: list[Touch] = []
    first = 0
    while len(found) < _IN_A_WORLD:
        size, way, towards, truth = _motion(kind, times / times[-1], rng)
        sway, turn = steady_hand(times, rng)
        low, high = rig.volume_world
        place = rng.uniform(low, high)
        held = rotation_xyz(*rng.uniform(-_TILT, _TILT))
        motion = Motion(
            _small_turns(turn) @ held,
            place + sway + way[:, None] * size * towards,
            np.zeros(count, dtype=np.bool_),
            np.ones(count, dtype=np.bool_),
        )
        window = TrackingPipeline(rig, body).process(world.frames_of(motion, first))
        first += count
        if np.mean(window.status == FrameStatus.OK) < options.min_share:
            continue  # Not seen well enough there: another place.
        begin = time.process_time()
        point = average(window, count, rig, options, noise)
        taken = 1e3 * (time.process_time() - begin)
        if isinstance(point, Refusal):
            moving = point.code is RefusalCode.MOVING
            word = point.what.split()[2] if moving else point.code.value
            ratio, motion_u, u = np.full(3, np.nan), np.nan, np.nan
        else:
            word = ""
            sensitivity = tip_sensitivity(point.spots, rig, body)
            covariance = point.random_covariance + systematic_covariance([sensitivity], rig, body)
            error = point.tip_world - (place + truth * size * towards)
            ratio = error / np.sqrt(np.diag(covariance))
            motion_u = float(np.sqrt(np.linalg.eigvalsh(point.motion_covariance)[-1]))
            u = float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
        found.append(Touch(rig_name, kind, size, abs(towards[1]), word, ratio, motion_u, u, taken))
    return found


def _small_turns(vectors: Float) -> Float:
    """Return rotations (n, 3, 3) by vectors (n, 3), rad, of 1 mrad at most, to second order."""
    first = np.cross(vectors[:, None, :], np.eye(3)).transpose(0, 2, 1)
    turns: Float = np.eye(3) + first + 0.5 * first @ first
    return turns


def _motion(kind: str, x: Float, rng: np.random.Generator) -> tuple[float, Float, Float, float]:
    """Return size, course over the window, direction, and where on it the truth is, 0 to 1."""
    towards = rng.standard_normal(3)
    towards /= np.linalg.norm(towards)
    size = {
        "still": 0.0, "less": rng.uniform(0.0, LIMIT_MM),
        "drift": rng.uniform(LIMIT_MM, LARGEST_MM), "slip": rng.uniform(LIMIT_MM, LARGEST_MM),
    }[kind]  # fmt: skip
    if kind == "slip" or (kind == "less" and rng.random() < 0.5):
        moment = rng.uniform(0.02, 0.98)
        return size, (x > moment).astype(np.float64), towards, float(moment < 0.5)
    return size, x, towards, 0.0


def run(n: int, rate: int, seed: int) -> list[Touch]:
    """Return ``n`` touches of each kind, shared among the rigs, on all cores."""
    use_one_thread()
    worlds = -(-n // _IN_A_WORLD)
    jobs = [
        (*RIGS[index % len(RIGS)], kind, rate, seed + index)
        for kind in KINDS
        for index in range(worlds)
    ]
    found: list[Touch] = []
    # A forked child would inherit threads of numba and of the test runner half-way.
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        for touches in pool.map(touches_of_world, *zip(*jobs, strict=True), chunksize=4):
            found += touches
    return found


def refused(touches: list[Touch]) -> float:
    """Return the share that was refused."""
    return float(np.mean([bool(touch.word) for touch in touches])) if touches else np.nan


def covered(touches: list[Touch]) -> tuple[float, float]:
    """Return the share of accepted touches inside U (k = 2), all axes, and along the depth."""
    inside = np.abs([touch.ratio for touch in touches if not touch.word]) <= 2.0
    if not len(inside):
        return np.nan, np.nan
    return float(inside.mean()), float(inside[:, 1].mean())


class MovedRig(VirtualRig):
    """Virtual rig whose ball moves in the window of every touch."""

    kind = "still"

    def operator_motion(self, first: int, count: int) -> Motion:
        """Return the motion of the operator and of the ball."""
        motion = super().operator_motion(first, count)
        times = self._times(first, count)
        for index, touch in enumerate(self._operator.touches):
            # The button is pressed a tenth of a second after contact.
            share = (times - touch.contact_s - 0.1) / PointOptions().window_s
            if self.kind == "still" or share[-1] < 0.0 or times[0] > touch.retract_s:
                continue
            rng = np.random.default_rng([self.seed, index])
            towards = rng.standard_normal(3)
            towards *= rng.uniform(LIMIT_MM, LARGEST_MM) / np.linalg.norm(towards)
            course = np.clip(share, 0.0, 1.0)
            if self.kind == "slip":
                course = (share > rng.uniform(0.02, 0.98)).astype(np.float64)
            course[times > touch.retract_s] = 0.0
            motion = replace(motion, tip_world=motion.tip_world + course[:, None] * towards)
        return motion


def pixel_touches(kind: str, seed: int) -> list[tuple[bool, bool]]:
    """Return whether each touch of a job was refused, by independent and by learnt noise."""
    use_one_thread()
    rig, body, plan = load_rig(RECOMMENDED_RIG), load_probe(STANDARD_PROBE), load_plan(DEMO_PLAN)
    touches = [(feature.name, feature.points) for feature in plan.features]
    virtual = MovedRig(rig, body, load_part(DEMO_PART), touches, seed, frame_rate_hz=PIXEL_RATE_HZ)
    virtual.kind = kind
    frames, pipeline, options = PixelFrames(virtual), TrackingPipeline(rig, body), PointOptions()
    collector, noise = TouchCollector(1.0 / PIXEL_RATE_HZ, options), TouchNoise(rig, body)
    found = []
    for first in range(0, virtual.n_frames, _PIECE):
        count = min(_PIECE, virtual.n_frames - first)
        for touch in collector.push(pipeline.process(frames.frames(first, count))):
            before, after = (
                average(touch.window, touch.expected, rig, options, by) for by in (None, noise)
            )
            found.append((isinstance(before, Refusal), isinstance(after, Refusal)))
    return found


def report_pixels(jobs: list[int], seed: int) -> bool:
    """Print the shares of refused touches with rendered cameras; return whether still ones pass."""
    shares = {}
    for kind, many in zip(("still", "drift", "slip"), jobs, strict=True):
        found: list[tuple[bool, bool]] = []
        for number in range(many):
            found += pixel_touches(kind, seed + number)
            before, after = np.sum(found, axis=0)
            print(
                f"{kind:<6} {len(found):>5} touches refused: frames independent {before} "
                f"({100 * before / len(found):.2f} %), noise learnt {after} "
                f"({100 * after / len(found):.2f} %)",
                flush=True,
            )
            shares[kind] = after / len(found)
    return bool(shares.get("still", 0.0) <= MOST_PIXELS_REFUSED)


def report(touches: list[Touch]) -> bool:
    """Print the tables and return whether every limit is kept."""
    kept = []
    for rig, probe in RIGS:
        mine = [touch for touch in touches if touch.rig == rig]
        print(f"\n{rig} rig, {probe} probe")
        for kind in KINDS:
            of_kind = [touch for touch in mine if touch.kind == kind]
            words = sorted({touch.word for touch in of_kind if touch.word})
            count = {word: sum(t.word == word for t in of_kind) for word in words}
            inside, deep = covered(of_kind)
            accepted = [touch for touch in of_kind if not touch.word]
            motion = 1e3 * np.median([t.motion_u for t in accepted]) if accepted else np.nan
            in_all = 1e3 * np.median([t.u for t in accepted]) if accepted else np.nan
            print(
                f"  {kind:<6} refused {100 * refused(of_kind):6.2f} % of {len(of_kind)} {count}; "
                f"inside U {100 * inside:5.1f} %, along depth {100 * deep:5.1f} % of "
                f"{len(accepted)}; u {in_all:.1f} µm, of it motion {motion:.1f} µm"
            )
        for kind in ("drift", "slip"):
            for low, high in pairwise(SIZES_MM):
                some = [t for t in mine if t.kind == kind and low <= t.size < high]
                deep_ones = [t for t in some if t.depth > _ALONG_DEPTH]
                print(
                    f"    {kind} {1e3 * low:.0f} to {1e3 * high:.0f} µm: refused "
                    f"{100 * refused(some):6.2f} % of {len(some)}, along the depth "
                    f"{100 * refused(deep_ones):6.2f} % of {len(deep_ones)}"
                )
    print()
    moving = refused([t for t in touches if t.kind in ("drift", "slip")])
    still = refused([t for t in touches if t.kind == "still"])
    inside, _ = covered(touches)
    rows = (
        ("moving by 10 to 50 µm refused", moving, moving >= LEAST_MOVING_REFUSED, ">= 99 %"),
        ("steady hand refused", still, still <= MOST_STILL_REFUSED, "<= 1 %"),
        ("accepted inside U", inside, COVERED[0] <= inside <= COVERED[1], "94 to 98 %"),
    )
    for name, share, good, limit in rows:
        print(f"{name:<32}{100 * share:7.2f} %  wanted {limit:<11}{'' if good else 'MISSED'}")
        kept.append(good)
    times = [touch.milliseconds for touch in touches]
    print(f"average() took {np.median(times):.1f} ms, 99 %: {np.quantile(times, 0.99):.1f} ms")
    return all(kept)


def main() -> int:
    """Print how stillness is judged."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int, default=2000, help="touches of each kind")
    parser.add_argument("--rate", type=int, default=8000, help="frames a second")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--pixels", type=int, nargs=3, metavar=("STILL", "DRIFT", "SLIP"))
    options = parser.parse_args()
    if options.pixels:
        return 0 if report_pixels(options.pixels, options.seed) else 1
    print(f"{options.n} touches of each kind at {options.rate} Hz, seed {options.seed}")
    return 0 if report(run(options.n, options.rate, options.seed)) else 1


if __name__ == "__main__":
    sys.exit(main())
