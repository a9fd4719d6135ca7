"""A plan that another program replaces while the station opens its job."""

from __future__ import annotations

import threading
from pathlib import Path

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource, write_atomic
from ocmm_core.inspection.plan import stored_plan
from ocmm_core.storage import JobFile


def test_a_job_holds_the_plan_that_it_is_measured_by(tmp_path: Path) -> None:
    text = resource("plans", "quick.toml").read_text("utf-8")
    path, ended = tmp_path / "plan.toml", threading.Event()
    versions = [text, text.replace('name = "', 'name = "other ', 1)]
    assert versions[0] != versions[1]
    path.write_text(text, "utf-8")

    def replace() -> None:
        while not ended.wait(1e-3):
            for version in versions:
                write_atomic(path, version.encode())

    writer = threading.Thread(target=replace)
    writer.start()
    try:
        for serial in range(10):
            built = build_station(StationRequest(plan=path, out=tmp_path, serial=str(serial)))
            plan = built.station.job.plan
            built.station.close()
            with JobFile.open(built.job_path) as job:
                assert stored_plan(job.head) == plan
    finally:
        ended.set()
        writer.join()
