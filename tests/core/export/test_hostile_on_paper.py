"""Names that attack a paper, and jobs far larger than usual, through every format of a report."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from ocmm_core.errors import InputError
from ocmm_core.export import EXPORTERS
from ocmm_core.export.certificate import read_dcc
from ocmm_core.export.report import ReportData
from ocmm_core.export.template import Particulars, paper_of, plain_paper
from ocmm_core.features.shapes import NominalFeature, Shape, element
from ocmm_core.tolerances.decisions import Verdict
from tests.core.calibration.made_records import MADE, make_record
from tests.core.export.dcc_schema import dcc_schema
from tests.core.export.sample_report import feature, point, result, sample_report, sample_view
from tests.core.export.sample_report import write_incomplete as write_report
from tests.core.export.unsigned_dcc import dcc_bytes

NASTY = {
    "long": "Kunde GmbH " * 900,
    "endless": "X" * 10_000,
    "turned": "ACME \u202egnp.exe\u202c \u2066abc\u2069 \u200f\u200b",
    "control": "a\x00b\x07c\x1bd\x7fe\x85f\u2028g\ud800h",
    "markup": "<b>bold</b>&amp;<img src=x onerror=1><!--]]><script>",
    "formula": "=cmd|'/c calc'!A0",
    "lines": "line1\r\nK0100 99\r\nK1001/1 evil\tTab",
    "aqdef": "x\x0fy\x14z",
}
BIDI = "\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"


def attacked(text: str) -> ReportData:
    given = Particulars(
        customer=text, customer_address=text, order=text, drawing=text, revision=text,
        machine=text, place=text, received=text, deviations=(text,), remarks=(text,), number=text,
    )  # fmt: skip
    data = sample_report()
    head = replace(data.head, operator=text, serial=text, part=text)
    return replace(data, head=head, paper=replace(plain_paper(), given=given))


@pytest.mark.parametrize("name", sorted(NASTY))
@pytest.mark.parametrize("format_name", sorted(EXPORTERS))
def test_a_hostile_name_is_text_in_every_format(
    name: str, format_name: str, tmp_path: Path
) -> None:
    # Every file is read back and compared with the job before it is there.
    paths = write_report(attacked(NASTY[name]), (format_name,), tmp_path)
    assert paths
    for path in paths:
        content = path.read_bytes()
        assert b"\x00" not in content or path.suffix in (
            ".xlsx", ".pwmacro", ".ply", ".parquet",
        )  # fmt: skip
        if path.suffix in (".csv", ".json", ".qif"):
            text = content.decode("utf-8-sig")
            assert not set(BIDI) & set(text), path
        if path.suffix == ".qif":
            etree.fromstring(content)
        if path.suffix == ".json":
            json.loads(content)
        if path.suffix == ".dfq":
            lines = content.decode("cp1252").split("\r\n")
            assert sum(line.startswith("K0100") for line in lines) == 1


@pytest.mark.parametrize("name", sorted(NASTY))
def test_a_hostile_name_is_text_in_a_certificate(
    name: str, tmp_path: Path, reference: Path
) -> None:
    from ocmm_core.calibration.records import CalibrationStore
    from ocmm_core.export.certificate import certificate_of_calibration

    store = CalibrationStore(tmp_path / "cameras")
    store.accept(make_record(), "Ada", "first", MADE)
    given = Particulars(customer=NASTY[name], place=NASTY[name], deviations=(NASTY[name],))
    paper = certificate_of_calibration(store, replace(plain_paper(), given=given))
    content = dcc_bytes(replace(paper, item=NASTY[name]))
    dcc_schema(reference).assertValid(etree.fromstring(content))
    assert read_dcc(content).number == paper.number
    assert not set(BIDI) & set(content.decode())


def test_what_no_paper_holds_is_refused_when_it_is_given(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="'customer' is too long"):
        paper_of(tmp_path / "a.ocmm", Particulars(customer=NASTY["endless"]))


def large(features: int) -> ReportData:
    """Return a job with 20 points and two characteristics on each of many bores."""
    found, nominals = [], []
    for number in range(features):
        name, at = f"BORE_{number}", np.array([10.0 * (number % 50), 10.0 * (number // 50), 1000.0])
        turns = 2.0 * np.pi * np.arange(20) / 20.0
        touches = [
            point(20 * number + k + 1, name, tuple(at + 5.0 * np.array([np.cos(a), np.sin(a), 0])),
                  (float(np.cos(a)), float(np.sin(a)), 0.0))
            for k, a in enumerate(turns)
        ]  # fmt: skip
        circle = element(at.tolist(), [0.0, 0.0, 1.0], 10.0)
        found.append(feature(name, Shape.CIRCLE, touches, circle, [0.001] * 20))
        nominals.append(
            NominalFeature(
                name=name, shape=Shape.CIRCLE, points=20, point=(1.0, 2.0, 3.0), diameter=20.0
            )
        )
    results = tuple(
        result(f"Bore {number} {way}", 20.001, Verdict.CONFORM, features=(f"BORE_{number}",))
        for number in range(features)
        for way in ("x", "y")
    )
    view = replace(sample_view(), features=tuple(found), characteristics=results)
    data = sample_report(view=view, nominals=nominals)
    when = dict.fromkeys(data.taken_utc, "2026-03-02T07:10:00+00:00")
    return replace(data, taken_utc=when)


def test_a_transfer_file_of_many_characteristics_takes_time_by_their_number(tmp_path: Path) -> None:
    """Reading back was quadratic: 56 s for 1,000 characteristics."""
    seconds = []
    for number, features in enumerate((50, 400)):
        data = large(features)
        begun = time.process_time()
        write_report(data, ("dfq",), tmp_path / str(number))
        seconds.append(time.process_time() - begun)
    # Eight times the characteristics: 64 times the time if quadratic, 8 if not.
    assert seconds[1] < 24.0 * max(seconds[0], 0.05), seconds
