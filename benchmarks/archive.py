"""How an archive grows: questions, and the hand-over of one job, with 100,000 jobs on both stores.

    python -m benchmarks.archive --jobs 100000 --files 1000 --store sqlite
    python -m benchmarks.archive --store postgresql --server postgresql:///bench?host=/run/postgresql

Values are made (``made_jobs`` of the tests); ``--files`` of the jobs are real files of the quick
plan, measured on the virtual rig. The database of a server must be empty and set up. Each question
is timed at a tenth, a third and the whole of the jobs: what grows with all of them would show.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import Touch, TouchCollector
from ocmm_core.storage import JobFile, make_head
from ocmm_core.tracking import TrackingPipeline, load_probe
from ocmm_shop.archive.questions import Query, cpk_by_month, parts, passed, today, trend, used
from ocmm_shop.archive.records import Delivery, Sender, extract_job, snapshot
from ocmm_shop.archive.stores import Archive, open_archive
from ocmm_sim.scene import VirtualRig, load_part
from tests.shop.archive.made_jobs import START, made_delivery, made_sender

STATIONS, PARTS, CALIBRATIONS = 10, 100, 50
PLAN, RIG = resource("plans", "quick.toml"), resource("rigs", "recommended.toml")
PROBE = resource("probes", "standard.toml")


def made(number: int, results: int) -> Delivery:
    """Return a job of one of ten stations and a hundred parts, in a year of 100,000 jobs."""
    station = number % STATIONS
    sender = made_sender(f"Station {station}", station + 1)
    one = made_delivery(number, sender, sequence=number // STATIONS + 1)
    created = START + timedelta(minutes=5.256 * number)
    utc = created.isoformat(timespec="milliseconds")
    calibration = f"{number * CALIBRATIONS // 100_000 % CALIBRATIONS:064x}"
    job = msgspec.structs.replace(
        one.record.job, part=f"PART {number // STATIONS % PARTS}", created_utc=utc, changed_utc=utc,
        calibration=calibration,
    )  # fmt: skip
    values = 0.02 * np.sin(1.7 * number + np.arange(results))
    template = one.record.results[0]
    rows = tuple(
        msgspec.structs.replace(
            template, position=i, characteristic=f"D{i}",
            value=template.nominal + float(values[i]),
        )
        for i in range(results)
    )  # fmt: skip
    uses = tuple(
        msgspec.structs.replace(use, identity=calibration) if use.kind == "calibration" else use
        for use in one.record.uses
    )
    record = msgspec.structs.replace(one.record, job=job, results=rows, uses=uses)
    return msgspec.structs.replace(one, record=record)


def touches() -> tuple[Touch, ...]:
    """Return the touches of the quick plan on the virtual rig."""
    rig, body, plan = load_rig(RIG), load_probe(PROBE), load_plan(PLAN)
    script = [(feature.name, feature.points) for feature in plan.features]
    virtual = VirtualRig(
        rig, body, load_part(resource("parts", "demo.toml")), script, seed=1, frame_rate_hz=500
    )
    collector = TouchCollector(1.0 / 500, SessionOptions().point)
    frames = virtual.frames(0, virtual.n_frames)
    return tuple(collector.push(TrackingPipeline(rig, body).process(frames)))


def real_files(folder: Path, count: int) -> list[Path]:
    """Measure jobs of the quick plan from the same touches; each has an individual identity."""
    rig, body, plan, taken = load_rig(RIG), load_probe(PROBE), load_plan(PLAN), touches()
    paths = []
    for number in range(count):
        path = folder / f"real-{number:04d}.ocmm"
        head = make_head(
            plan=PLAN, rig=RIG, probe=PROBE, operator="me", part="REAL", serial=f"{number}"
        )
        with JobFile.create(path, head) as job:
            session = InspectionSession(plan, rig, body, job, SessionOptions())
            for touch in taken:
                session.touches.record_touch(touch)
        paths.append(path)
    return paths


def timed(call: Callable[[], object], times: int = 5) -> float:
    """Return the median duration of a call, ms."""
    found = []
    for _ in range(times):
        begin = time.perf_counter()
        call()
        found.append(1000.0 * (time.perf_counter() - begin))
    return statistics.median(found)


def questions(archive: Archive, jobs: int) -> dict[str, float]:
    """Return how long each question takes, ms."""
    middle = (START + timedelta(minutes=5.256 * jobs / 2)).astimezone().date()
    some = f"{jobs // 2 * CALIBRATIONS // 100_000 % CALIBRATIONS:064x}"
    asked = Query(part="PART 7", characteristic="D1", first=middle)
    return {
        "a day's list": timed(lambda: today(archive, asked)),
        "trend (500 newest)": timed(lambda: trend(archive, asked)),
        "where used (500 newest)": timed(
            lambda: used(archive, Query(kind="calibration", what=some))
        ),
        "where used, all rows": timed(
            lambda: used(archive, Query(kind="calibration", what=some, most=100_000)), 3
        ),
        "where used, all jobs have it": timed(
            lambda: used(archive, Query(kind="artefact", what="B-17"))
        ),
        "parts to choose from": timed(lambda: parts(archive)),
        "Cpk by month": timed(lambda: cpk_by_month(archive, asked), 3),
        "who passed what, a month": timed(
            lambda: passed(
                archive, replace(asked, part="", first=date(2026, 4, 1), last=date(2026, 4, 30))
            ),
            3,
        ),
    }


class ReadBack:
    """Times the read-back of an archive before a job counts as handed over."""

    def __init__(self, archive: Archive) -> None:
        self.s = 0.0
        for name in ("_settle", "_check_rows", "_check_kept"):
            setattr(archive, name, self._timed(getattr(archive, name)))

    def _timed(self, check: Callable[..., None]) -> Callable[..., None]:
        def timed(*given: object) -> None:
            begun = time.perf_counter()
            check(*given)
            self.s += time.perf_counter() - begun

        return timed


def hand_over(archive: Archive, files: list[Path], sender: Sender) -> None:
    """Time each step of handing over real files."""
    steps: dict[str, list[float]] = {
        "snapshot": [], "rows of the file": [], "handed over": [], "of it read back": [],
        "all together": [],
    }  # fmt: skip
    back = ReadBack(archive)
    sizes = []
    for number, path in enumerate(files, start=1):
        back.s = 0.0
        begin = time.perf_counter()
        content = snapshot(path)
        read = time.perf_counter()
        one = extract_job(content, path.name, sender.station, None)
        computed = time.perf_counter()
        archive.put(
            Delivery(
                sender=sender, sequence=number, sent_utc=one.record.job.created_utc,
                record=one.record, content=content,
            )
        )  # fmt: skip
        kept = time.perf_counter()
        sizes.append(len(content))
        for name, lasted in zip(
            steps,
            (read - begin, computed - read, kept - computed, back.s, kept - begin),
            strict=True,
        ):
            steps[name].append(1000.0 * lasted)
    print(f"one of {len(files)} real jobs, {statistics.median(sizes) / 1000:.0f} kB:")
    for name, values in steps.items():
        print(
            f"  {name:18} median {statistics.median(values):7.1f} ms, "
            f"99 % {float(np.percentile(values, 99)):7.1f} ms"
        )


def main() -> None:
    """Fill an archive, and print what questions and the hand-over take."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--jobs", type=int, default=100_000)
    parser.add_argument("--files", type=int, default=1000)
    parser.add_argument("--results", type=int, default=10)
    parser.add_argument("--store", choices=["sqlite", "postgresql"], default="sqlite")
    parser.add_argument("--server", default="")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        address = options.server or str(folder / "archive.sqlite")
        with open_archive(address, set_up=bool(options.server)) as archive:
            _run(archive, options, folder)


def _run(archive: Archive, options: argparse.Namespace, folder: Path) -> None:
    assert not archive.query("SELECT 1 FROM job LIMIT 1").rows, "the archive must be empty"
    print(f"{options.store}, {options.results} characteristics a job")
    stages = sorted({options.jobs // 10, options.jobs // 3, options.jobs})
    done = 0
    for stage in stages:
        begin = time.perf_counter()
        while done < stage:
            several = range(done, min(done + 500, stage))
            archive.put_all([made(number, options.results) for number in several])
            done = several.stop
        lasted = time.perf_counter() - begin
        print(f"N = {done}: filled in {lasted:.0f} s", flush=True)
        for name, took in questions(archive, done).items():
            print(f"  {name:30} {took:9.1f} ms")
    size = archive.query(
        "SELECT pg_database_size(current_database())"
        if options.store == "postgresql"
        else "SELECT page_count * page_size FROM pragma_page_count(), pragma_page_size()"
    ).rows[0][0]
    print(f"size without job files: {int(str(size)) / done / 1000:.2f} kB a job")
    if options.files:
        files = real_files(folder, options.files)
        hand_over(archive, files, made_sender("Real station", 99))


if __name__ == "__main__":
    main()
