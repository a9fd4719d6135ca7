"""Real job files of calibrated parts: the stepped block at several heights, measured again."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import MeasuredPoint, Touch, TouchCollector
from ocmm_core.storage import JobFile, make_head
from ocmm_core.tracking import TrackingPipeline, load_probe
from ocmm_sim.scene import VirtualRig, load_part

PLAN = resource("plans", "quick.toml")
RIG = resource("rigs", "recommended.toml")
PROBE = resource("probes", "standard.toml")
STEP = "-72.0, 0.0, 20.342"
"""Top of the step in the coordinate system of the part, mm."""


def touches_of(folder: Path, height: str, seed: int) -> list[Touch]:
    """Return the touches of the quick plan at a part whose step has another height."""
    text = resource("parts", "demo.toml").read_text(encoding="utf-8")
    assert text.count(STEP) == 1
    document = folder / f"part-{height}.toml"
    document.write_text(text.replace(STEP, f"-72.0, 0.0, {height}"), encoding="utf-8")
    rig, body, plan = load_rig(RIG), load_probe(PROBE), load_plan(PLAN)
    script = [(feature.name, feature.points) for feature in plan.features]
    virtual = VirtualRig(rig, body, load_part(document), script, seed=seed, frame_rate_hz=500)
    collector = TouchCollector(1.0 / 500, SessionOptions().point)
    return collector.push(TrackingPipeline(rig, body).process(virtual.frames(0, virtual.n_frames)))


def write_job(path: Path, serial: str, touches: list[Touch]) -> None:
    """Measure the quick plan into a job file."""
    rig, body, plan = load_rig(RIG), load_probe(PROBE), load_plan(PLAN)
    head = make_head(plan=PLAN, rig=RIG, probe=PROBE, operator="Ann", part="P", serial=serial)
    with JobFile.create(path, head) as job:
        session = InspectionSession(plan, rig, body, job, SessionOptions())
        session.conditions.note_calibration(
            "DESIGN " + "0" * 64, "DESIGN standard: " + "1" * 64, ""
        )
        session.conditions.note_climate()
        for touch in touches:
            assert isinstance(session.touches.record_touch(touch), MeasuredPoint)
