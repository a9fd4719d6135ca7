"""Whether a wrong tip is ever accepted: labels of random poses, hidden LEDs, reflections.

Every shipped probe is held in a million random poses before rigs of two to four cameras, with LEDs
hidden and reflections seen; the search for labels looks at each frame by itself. A tip is wrong if
its error leaves seven standard deviations that are stated for it. Then: the search for probe and
reference body in one frame; whole mirror images; layouts with labels that can be confused; and
poses of flat bodies, of which a fit that knows no reflection must never give one.

Run: ``python -m benchmarks.labels [--poses N] [--processes N]``.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from benchmarks.label_layouts import ambiguous_layout
from benchmarks.label_scenes import (
    Scenes,
    draw_rotations,
    draw_scenes,
    mirrored,
    rig_with,
    together,
)
from ocmm_core.camera import Rig, load_rig, project
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking import (
    IdentifyOptions,
    LedBody,
    ProbeBody,
    check_labels,
    identify_many,
    load_probe,
    load_reference,
    solve,
    solve_leds,
    spot_sigma_px,
)
from ocmm_core.tracking.kernels import FOUND

CHUNK = 10_000
RIGS = (("thesis", 2), ("recommended", 2), ("recommended", 3), ("recommended", 4))
WRONG = 49.0
"""Squared error over its covariance; noise alone exceeds it once in eight billion frames."""


@dataclass(frozen=True, slots=True)
class Counts:
    """What became of frames.

    Attributes
    ----------
    frames
        That were searched.
    enough
        Of them, four LEDs or more are seen by two cameras.
    accepted
        Frames with a tip.
    misnamed
        Of them, a reflection or another LED is taken for an LED, mostly beside a hidden one.
    wrong
        Of them, the tip is wrong.
    seconds
        Processor time of the search.
    """

    frames: int = 0
    enough: int = 0
    accepted: int = 0
    misnamed: int = 0
    wrong: int = 0
    seconds: float = 0.0

    def __add__(self, other: Counts) -> Counts:
        return Counts(
            *(getattr(self, name) + getattr(other, name) for name in Counts.__dataclass_fields__)
        )


def shipped_rig(name: str, n_cameras: int) -> Rig:
    """Return a shipped rig with two to four cameras."""
    return rig_with(load_rig(resource("rigs", f"{name}.toml")), n_cameras)


def search(
    rig: Rig, bodies: Sequence[LedBody], point: Float, scenes: Scenes, index: int = 0
) -> Counts:
    """Return the labels found in scenes of ``bodies[index]``, with its tip at ``point``."""
    body, sigma = bodies[index], spot_sigma_px(rig)
    began = time.process_time()
    status, labels = identify_many(rig, bodies, scenes.spots, IdentifyOptions(sigma))
    seconds = time.process_time() - began
    found = status[:, index] == FOUND
    slots: Int = labels[found, index, :, : body.n_leds]
    uv = np.take_along_axis(scenes.spots[found], np.maximum(slots, 0)[..., None], axis=2)
    uv[slots < 0] = np.nan
    pose = solve_leds(uv, rig, body.leds_body, point, sigma)
    good = pose.status == 0
    truth = scenes.rotations[found] @ point + scenes.origins[found]
    error = (pose.tip_world - truth)[good]
    square = np.einsum("ni,nij,nj->n", error, np.linalg.inv(pose.tip_covariance[good]), error)
    named = slots[good]
    false = (named >= 0) & (named != scenes.slots[found][good])
    located = np.count_nonzero(np.count_nonzero(scenes.slots >= 0, axis=1) >= 2, axis=1)
    return Counts(
        frames=len(scenes.spots),
        enough=int(np.count_nonzero(located >= 4)),
        accepted=int(np.count_nonzero(good)),
        misnamed=int(np.count_nonzero(false.any(axis=(1, 2)))),
        wrong=int(np.count_nonzero(square > WRONG)),
        seconds=seconds,
    )


def random_poses(probe: Path, rig: tuple[str, int], frames: int, seed: int) -> Counts:
    """Return the counts of random poses of a probe with hidden LEDs and reflections."""
    cameras, body = shipped_rig(*rig), load_probe(probe)
    rng = np.random.default_rng([1, rig[1], seed])
    scenes = draw_scenes(rng, cameras, body.led_body, frames, sigma_px=spot_sigma_px(cameras))
    return search(cameras, [body.led_body], body.tip_probe, scenes)


def two_bodies(probe: Path, reference: Path, frames: int, seed: int) -> Counts:
    """Return the counts of both bodies in the same frames."""
    rig, body = shipped_rig("recommended", 2), load_probe(probe)
    beside = load_reference(reference).leds
    rng = np.random.default_rng([2, seed])
    both = together(rng, rig, (body.led_body, beside), frames, sigma_px=spot_sigma_px(rig))
    bodies = [body.led_body, beside]
    points = [body.tip_probe, beside.leds_body.mean(axis=0)]
    parts = [search(rig, bodies, points[i], both[i], i) for i in range(2)]
    return parts[0] + parts[1]


def mirror_images(probe: Path, frames: int, seed: int) -> Counts:
    """Return the counts of frames in which only the whole mirror image of a probe is seen."""
    rig, body = shipped_rig("recommended", 2), load_probe(probe)
    rng = np.random.default_rng([3, seed])
    scenes = draw_scenes(
        rng, rig, mirrored(body.led_body), frames, sigma_px=spot_sigma_px(rig),
        hidden=False, ghosts=False,
    )  # fmt: skip
    return search(rig, [body.led_body], body.tip_probe, scenes)


def reflections(frames: int, seed: int) -> int:
    """Return the number of random poses of a flat body found with the wrong side in front."""
    rig, body = shipped_rig("recommended", 2), load_probe(resource("probes", "thesis.toml"))
    rng = np.random.default_rng([4, seed])
    rotations = draw_rotations(rng, frames, (60.0, 60.0, 60.0))
    origins = rng.uniform(rig.volume_world[0], rig.volume_world[1], (frames, 3))
    # A new flat body for every hundred poses: four LEDs in the plane of the handle.
    wrong = 0
    for part in np.array_split(np.arange(frames), max(1, frames // 100)):
        leds = rng.uniform([-60.0, 0.0, 100.0], [60.0, 0.0, 240.0], (4, 3))
        places = np.einsum("nij,lj->nli", rotations[part], leds) + origins[part, None]
        uv = np.stack([project(camera, places) for camera in rig.cameras], axis=1)
        uv += spot_sigma_px(rig) * rng.standard_normal(uv.shape)
        pose = solve(uv, rig, replace(body, leds_probe=leds), spot_sigma_px(rig))
        good = pose.status == 0
        found = pose.rotation_world_from_probe[good]
        aligned = np.einsum("nji,nji->n", found, rotations[part][good])
        # The trace of the turn between them is 3 if they agree, and -1 for half a turn.
        wrong += int(np.count_nonzero((np.linalg.det(found) < 0.0) | (aligned < 2.0)))
    return wrong


def layouts_taken(count: int, seed: int) -> int:
    """Return the number of ``count`` ambiguous layouts that are not refused."""
    rng = np.random.default_rng([5, seed])
    like = load_probe(resource("probes", "standard.toml"))
    return sum(not _refused(like, ambiguous_layout(rng)) for _ in range(count))


def main() -> int:
    """Print everything; return 1 if a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=1_000_000, help="of each probe (1000000)")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    options = parser.parse_args()
    poses = max(CHUNK * len(RIGS), options.poses)
    probes = sorted(resource("probes").glob("*.toml"))
    plate = resource("references", "plate.toml")
    holds = True
    print(f"{'':38}{'frames':>9}{'4 LEDs':>9}{'tip':>9}{'misnamed':>9}{'wrong':>6}{'frames/s':>10}")
    with ProcessPoolExecutor(options.processes, mp_context=get_context("spawn")) as pool:

        def run(title: str, work: Callable[[int, int], Counts], frames: int) -> Counts:
            sizes = [CHUNK] * (frames // CHUNK)
            total = sum(pool.map(work, sizes, range(len(sizes))), Counts())
            speed = total.frames / max(total.seconds, 1e-9)
            print(
                f"{title:38}{total.frames:9}{total.enough:9}{total.accepted:9}{total.misnamed:9}"
                f"{total.wrong:6}{speed:10.0f}",
                flush=True,
            )
            return total

        for probe in probes:
            for rig in RIGS:
                title = f"{probe.stem}, {rig[0]} rig, {rig[1]} cameras"
                found = run(title, partial(random_poses, probe, rig), poses // len(RIGS))
                holds &= found.wrong == 0 and found.accepted > 0
        pair = resource("probes", "standard4.toml")
        found = run("standard4 beside plate, both", partial(two_bodies, pair, plate), poses // 4)
        holds &= found.wrong == 0 and found.accepted > 0
        for probe in _solid(probes):
            found = run(f"{probe.stem}, mirror image", partial(mirror_images, probe), poses // 10)
            holds &= found.accepted == 0
        chunks = range(poses // CHUNK)
        turned = sum(pool.map(partial(reflections, CHUNK), chunks))
        print(f"flat bodies: {turned} reflections in {len(chunks) * CHUNK} poses")
        parts = range(options.processes * 4)
        count = max(1, poses // 200 // len(parts))
        taken = sum(pool.map(partial(layouts_taken, count), parts))
        print(f"ambiguous layouts: {taken} of {count * len(parts)} not refused")
    holds &= turned == 0 and taken == 0
    print("ok" if holds else "BROKEN")
    return 0 if holds else 1


def _solid(probes: Sequence[Path]) -> Iterator[Path]:
    """Give the probes that are not flat: a symmetric flat one is its own mirror image."""
    for probe in probes:
        leds = load_probe(probe).leds_probe
        if np.linalg.svd(leds - leds.mean(axis=0))[1][-1] > 1.0:
            yield probe


def _refused(like: ProbeBody, leds: Float) -> bool:
    directions = np.tile([0.0, -1.0, 0.0], (len(leds), 1))
    body = replace(like, leds_probe=leds, led_directions_probe=directions)
    try:
        check_labels("drawn layout", "probe", body)
    except InputError:
        return True
    return False


if __name__ == "__main__":
    sys.exit(main())
