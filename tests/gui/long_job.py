"""A finished job of about a hundred points, made in seconds."""

from __future__ import annotations

from pathlib import Path

import msgspec

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.plan import load_plan, save_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import TouchCollector
from ocmm_core.storage import JobFile, make_head
from ocmm_core.tracking import TrackingPipeline, load_probe
from ocmm_sim.scene import VirtualRig, load_part

_TIMES = 7
_RATE_HZ = 500


def make_long_job(folder: Path) -> Path:
    """Return a job by the quick plan with every place touched `_TIMES` times.

    The cost of an evaluation depends on the number of points, not on their places.
    """
    rig_file = resource("rigs", "recommended.toml")
    probe_file = resource("probes", "standard.toml")
    rig, body = load_rig(rig_file), load_probe(probe_file)
    plan = load_plan(resource("plans", "quick.toml"))
    part = load_part(resource("parts", "demo.toml"))
    script = [(feature.name, feature.points) for feature in plan.features]
    virtual = VirtualRig(rig, body, part, script, seed=1, frame_rate_hz=_RATE_HZ)
    options = SessionOptions()
    collector = TouchCollector(1.0 / _RATE_HZ, options.point)
    pipeline = TrackingPipeline(rig, body)
    touches = iter(collector.push(pipeline.process(virtual.frames(0, virtual.n_frames))))
    own = {item.name: [next(touches) for _ in range(item.points)] for item in plan.features}
    long = msgspec.structs.replace(
        plan,
        features=[
            msgspec.structs.replace(item, points=_TIMES * item.points) for item in plan.features
        ],
    )
    path = folder / "long.toml"
    folder.mkdir(parents=True, exist_ok=True)
    save_plan(long, path)
    head = make_head(
        plan=path, rig=rig_file, probe=probe_file, operator="me", part=plan.part, serial="1"
    )
    with JobFile.create(folder / "LONG-001.ocmm", head) as job:
        session = InspectionSession(long, rig, body, job, options)
        for name, found in own.items():
            for touch in found * _TIMES:
                session.touches.record_touch(touch, name)
        assert not session.steps.missing()
        return job.path
