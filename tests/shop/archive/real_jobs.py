"""Real job files of the quick plan: finished, paused, and gone on with."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ocmm_shop.archive.records import snapshot
from tests.core.inspection.conftest import Bench


@dataclass(frozen=True, slots=True)
class RealJobs:
    """Files in a separate folder.

    Attributes
    ----------
    finished, went_on
        Job files; the latter was paused and then finished.
    paused_content
        Its content during the pause.
    """

    bench: Bench
    finished: Path
    went_on: Path
    paused_content: bytes

    @contextlib.contextmanager
    def measuring(self, points: int = 5) -> Iterator[tuple[Path, int]]:
        """Give a job that is open for measuring, with some points."""
        path = self.bench.folder / "measuring.ocmm"
        with self.bench.job_at(path) as job:
            session = self.bench.session(job)
            for touch in self.bench.touches[:points]:
                session.touches.record_touch(touch)
            yield path, len(job.points())


def make_real_jobs(bench: Bench) -> RealJobs:
    """Measure them."""
    finished = bench.folder / "finished.ocmm"
    measure(bench, finished)
    went_on = bench.folder / "went_on.ocmm"
    with bench.job_at(went_on) as job:
        session = bench.session(job)
        half = len(bench.touches) // 2
        for touch in bench.touches[:half]:
            session.touches.record_touch(touch)
        session.pausing.pause()
        paused = snapshot(went_on)
        session.pausing.resume()
        for touch in bench.touches[half:]:
            session.touches.record_touch(touch)
    return RealJobs(bench, finished, went_on, paused)


def measure(bench: Bench, path: Path) -> Path:
    """Measure the whole quick plan into a file."""
    with bench.job_at(path) as job:
        session = bench.session(job)
        for touch in bench.touches:
            session.touches.record_touch(touch)
    return path
