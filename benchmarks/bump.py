"""How well a pushed camera is noticed: random pushes of all six axes, and hours without any.

Each world (true cameras, probe, sensor patterns) lets the monitor learn its sensors from a minute
of waving; then one camera is pushed while the operator touches the demonstration part. A push turns
the camera by normal numbers of microradians about its three axes and shifts it by as many
micrometres along them, scaled so that the ball is wrong by 30 um (RMS over the measuring volume).
It is noticed if an examination calls it within 2 s of frames in which the probe was tracked. The
clean hours are the same work without a push, in other worlds, every examination counted.

Simulated at 400 frames a second; each frame stands for the mean of 20 exposures and has their white
noise. Pattern (0.010 px, 20 px), calibration and probe errors are as the rig's documents say.
Run: ``python benchmarks/bump.py [--rig thesis] [--runs 1000] [--hours 8]``.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, replace

from ocmm_core.blas import use_one_thread

use_one_thread()

import numpy as np  # noqa: E402 - the number of BLAS threads is set before numpy is loaded

from ocmm_core.calibration.monitor import (  # noqa: E402 - as above
    Baseline,
    CalibrationMonitor,
    ChangeCause,
    ResidualAccumulator,
    camera_changes,
    learn_baseline,
)
from ocmm_core.camera import N_PARAMETERS, Rig, load_rig, project  # noqa: E402 - as above  # noqa: E402 - as above
from ocmm_core.documents import resource  # noqa: E402 - as above
from ocmm_core.geometry import Float, rotation_from_vector  # noqa: E402 - as above
from ocmm_core.tracking import (  # noqa: E402 - as above  # noqa: E402 - as above
    FrameStatus,
    ProbeBody,
    TrackBlock,
    TrackingPipeline,
    load_probe,
    tip_sensitivity,
)
from ocmm_sim.calibration_scenes import CalibrationScenesRig, FreeMotionScene  # noqa: E402 - as above
from ocmm_sim.scene import Part, ScriptedBump, VirtualRig, WorldOptions, load_part  # noqa: E402 - as above  # noqa: E402 - as above

RATE_HZ, EXPOSURES = 400, 20
TIP_ERROR_MM = 0.030
WAYS = 100
"""Of 0.6 s each: one minute of waving."""
BEFORE_S, WITHIN_S, LONGEST_S = 3.0, 2.0, 6.0
LEAST_SHARE, MOST_ALARMS = 0.99, 1


@dataclass(frozen=True, slots=True)
class Bench:
    """The simulation: the rig for averaged frames and for single exposures, the rest."""

    rig: Rig
    exposures: Rig
    body: ProbeBody
    part: Part
    effects: Float
    """(poses, C, 3, 6), mm: what each axis of a camera does to the ball."""

    @classmethod
    def of(cls, name: str) -> Bench:
        """Return the bench with one of the shipped rigs."""
        exposures = load_rig(resource("rigs", f"{name}.toml"))
        noise = type(exposures.noise)(
            white_px=exposures.noise.white_px / float(np.sqrt(EXPOSURES)),
            pattern_px=exposures.noise.pattern_px,
            pattern_length_px=exposures.noise.pattern_length_px,
        )
        rig = replace(exposures, noise=noise, frame_rate_hz=RATE_HZ)
        body = load_probe(resource("probes", "standard.toml"))
        part = load_part(resource("parts", "demo.toml"))
        return cls(rig, exposures, body, part, tip_effects(rig, body))

    def tracked(
        self, virtual: VirtualRig | CalibrationScenesRig, first_s: float, last_s: float
    ) -> (
        TrackBlock
    ):  # fmt: skip
        """Return tracked frames; single exposures are judged with the noise that they have."""
        first, last = int(first_s * RATE_HZ), int(last_s * RATE_HZ)
        return TrackingPipeline(self.exposures, self.body).process(
            virtual.frames(first, last - first)
        )

    def learnt(self, seed: int) -> Baseline:
        """Return the baseline of the sensors of a world after a minute of waving."""
        shown = CalibrationScenesRig(
            self.rig, self.body, (FreeMotionScene(ways=WAYS, seed=seed),), seed
        )
        track = self.tracked(shown, 0.0, shown.n_frames / RATE_HZ)
        looks = ResidualAccumulator(self.rig, self.body, 10_000_000).push(track)
        return learn_baseline(looks, self.rig, self.body)

    def operator(self, seed: int, bumps: tuple[ScriptedBump, ...] = (), touches: int = 6) -> (
        VirtualRig
    ):  # fmt: skip
        """Return the operator of a world."""
        script = [(artefact.name, touches) for artefact in self.part.artefacts]
        return VirtualRig(
            self.rig, self.body, self.part, script, seed, WorldOptions(bumps=bumps), RATE_HZ
        )


def tip_effects(rig: Rig, body: ProbeBody) -> Float:
    """Return d(ball)/d(axis) of every camera at forty poses in the volume of the rig."""
    rng = np.random.default_rng(0)
    low, high = rig.volume_world
    effects = np.zeros((40, len(rig.cameras), 3, 6))
    for effect in effects:
        rotation = rotation_from_vector(rng.uniform(-0.15, 0.15, 3))
        tip = low + (high - low) * rng.random(3)
        leds = (body.leds_probe - body.tip_probe) @ rotation.T + tip
        spots = np.stack([project(camera, leds) for camera in rig.cameras])
        by_cameras = tip_sensitivity(spots, rig, body).by_cameras
        for c, camera in enumerate(rig.cameras):
            part = by_cameras[:, c * N_PARAMETERS : (c + 1) * N_PARAMETERS]
            effect[c] = (part @ camera_changes(camera))[:, :6]
    return effects


def draw_push(bench: Bench, camera: int, first_frame: int, rng: np.random.Generator) -> (
    ScriptedBump
):  # fmt: skip
    """Return a push of random direction that makes the ball wrong by `TIP_ERROR_MM`."""
    axes = rng.standard_normal(6) * np.array([1e-6] * 3 + [1e-3] * 3)
    moved = bench.effects[:, camera] @ axes
    axes *= TIP_ERROR_MM / float(np.sqrt(np.mean(np.sum(moved**2, axis=1))))
    x, y, z, a, b, c = axes.tolist()
    return ScriptedBump(camera, first_frame, (x, y, z), (a, b, c))


@dataclass(frozen=True, slots=True)
class Run:
    """One push: detection in time, the named cause, and the beginning of the suspicion."""

    noticed_s: float | None
    named: bool
    since_before_s: float | None
    early: bool


def push_once(bench: Bench, baseline: Baseline | None, seed: int, number: int) -> Run:
    """Push a camera once and watch the monitor until 2 s of probing are over."""
    rng = np.random.default_rng([seed, number])
    plain = bench.operator(seed)
    end_s = plain.n_frames / RATE_HZ
    at_s = float(rng.uniform(BEFORE_S + 0.5, end_s - LONGEST_S))
    camera = int(rng.integers(len(bench.rig.cameras)))
    push = draw_push(bench, camera, round(at_s * RATE_HZ), rng)
    track = bench.tracked(bench.operator(seed, (push,)), at_s - BEFORE_S, at_s + LONGEST_S)
    monitor = CalibrationMonitor(bench.rig, bench.body, baseline=baseline)
    after = track.counter >= push.first_frame
    probed = np.cumsum(after & (track.status == FrameStatus.OK)) / RATE_HZ
    for result in monitor.push(track):
        if not result.alarm:
            continue
        at = int(np.searchsorted(track.time_ns, result.time_ns))
        since = None if result.since_ns is None else at_s - result.since_ns * 1e-9
        named = (
            result.cause is ChangeCause.CAMERA and bench.rig.cameras[camera].name in result.cameras
        ) or result.cause is ChangeCause.UNKNOWN
        return Run(float(probed[at]), named, since, early=not after[at])
    return Run(None, named=False, since_before_s=None, early=False)


def clean_alarms(bench: Bench, baseline: Baseline, seed: int, seconds: float) -> tuple[int, int]:
    """Return alarms and examinations of undisturbed work in one world."""
    operator = bench.operator(seed)
    script = [(artefact.name, 6) for artefact in bench.part.artefacts]
    monitor = CalibrationMonitor(bench.rig, bench.body, baseline=baseline)
    pipeline = TrackingPipeline(bench.exposures, bench.body)
    frame, alarms, count = 0, 0, 0
    while frame < seconds * RATE_HZ:
        if operator.n_frames < frame + 4000:
            operator.extend(script)
        results = monitor.push(pipeline.process(operator.frames(frame, 4000)))
        frame += 4000
        count += len(results)
        alarms += sum(result.alarm for result in results)
    return alarms, count


def main() -> int:
    """Print the table; 0 if the claims hold."""
    parser = argparse.ArgumentParser(description="Pushes of a camera, and hours without any.")
    parser.add_argument("--rig", default="recommended")
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--per-world", type=int, default=20)
    parser.add_argument("--hours", type=float, default=8.0)
    parser.add_argument("--clean-worlds", type=int, default=8)
    parser.add_argument("--first-world", type=int, default=0, help="to go on where a run ended")
    given = parser.parse_args()
    bench = Bench.of(given.rig)
    start = time.monotonic()
    learnt: list[Run] = []
    plain: list[Run] = []
    left: list[float] = []
    for number in range(given.runs):
        seed, turn = divmod(number, given.per_world)
        seed += given.first_world
        if turn == 0:
            baseline = bench.learnt(seed)
            left.append(baseline.left_px)
        learnt.append(push_once(bench, baseline, seed, turn))
        if turn == 0:
            plain.append(push_once(bench, None, seed, turn))
    alarms = examinations = 0
    for world in range(given.clean_worlds):
        seed = 1_000_000 + given.first_world + world
        seconds = given.hours * 3600.0 / given.clean_worlds
        more, count = clean_alarms(bench, bench.learnt(seed), seed, seconds)
        alarms, examinations = alarms + more, examinations + count
    share = report(bench, learnt, plain, left)
    print(
        f"clean data: {alarms} alarms in {given.hours:g} h of probing "
        f"({examinations} examinations, {given.clean_worlds} worlds)"
    )
    print(f"took {time.monotonic() - start:.0f} s")
    return int(share < LEAST_SHARE or alarms > MOST_ALARMS)


def report(bench: Bench, learnt: list[Run], plain: list[Run], left: list[float]) -> float:
    """Print the detections and return their share, with the baseline."""
    share = _in_time(learnt)
    times = [run.noticed_s for run in learnt if run.noticed_s is not None]
    since = [run.since_before_s for run in learnt if run.since_before_s is not None]
    print(f"rig {bench.rig.name}, pushes that make the ball wrong by {TIP_ERROR_MM * 1e3:g} um RMS")
    print(f"pattern left by the baseline: {min(left):.4f} to {max(left):.4f} px of 0.0100 px")
    print(
        f"noticed within {WITHIN_S:g} s of probing: {100.0 * share:.1f} % of {len(learnt)} runs "
        f"in {len(left)} worlds; without baseline {100.0 * _in_time(plain):.0f} % of {len(plain)}"
    )
    print(
        f"time to notice: median {np.median(times):.2f} s, 99 % {np.quantile(times, 0.99):.2f} s "
        f"of probing; before the push {sum(run.early for run in learnt)} alarms"
    )
    print(f"pushed camera among the named: {sum(run.named for run in learnt)} of {len(times)}")
    if since:
        print(
            f"the doubt begins {min(since):.2f} to {max(since):.2f} s before the push "
            f"({sum(value < 0.0 for value in since)} times after it)"
        )
    return share


def _in_time(runs: list[Run]) -> float:
    good = [run for run in runs if run.noticed_s is not None and not run.early]
    return sum(run.noticed_s <= WITHIN_S for run in good if run.noticed_s is not None) / len(runs)


if __name__ == "__main__":
    sys.exit(main())
