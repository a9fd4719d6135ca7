"""A recall on paper: the sealed record is inside, and the file is read back before it counts."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import msgspec
import pytest

from ocmm_core.calibration.records import record_hash, seal
from ocmm_core.errors import StorageError
from ocmm_core.inspection.finished import (
    SCHEMA,
    Outcome,
    RecalledCharacteristic,
    RecalledJob,
    RecalledValue,
    RecallRecord,
)
from ocmm_gui.reports import _paper as pdf_writer
from ocmm_gui.reports import _recall as recall
from ocmm_gui.reports._archival import attached
from tests.gui.pdf_texts import drawn, texts

RECORD = RecallRecord(
    schema=SCHEMA,
    made_utc="2026-05-04T10:00:00+00:00",
    made_by="Ada",
    software="1.0",
    folders=("/jobs",),
    looked_at=3,
    jobs=(
        RecalledJob(
            path="/jobs/large.ocmm", sha256="a" * 64, job_uuid="u", part="PART", serial="7",
            created_utc="2026-05-01T10:00:00+00:00", rig="RIG", calibration="b" * 64,
            in_doubt=(1, 2), why=("The verification failed.",), later="c" * 64,
            judgement="The spots fit the later calibration alone.",
            characteristics=tuple(
                RecalledCharacteristic(
                    name=f"Bore {number}",
                    before=RecalledValue(value=20.0, expanded=0.01, verdict="CONFORM"),
                    after=RecalledValue(value=20.11, expanded=0.01, verdict="NOT CONFORM"),
                    outcome=Outcome.CHANGES, reason="Different verdict.", released=False,
                )
                for number in range(1, 61)
            ),
            released=(), points_sha256="",
        ),
    ),
    unread=("old.ocmm is damaged.",),
)  # fmt: skip


@pytest.mark.usefixtures("qapp")
def test_the_record_is_inside_and_every_page_names_it() -> None:
    canvas = recall.lay_out(RECORD)
    assert len(canvas.pages) > 1
    said = texts(canvas)
    assert "Not judged: old.ocmm is damaged." in said
    assert "Bore 60" in said
    made = recall.pdf_bytes(RECORD)
    assert made.startswith(b"%PDF-")
    assert attached(made)[1] == {"recall.json": seal(RECORD)}
    foot = f"Recall SHA-256 {record_hash(RECORD)}"
    for index in range(len(canvas.pages)):
        paint = partial(pdf_writer.paint_with_foot, canvas=canvas, index=index, foot=foot)
        page = drawn(paint)
        assert foot in page
        assert f"page {index + 1} of {len(canvas.pages)}" in page


@pytest.mark.usefixtures("qapp")
def test_every_page_of_simulated_jobs_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    real = RECORD.jobs[0]
    simulated = msgspec.structs.replace(real, simulated=True)
    feet: list[str] = []
    monkeypatch.setattr(
        recall, "paint_with_foot", lambda painter, canvas, index, foot: feet.append(foot)
    )
    for jobs, words in (
        ((simulated, simulated), "SIMULATED: No real part was measured."),
        ((simulated, real, real), "SIMULATED: 1 of 3 jobs."),
        ((real,), "Recall SHA-256"),
    ):
        record = msgspec.structs.replace(RECORD, jobs=jobs)
        feet.clear()
        recall.pdf_bytes(record)
        assert len(feet) == len(recall.lay_out(record).pages)
        for foot in feet:
            assert foot.startswith(words)
            assert record_hash(record) in foot


@pytest.mark.usefixtures("qapp")
def test_a_file_without_the_record_is_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    sealed, pages = tmp_path / "recall.json", tmp_path / "recall.pdf"
    sealed.write_bytes(seal(RECORD))
    monkeypatch.setattr(pdf_writer, "attached", lambda made: (1, {}))
    with pytest.raises(StorageError) as caught:
        recall.pdf_bytes(RECORD)
    assert caught.value.code == "export.pdf"
    assert recall.main([str(sealed), str(pages)]) == 2
    assert "without recall.json" in capsys.readouterr().err
    assert not pages.exists()
    monkeypatch.undo()
    assert recall.main([str(sealed), str(pages)]) == 0
    assert pages.exists()
