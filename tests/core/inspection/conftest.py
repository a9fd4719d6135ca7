from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from ocmm_core.camera import Rig, load_rig
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.plan import Plan, load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import Touch, TouchCollector
from ocmm_core.storage import JobFile, make_head
from ocmm_core.tracking import ProbeBody, TrackingPipeline, load_probe
from ocmm_sim.scene import VirtualRig, load_part

PLAN = resource("plans", "quick.toml")
RIG = resource("rigs", "recommended.toml")
PROBE = resource("probes", "standard.toml")
FRAME_RATE_HZ = 500


@dataclass(frozen=True, slots=True)
class Bench:
    """Everything that a session needs, and the touches of the quick plan, in order."""

    plan: Plan
    rig: Rig
    body: ProbeBody
    touches: tuple[Touch, ...]
    folder: Path

    def job(self) -> JobFile:
        return self.job_at(self.folder / "job.ocmm")

    def job_at(self, path: Path) -> JobFile:
        head = make_head(plan=PLAN, rig=RIG, probe=PROBE, operator="me", part="P", serial="1")
        return JobFile.create(path, head)

    def session(self, job: JobFile) -> InspectionSession:
        return InspectionSession(self.plan, self.rig, self.body, job, SessionOptions())


@pytest.fixture(scope="session")
def quick_touches() -> tuple[Touch, ...]:
    rig, body, plan = load_rig(RIG), load_probe(PROBE), load_plan(PLAN)
    part = load_part(resource("parts", "demo.toml"))
    script = [(feature.name, feature.points) for feature in plan.features]
    virtual = VirtualRig(rig, body, part, script, seed=1, frame_rate_hz=FRAME_RATE_HZ)
    pipeline = TrackingPipeline(rig, body)
    session = SessionOptions()
    collector = TouchCollector(1.0 / FRAME_RATE_HZ, session.point)
    return tuple(collector.push(pipeline.process(virtual.frames(0, virtual.n_frames))))


@pytest.fixture
def bench(quick_touches: tuple[Touch, ...], tmp_path: Path) -> Bench:
    return Bench(load_plan(PLAN), load_rig(RIG), load_probe(PROBE), quick_touches, tmp_path)


@pytest.fixture
def job(bench: Bench) -> Iterator[JobFile]:
    with bench.job() as opened:
        yield opened
