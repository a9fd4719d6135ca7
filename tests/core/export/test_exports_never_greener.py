"""Over many jobs no file and no message promises more than the worst characteristic."""

from __future__ import annotations

import csv
import io
import json
from collections import Counter

import openpyxl
import pytest
from lxml import etree

from ocmm_core.export import EXPORTERS
from ocmm_core.export.aqdef._head import read_transfer
from ocmm_core.export.qif._writer import NAMESPACE
from ocmm_core.export.report import polyworks_profile, read_report
from ocmm_core.inspection.evaluation import FeatureState, JobView
from ocmm_core.station.stream import verdict_line
from ocmm_core.tolerances.decisions import WORST_FIRST, Verdict
from tests.core.export.sample_report import sample_report
from tests.generated_jobs import generated_job
from tests.host import amount

JOBS, CHUNKS = amount(120, 1000), 4
SHEETS = 20
"""Every so manieth job goes into a workbook: reading one takes longer than all else together."""

Q = f"{{{NAMESPACE}}}"
TEST = {
    Verdict.CONFORM: "Pass",
    Verdict.NOT_CONFORM: "Fail",
    Verdict.NOT_PROVEN: "Not proven",
    Verdict.NOT_MEASURED: "Not measured",
    Verdict.PROVISIONAL: "Not measured",
}
PASS = {Verdict.CONFORM: "PASS", Verdict.NOT_CONFORM: "FAIL", Verdict.NOT_PROVEN: "INDETERMINATE"}


def expected(job: JobView) -> tuple[str, dict[str, Verdict | None], list[Verdict]]:
    """Return the part's word, the verdict of each feature and of each characteristic."""
    verdicts = [item.verdict for item in job.characteristics]
    worst = min(verdicts, key=WORST_FIRST.index, default=None)
    missing = [item for item in job.features if item.state is not FeatureState.DONE]
    if worst in (Verdict.NOT_CONFORM, Verdict.NOT_PROVEN):
        word = "PART DOES NOT CONFORM" if worst is Verdict.NOT_CONFORM else "NOT PROVEN"
    elif missing or worst in (Verdict.NOT_MEASURED, Verdict.PROVISIONAL):
        word = "NOT COMPLETE"
    else:
        word = "PART CONFORMS" if verdicts else "NO TOLERANCE"
    features = {
        item.name: min(
            (r.verdict for r in job.characteristics if item.name in r.features),
            key=WORST_FIRST.index,
            default=None,
        )
        for item in job.features
    }
    return word, features, verdicts


@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_every_file_says_what_is_true(chunk: int) -> None:
    profile = polyworks_profile()
    for seed in range(chunk, JOBS, CHUNKS):
        job, nominals = generated_job(seed)
        word, features, verdicts = expected(job)
        data = sample_report(job, nominals=nominals)
        files: dict[str, bytes] = {}
        for name in ("polyworks", "qif", "dfq", "json"):
            if name != "dfq" or verdicts:
                files |= EXPORTERS[name].contents((data,), profile)
        for name in files:
            assert ("INCOMPLETE" in name) == (not job.part_verdict.complete), (seed, name)
            assert ("SIMULATED" in name) == job.simulated, (seed, name)
        by_end = {name.rpartition("_")[2].rpartition(".")[2]: text for name, text in files.items()}

        told = read_report(by_end["json"])
        assert told.part_verdict is not None
        assert told.part_verdict.word == word, seed
        assert told.simulated == job.simulated
        assert [Verdict(item.verdict) for item in told.results] == verdicts, seed
        for item in told.results:
            # A program that takes a number requests no verdict.
            undecided = item.verdict in ("NOT MEASURED", "PROVISIONAL")
            numbers = (item.measured, item.deviation, item.uncertainty)
            assert all((number is None) == undecided for number in numbers), seed
        assert {
            item.name: None if item.verdict is None else Verdict(item.verdict)
            for item in told.features
        } == features, seed

        report = next(text for name, text in files.items() if name.endswith("_report.csv"))
        rows = list(csv.DictReader(io.StringIO(report.decode("utf-8-sig"))))
        assert [row["Test"] for row in rows] == [TEST[verdict] for verdict in verdicts], seed

        root = etree.fromstring(by_end["qif"])
        told_parts = {one.text for one in root.iter(f"{Q}InspectionStatusEnum")}
        part = {"PART CONFORMS": "PASS", "PART DOES NOT CONFORM": "FAIL"}.get(word, "UNKNOWN")
        assert told_parts == {part}, seed
        statuses = Counter(one.text for one in root.iter(f"{Q}CharacteristicStatusEnum"))
        assert statuses == Counter(PASS[one] for one in verdicts if one in PASS), seed

        if verdicts:
            transfer = read_transfer(by_end["dfq"])
            # Readers judge by limits and value; a note shows the rest.
            for index, verdict in enumerate(verdicts, start=1):
                remark = transfer.text("K0009", index)
                assert remark == (None if verdict is Verdict.CONFORM else verdict.value), seed
                fields = transfer.values[0][index - 1]
                value, attribute = fields["K0001"], fields["K0002"]
                undecided = verdict in (Verdict.NOT_MEASURED, Verdict.PROVISIONAL)
                assert (value == "") == (attribute == "256") == undecided, seed

        line = json.loads(verdict_line(job, 7))
        assert (line["part"], line["simulated"]) == (word, job.simulated), seed
        assert [Verdict(item["verdict"]) for item in line["characteristics"]] == verdicts
        assert {
            item["name"]: None if item["verdict"] is None else Verdict(item["verdict"])
            for item in line["features"]
        } == features, seed


def test_every_workbook_says_what_is_true() -> None:
    for seed in range(0, JOBS, SHEETS):
        job, nominals = generated_job(seed)
        word, _, verdicts = expected(job)
        ((_, content),) = (
            EXPORTERS["xlsx"]
            .contents((sample_report(job, nominals=nominals),), polyworks_profile())
            .items()
        )
        book = openpyxl.load_workbook(io.BytesIO(content), read_only=False)
        cells = [str(cell.value) for sheet in book for row in sheet.iter_rows() for cell in row]
        assert word in cells, seed
        told = Counter(cell for cell in cells if cell in set(TEST.values()))
        assert told == Counter(TEST[verdict] for verdict in verdicts), seed
