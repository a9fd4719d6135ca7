"""Forged jobs, reopened and in a batch: a sentence about the file, or no result."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from ocmm_bench.campaign import Forgery, job_kinds
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.finished import parts_of_batch, reopen_job, require_new_serial
from ocmm_core.inspection.session import HEADER_EVENT
from ocmm_core.storage import JobFile, make_head

LONGEST_S = 5.0
"""Processor time of one job; a circle of restored points would take for ever."""
MARKS = ("_text ", "event '", "limit ", "head.part NULL")
TEXTS = [kind for kind in job_kinds() if any(mark in kind.name for mark in MARKS)]


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a job without points, with its documents and a header."""
    path = tmp_path_factory.mktemp("good") / "good.ocmm"
    write(path, "1")
    return path


def write(path: Path, serial: str) -> None:
    head = make_head(
        plan=resource("plans", "quick.toml"), rig=resource("rigs", "recommended.toml"),
        probe=resource("probes", "standard.toml"), operator="me", part="P", serial=serial,
    )  # fmt: skip
    with JobFile.create(path, head) as job:
        job.append_event(HEADER_EVENT, '{"order":"","batch":"B"}')
    os.utime(path, (1e9, 1e9))


@pytest.mark.parametrize("kind", TEXTS, ids=lambda kind: kind.name)
def test_a_forged_job_is_refused_or_read(good: Path, tmp_path: Path, kind: Forgery) -> None:
    path = tmp_path / "forged.ocmm"
    kind.make(good, path)
    begun = time.thread_time()
    told = None
    try:
        reopen_job(path, probes=tmp_path, calibrations=tmp_path)
    except OcmmError as error:
        told = error.what
    assert time.thread_time() - begun < LONGEST_S
    if told is None:
        assert kind.harmless
    else:
        assert str(path) in told
        assert len(told) < 2500
        assert "\n" not in told


def test_bad_neighbours_of_a_batch_are_named_and_passed_over(good: Path, tmp_path: Path) -> None:
    write(tmp_path / "a.ocmm", "7")
    bad = [k for k in TEXTS if k.name in ("job, event 'header' is no JSON", "job, head.part NULL")]
    assert len(bad) == 2
    for number, kind in enumerate(bad):
        kind.make(good, tmp_path / f"bad-{number}.ocmm")
    (tmp_path / "text.ocmm").write_text("no job")
    (tmp_path / "folder.ocmm").mkdir()
    os.mkfifo(tmp_path / "pipe.ocmm")
    told: list[OcmmError] = []
    parts = parts_of_batch(tmp_path, "B", told.append)
    assert [part.serial for part in parts] == ["7"]
    names = {"bad-0.ocmm", "bad-1.ocmm", "text.ocmm", "folder.ocmm", "pipe.ocmm"}
    assert {name for name in names if any(name in fault.what for fault in told)} == names
    assert len(told) == len(names)
    require_new_serial(tmp_path, "B", "8")
    with pytest.raises(OcmmError, match="already measured"):
        require_new_serial(tmp_path, "B", "7")
