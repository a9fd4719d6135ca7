"""Whole sessions with optical trackers: noise measured, scale verified and corrected.

    python -m benchmarks.trackers [--n SESSIONS] [--seed FIRST] [--probes SESSIONS]
    python -m benchmarks.trackers --delay SECONDS

Each session draws a tracker (place errors, noise, bar) whose document states noise that is wrong by
a factor of 0.5 to 2, measures it (`ocmm calibrate tracker`), verifies it with the length bar, and
measures lengths at other places. Half of the trackers have a scale that is wrong by 300 um/m; that
is corrected by the failed verification, and verified again with another bar. Ends with 1 if more
than 5 % of the scale errors are missed, more than 2 % of the honest trackers are refused for their
scale, or fewer than 93 % of the squared errors of points are within the 95 % limit. ``--delay``:
the time from a packet to the readout, by protocol and rate; it passes or fails nothing.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import numpy as np
from scipy.stats import chi2

from benchmarks import tracker_delay
from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.cameras import TrackerProcedure, TrackerSetup, correct_scale
from ocmm_core.calibration.guided import Procedure, SessionSite
from ocmm_core.calibration.records import (
    CalibrationStore,
    LengthBar,
    ProbeStore,
    load_bar,
    open_calibration,
)
from ocmm_core.calibration.sweeping import PivotProcedure, PivotSetup
from ocmm_core.calibration.verification import VerificationProcedure, VerificationSetup
from ocmm_core.camera import Rig, TrackerDocument, load_tracker, project
from ocmm_core.composition import STANDARD_PROBE
from ocmm_core.documents import resource
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, rigid_fit, rotation_from_vector
from ocmm_core.measuring import PointOptions, StablePoint, average, systematic_covariance
from ocmm_core.settings import toml_text
from ocmm_core.tracking import TrackingPipeline, load_probe, tip_sensitivity
from ocmm_sim.calibration_scenes import CalibrationScenesRig, Scene, SweepProbe
from ocmm_sim.sources import VirtualSite, scenes_of_tracker, scenes_of_verification
from ocmm_sim.trackers import MarkerErrors

SCALE_ERROR = 3e-4
START = datetime(2026, 3, 2, 8, 0, tzinfo=UTC)
_CONES, _SWEEP_S, _REACH = ((0.0, 0.0, -150.0), (70.0, 10.0, -130.0)), 60.0, (30.0, 30.0, 13.0)
_BLOCK, _POINTS, _AVERAGED, _ATTEMPTS = 50, 40, 25, 4


class TrackerSite:
    """A tracker with its errors, and the document that states other noise."""

    def __init__(self, folder: Path, true: TrackerDocument, stated: TrackerDocument, seed: int,
                 scale: float = 0.0) -> None:  # fmt: skip
        self.folder, self.true, self.seed, self.scale = folder, true, seed, scale
        folder.mkdir(exist_ok=True)
        self.true_file, self.file = folder / "true.toml", folder / "tracker.toml"
        for path, document in ((self.true_file, true), (self.file, stated)):
            path.write_text(toml_text(msgspec.to_builtins(document)))
        self.body = load_probe(STANDARD_PROBE)
        self.errors, self.head = MarkerErrors(true, seed), np.array(true.head)
        self.now = START

    def virtual(self, more: int = 0) -> VirtualSite:
        """Return the site of the true tracker, with a larger seed."""
        return VirtualSite(self.true_file, STANDARD_PROBE, self.seed + more, None)

    @property
    def store(self) -> CalibrationStore:
        """Return its calibrations as they are now."""
        return CalibrationStore(self.folder / self.true.name)

    @property
    def rig(self) -> Rig:
        """Return the rig in force."""
        return open_calibration(self.file, self.folder).rig

    def reported(self, leds: Float, document: TrackerDocument) -> Float:
        """Return the markers of a frame or of frames, mm, corrected as the reader does."""
        wrong = self.head + (1.0 + self.scale) * (leds - self.head)
        return self.errors.reported(wrong) * document.noise.scale

    def frames(self, rig: Rig, shown: CalibrationScenesRig, first: int, count: int) -> FrameBlock:
        """Return frames as the reader of the tracker pushes them."""
        assert rig.markers is not None
        document, half = rig.markers.document, np.cos(self.body.emission_half_angle)
        leds, lights = shown.leds(first, count)
        rays = self.head - leds
        seen = np.sum(lights * rays, axis=2) >= half * np.linalg.norm(rays, axis=2)
        places = np.where(seen[..., None], self.reported(leds, document), np.nan)
        return self.block(rig, places, first)

    def resting(self, rig: Rig, leds: Float) -> FrameBlock:
        """Return frames of LEDs at rest, all of which are seen."""
        assert rig.markers is not None
        same = np.broadcast_to(leds, (_AVERAGED, *leds.shape))
        return self.block(rig, self.reported(same, rig.markers.document))

    def block(self, rig: Rig, places: Float, first: int = 0) -> FrameBlock:
        """Return frames of markers (n, L, 3), mm, NaN if not seen."""
        count = len(places)
        uv = np.full((count, len(rig.cameras), 8, 2), np.nan)
        for index, camera in enumerate(rig.cameras):
            uv[:, index, : self.body.n_leds] = project(camera, places)
        bits = (np.uint64(1) << np.arange(8, dtype=np.uint64)) * np.isfinite(uv[:, 0, :, 0])
        counter = np.arange(first, first + count, dtype=np.int64)
        return FrameBlock(
            counter=counter, time_ns=counter * round(1e9 / rig.frame_rate_hz),
            flags=np.zeros(count, np.uint32),
            valid=np.repeat(bits.sum(axis=1, dtype=np.uint64)[:, None], len(rig.cameras), axis=1),
            uv=uv,
        )  # fmt: skip

    def play(
        self, procedure: Procedure, rig: Rig, scenes: Callable[[VirtualSite], tuple[Scene, ...]]
    ) -> None:
        """Show scenes to a procedure until it has all that it needs."""
        procedure.advance(self.now)
        for attempt in range(_ATTEMPTS):
            if procedure.base.current < len(procedure.base.steps) - 1:
                # Another seed holds the probe in other attitudes.
                site = self.virtual(1000 * attempt)
                self._show(procedure, rig, site.script(scenes(site)).build())

    def _show(self, procedure: Procedure, rig: Rig, shown: CalibrationScenesRig) -> None:
        for first in range(0, shown.n_frames, _BLOCK):
            procedure.watch(self.frames(rig, shown, first, min(_BLOCK, shown.n_frames - first)))
            self.now += timedelta(seconds=_BLOCK / rig.frame_rate_hz)
            if procedure.base.live.ready:
                procedure.record(self.now)
                if isinstance(procedure, VerificationProcedure):
                    for line, plan in enumerate(procedure.view.lines):
                        if plan.hint:
                            procedure.repeat_line(line, self.now)
            while procedure.base.current < len(procedure.base.steps) - 1:
                if not procedure.base.step.gate.open:
                    break
                procedure.advance(self.now)

    def calibrate(self) -> None:
        """Measure the noise and accept it; CalibrationError if refused."""
        rig = self.rig
        procedure = TrackerProcedure.start(
            SessionSite(self.folder / "sessions", rig, self.body, self.store.folder),
            TrackerSetup(who="benchmark"),
            self.now,
        )
        self.play(procedure, rig, lambda site: scenes_of_tracker(site, rig, procedure.view))
        gate = procedure.base.step.gate
        if procedure.base.current < len(procedure.base.steps) - 1:
            why = f"{gate.reason} {procedure.base.live.hint}"
            raise CalibrationError("benchmark.refused", why, gate.remedy)
        procedure.compute()
        procedure.accept(self.now, "measured")

    def verify(self, bar: LengthBar) -> tuple[str, ...]:
        """Store a verification, and return the codes of its objections; empty if passed."""
        rig = self.rig
        procedure = VerificationProcedure.start(
            SessionSite(self.folder / "sessions", rig, self.body, self.store.folder),
            VerificationSetup(who="benchmark", bar=bar),
            self.now,
        )
        self.play(
            procedure, rig,
            lambda site: scenes_of_verification(site, rig, procedure.view, bar, ()),
        )  # fmt: skip
        procedure.compute()
        outcome = procedure.view.outcome
        assert outcome is not None
        procedure.accept(self.now, "verified")
        record = outcome.record
        return () if record.passed else tuple(one.code for one in record.objections) or ("lengths",)

    def probe(self) -> float:
        """Calibrate the probe by two sweeps; return the normalised square of its tip error."""
        rig, store = self.rig, ProbeStore(self.folder / "probe")
        procedure = PivotProcedure.start(
            SessionSite(self.folder / "sweeps", rig, self.body, store.folder),
            PivotSetup(who="benchmark", tip="T1"),
            self.now,
        )

        def sweeps(site: VirtualSite) -> tuple[Scene, ...]:
            first, second = (
                SweepProbe(cone=cone, seconds=_SWEEP_S, seed=site.seed + number, reach_deg=_REACH)
                for number, cone in enumerate(_CONES)
            )
            again = msgspec.structs.replace(first, seconds=2.5, reach_deg=(0.0, 0.0, 0.0))
            left = (first, second, again)
            return left[procedure.base.current - 1 :]

        self.play(procedure, rig, sweeps)
        procedure.compute()
        outcome = procedure.view.outcome
        assert outcome is not None
        record = outcome.record
        world = self.virtual().script(()).build().world
        rotation, shift = rigid_fit(world.leds_probe, self.body.leds_probe)
        error = np.array(record.tip_mm) - (rotation @ world.tip_probe + shift)
        covariance = np.array(record.covariance)[-3:, -3:]
        return float(error @ np.linalg.solve(covariance, error))

    def squares(self, count: int) -> Float:
        """Return the normalised squares (n,) of tip errors at new places; NaN if refused."""
        rig, rng = self.rig, np.random.default_rng([self.seed, 46])
        exact = replace(self.body, geometry_covariance=np.zeros_like(self.body.geometry_covariance))
        low, high = rig.volume_world
        found = np.full(count, np.nan)
        assert rig.markers is not None
        for index in range(count):
            tip = low + rng.random(3) * (high - low)
            turn = rotation_from_vector(rng.normal(0.0, 0.15, 3))
            self.errors.restart()
            leds = tip + (self.body.leds_probe - self.body.tip_probe) @ turn.T
            track = TrackingPipeline(rig, exact).process(self.resting(rig, leds))
            point = average(track, _AVERAGED, rig, PointOptions())
            if isinstance(point, StablePoint):
                systematic = systematic_covariance(
                    [tip_sensitivity(point.spots, rig, exact)], rig, exact
                )
                covariance = point.random_covariance - point.motion_covariance + systematic
                # The scale is corrected about the origin, not about the head.
                moved = (rig.markers.document.noise.scale - 1.0) * self.head
                error = point.tip_world - moved - tip
                found[index] = error @ np.linalg.solve(covariance, error)
        return found


def drawn(seed: int) -> tuple[TrackerDocument, TrackerDocument]:
    """Return a tracker and its document, whose stated noise is wrong by up to a factor of two."""
    rng = np.random.default_rng([seed, 47])
    true = load_tracker(resource("rigs", "tracker.toml"))
    kind = rng.integers(3)
    noise = msgspec.structs.replace(
        true.noise, scale_sigma=0.0, rounding=(0.001, 0.01, 0.001)[kind],
        correlation=(0.0, 0.0, 0.5)[kind], growth=("distance", "distance", "none")[kind],
        place_sigma=float(rng.uniform(0.003, 0.015)), place_length=100.0,
    )  # fmt: skip
    lie = rng.uniform(0.5, 2.0, 2).tolist()
    stated = msgspec.structs.replace(
        noise, sigma_across=noise.sigma_across * lie[0], sigma_along=noise.sigma_along * lie[0],
        place_sigma=noise.place_sigma * lie[1], correlation=0.0, rounding=0.0, scale_sigma=5e-6,
    )  # fmt: skip
    return msgspec.structs.replace(true, noise=noise), msgspec.structs.replace(true, noise=stated)


@dataclass(slots=True)
class Result:
    """One session."""

    first: tuple[str, ...] = ()
    """Objections of the first verification."""
    second: tuple[str, ...] = ()
    """After the correction of the scale."""
    squares: Float | None = None
    scale: float = 0.0
    """Error of the estimated scale, in its standard uncertainties."""


def session(seed: int, scale: float) -> Result:
    """Calibrate, verify and measure with one tracker; correct its scale if that is wrong."""
    bar = load_bar(resource("artefacts", "verification_bar.toml"))
    other = load_bar(resource("artefacts", "bar.toml"))
    with tempfile.TemporaryDirectory() as folder:
        site = TrackerSite(Path(folder), *drawn(seed), seed, scale)
        try:
            site.calibrate()
        except CalibrationError as error:
            print(f"seed {seed} refused: {error.what}", flush=True)
            return Result(("refused",))
        result = Result(site.verify(bar))
        judged = site.store.verifications()[-1].scale
        assert judged is not None
        result.scale = (judged.relative - scale) / judged.sigma
        if "verification.scale" in result.first:
            correct_scale(site.store, "benchmark", "as verified", site.now)
            result.second = site.verify(other)
        result.squares = site.squares(_POINTS)
    return result


def probes(first: int, count: int) -> int:
    """Print how many probes were calibrated with the shipped tracker, and return 1 if one is wrong.

    The mean normalised square of three coordinates is 3 if U is right, less if it is too large.
    """
    document, squares = load_tracker(resource("rigs", "tracker.toml")), []
    for seed in range(first, first + count):
        with tempfile.TemporaryDirectory() as folder:
            site = TrackerSite(Path(folder), document, document, seed)
            site.calibrate()
            site.verify(load_bar(resource("artefacts", "verification_bar.toml")))
            try:
                squares.append(site.probe())
            except CalibrationError as error:
                print(f"seed {seed} refused: {error.code}")
    print(f"{len(squares)} of {count} accepted; normalised squares: mean {np.mean(squares):.2f}, "
          f"largest {np.max(squares):.2f}")  # fmt: skip
    return int(np.max(squares) > chi2.ppf(0.999, 3))


def main() -> int:
    """Print what was found, and return 1 if a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=100, help="Sessions of each kind.")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--probes", type=int, default=0, help="Only that many swept probes.")
    parser.add_argument("--delay", type=float, default=0.0, help="Only the delay, each that long.")
    options = parser.parse_args()
    if options.delay:
        tracker_delay.report(options.delay)
        return 0
    if options.probes:
        return probes(options.seed, options.probes)
    counts = {}
    for name, scale in (("honest", 0.0), ("scale 300 um/m off", SCALE_ERROR)):
        results = [session(options.seed + i, scale) for i in range(options.n)]
        accused = sum("verification.scale" in one.first for one in results)
        passed = sum(not one.first or ("verification.scale" in one.first and not one.second)
                     for one in results)  # fmt: skip
        squares = np.concatenate([one.squares for one in results if one.squares is not None])
        inside = float(np.mean(squares[np.isfinite(squares)] <= chi2.ppf(0.95, 3)))
        others = [code for one in results for code in (*one.first, *one.second)]
        print(f"{name}: scale named {accused} of {options.n}, valid at the end {passed}, points in "
              f"the 95 % ellipsoid {100.0 * inside:.1f} % of {np.isfinite(squares).sum()}; "
              f"objections {sorted(set(others))}; error of the scale "
              f"{np.std([one.scale for one in results]):.2f} u", flush=True)  # fmt: skip
        counts[name] = accused, inside
    honest, wrong = counts.values()
    broken = wrong[0] < 0.95 * options.n or honest[0] > 0.02 * options.n
    return int(broken or min(honest[1], wrong[1]) < 0.93)


if __name__ == "__main__":
    sys.exit(main())
