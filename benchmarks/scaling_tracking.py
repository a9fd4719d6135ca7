"""How the time of tip and tracking grows with cameras and LEDs, as exponents.

The time of a call is fitted by ``t = a n^p`` over the sizes; p is printed with the time a frame at
either end. Times are processor times of this thread, the least of several. A hot path that is
linear in its spots has p of at most one; below, something constant still counts.
Run: ``python -m benchmarks.scaling_tracking``.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.label_scenes import rig_with
from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.camera import MAX_CAMERAS, MAX_LEDS, USUAL_SLOTS, Rig, load_rig, project
from ocmm_core.documents import resource
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody, TrackingPipeline, load_probe, solve

FRAMES = 80
MOST = 1.15
"""Linear, and what timing adds on a machine with other work."""


def rig_of(n_cameras: int) -> Rig:
    """Return cameras like those of the thesis, all turned to the middle."""
    return rig_with(load_rig(resource("rigs", "thesis.toml")), n_cameras)


def body_of(n_leds: int) -> ProbeBody:
    """Return the standard probe with LEDs at places of no order."""
    body = load_probe(resource("probes", "standard.toml"))
    rng = np.random.default_rng(3)
    leds = rng.uniform([-40.0, -30.0, 90.0], [40.0, 30.0, 250.0], (64, 3))[:n_leds]
    return replace(
        body,
        leds_probe=leds,
        led_directions_probe=np.tile([0.0, -1.0, 0.0], (n_leds, 1)),
        emission_half_angle=float(np.pi),
        geometry_covariance=np.zeros((3 * n_leds + 3,) * 2),
        rules=(),
    )


def spots_of(rig: Rig, body: ProbeBody) -> Float:
    """Return spots (n, C, L, 2), px, of a probe that is held still."""
    rng = np.random.default_rng(4)
    once = np.stack([project(camera, body.leds_probe) for camera in rig.cameras])
    return once + rig.noise.white_px * rng.standard_normal((FRAMES, *once.shape))


def tip_call(rig: Rig, body: ProbeBody) -> Callable[[], object]:
    """Return the tip of a batch of labelled frames."""
    uv = spots_of(rig, body)
    return lambda: solve(uv, rig, body, rig.noise.white_px)


def tracking_call(rig: Rig, body: ProbeBody) -> Callable[[], object]:
    """Return the tracking of a block of frames with given labels."""
    uv = np.full((FRAMES, len(rig.cameras), max(USUAL_SLOTS, body.n_leds), 2), np.nan)
    uv[:, :, : body.n_leds] = spots_of(rig, body)
    pipeline = TrackingPipeline(rig, body)
    count = 0

    def track() -> object:
        nonlocal count
        counter = np.arange(count, count + FRAMES, dtype=np.int64)
        count += FRAMES
        return pipeline.process(
            FrameBlock(
                counter=counter,
                time_ns=counter * 125_000,
                flags=np.zeros(FRAMES, dtype=np.uint32),
                valid=np.full((FRAMES, len(rig.cameras)), 0xFF, dtype=np.uint64),
                uv=uv,
            )
        )

    track()
    if pipeline.slot_of_led is None:
        raise SystemExit(f"The body is not identified: {pipeline.reason}.")
    return track


def seconds_of(work: Callable[[], object]) -> float:
    """Return the least processor time of a call."""
    work()
    best = np.inf
    for _ in range(15):
        began = time.thread_time()
        for _ in range(10):
            work()
        best = min(best, (time.thread_time() - began) / 10)
    return float(best)


def row(what: str, sizes: Sequence[int], make: Callable[[int], Callable[[], object]]) -> bool:
    """Print one line; return whether it grows no faster than its spots."""
    times = [seconds_of(make(size)) for size in sizes]
    exponent = float(np.polyfit(np.log(sizes), np.log(times), 1)[0])
    ends = [f"{size}: {1e6 * t / FRAMES:.2f} us" for size, t in zip(sizes, times, strict=True)]
    good = exponent <= MOST
    print(
        f"{what:28s} p = {exponent:5.2f}   {', '.join(ends)} a frame  {'ok' if good else 'BROKEN'}"
    )
    return good


def main() -> int:
    """Print all rows; return 0 if nothing grows faster than its spots."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    eight = MAX_LEDS
    good = [
        row("tip, cameras (8 LEDs)", (2, 4, 8, 16), lambda n: tip_call(rig_of(n), body_of(8))),
        row("tip, LEDs (2 cameras)", (4, 8, 16, 32, 64), lambda n: tip_call(rig_of(2), body_of(n))),
        row(
            "tracking, cameras (6 LEDs)",
            tuple(n for n in (2, 3, 4, 8, 16) if n <= MAX_CAMERAS),
            lambda n: tracking_call(rig_of(n), body_of(6)),
        ),
        row(
            "tracking, LEDs (2 cameras)",
            tuple(n for n in (4, 6, 8, 16, 32, 64) if n <= eight),
            lambda n: tracking_call(rig_of(2), body_of(n)),
        ),
    ]
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
