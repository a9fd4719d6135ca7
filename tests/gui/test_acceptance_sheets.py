"""The register of artefacts and gauge studies in the window."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.composition import AcceptanceBench, StationRequest
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.export.certificate import (
    Certificate,
    CertificateLine,
    CertificateRun,
    CertificateValue,
)
from ocmm_core.export.template import plain_paper
from ocmm_gui.acceptance import ArtefactSheet, StudySheet
from ocmm_gui.acceptance._study_sheet import StudyProgress, TypeOneStudy
from ocmm_gui.kit import THEMES, dress
from ocmm_shop.studies import load_study, study_of, type1_study
from tests.core.export.unsigned_dcc import dcc_bytes
from tests.host import HANG_MS
from tests.shop.studies.study_site import jobs_of

_OF_SPHERE = {
    "id": "S-7", "name": "Ceramic sphere", "serial": "4711", "laboratory": "Lab",
    "certificate": "C-1", "due_utc": "2099-12-31", "sizes": "24.9987", "expanded": "0.0003",
    "expansion": "5.5e-6", "expansion_sigma": "5e-7",
}  # fmt: skip


def _bench(folder: Path) -> AcceptanceBench:
    request = StationRequest(plan=resource("plans", "quick.toml"), out=folder / "job")
    return AcceptanceBench(request, folder=folder / "tests", register=folder / "artefacts")


@pytest.fixture
def sheet(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[ArtefactSheet]:
    made = ArtefactSheet(_bench(tmp_path), lambda: "technician")
    made.resize(1280, 720)
    with qtbot.waitActive(made):
        made.show()
        made.activateWindow()
    made.open()
    _settled(qtbot, made)
    yield made
    made.close_work()
    made.close()
    made.deleteLater()


def _settled(qtbot: QtBot, sheet: ArtefactSheet) -> None:
    """Wait until the register was read and written."""
    qtbot.waitUntil(lambda: not sheet.is_reading(), timeout=HANG_MS)


def _typed(sheet: ArtefactSheet, **changes: str) -> None:
    for key, text in {**_OF_SPHERE, **changes}.items():
        sheet.form.fields[key].setText(text)


def test_an_artefact_is_typed_listed_renewed_and_removed_by_keys(
    qtbot: QtBot, sheet: ArtefactSheet
) -> None:
    failed: list[OcmmError] = []
    sheet.failed.connect(failed.append)
    sheet.form.kind.setCurrentIndex(0)
    _typed(sheet)
    QTest.keyClick(sheet.form.fields["id"], Qt.Key.Key_F8)
    _settled(qtbot, sheet)
    assert sheet.table.rowCount() == 1, failed
    words = sheet.table.cells(0)
    assert words[:4] == ("S-7", "sphere", "4711", "0.30")
    assert words[5] == "2099-12-31"
    assert "▲" not in words[6]
    # The same certificate twice is a typing mistake; a newer one replaces it.
    _typed(sheet)
    QTest.keyClick(sheet.form.fields["id"], Qt.Key.Key_F8)
    _settled(qtbot, sheet)
    assert "is there already" in failed.pop().what
    sheet.table.setFocus()
    QTest.keyClick(sheet.table, Qt.Key.Key_F10)
    assert sheet.form.fields["sizes"].text() == "24.9987"
    sheet.form.fields["certificate"].setText("C-2")
    # Half a millimetre of U: too coarse for every test, with a sentence for each.
    sheet.form.fields["expanded"].setText("0.5")
    QTest.keyClick(sheet.form.fields["id"], Qt.Key.Key_F8)
    _settled(qtbot, sheet)
    assert failed == []
    assert sheet.table.rowCount() == 1
    assert "SPHERE-25" in sheet.table.cells(0)[6]
    assert "certified to 500.0 um" in sheet.reasons.text()
    # An invalid number is named.
    _typed(sheet, id="S-8", expanded="small")
    QTest.keyClick(sheet.form.fields["id"], Qt.Key.Key_F8)
    _settled(qtbot, sheet)
    assert "'expanded' is 'small', which is not a number" in failed.pop().what
    _typed(sheet, id="S-8", due_utc="2020-01-01")
    QTest.keyClick(sheet.form.fields["id"], Qt.Key.Key_F8)
    _settled(qtbot, sheet)
    assert "expired on 2020-01-01" in failed.pop().what
    sheet.table.setFocus()
    QTest.keyClick(sheet.table, Qt.Key.Key_Delete, Qt.KeyboardModifier.ControlModifier)
    assert sheet.sure.isVisible()
    sheet.sure.agree()
    _settled(qtbot, sheet)
    assert sheet.table.rowCount() == 0
    left: list[int] = []
    sheet.left.connect(lambda: left.append(1))
    sheet.table.setFocus()
    QTest.keyClick(sheet.table, Qt.Key.Key_Escape)
    assert left == [1]


def _dcc() -> bytes:
    line = CertificateLine("Diameter", 24.9987, 25.0, 0.0003, 0.001)
    run = CertificateRun(
        status="afterAdjustment", made_utc="2026-11-01T08:00:00+00:00", made_by="Lab",
        temperature_c=20.0, rule="none", lines=(), passed=True, record="r" * 64,
        data_sha256="d" * 64,
    )  # fmt: skip
    del line
    return dcc_bytes(
        Certificate(
            title="Calibration of a sphere", number="L-2026-1", item="Ceramic sphere 25",
            identifications=(("serial", "4711"),), method="comparison", norms=(),
            software="test", runs=(run,),
            values=(CertificateValue("Diameter", 24.9987, "\\milli\\metre", 0.0003),),
            artefacts=(), volume="", begin_utc="2026-11-01T08:00:00+00:00",
            end_utc="2026-11-01T08:00:00+00:00", previous="", paper=plain_paper(),
        )
    )  # fmt: skip


@pytest.mark.slow
def test_nobody_types_a_number_of_a_digital_certificate(
    qtbot: QtBot, sheet: ArtefactSheet, tmp_path: Path
) -> None:
    path = tmp_path / "sphere.xml"
    path.write_bytes(_dcc())
    sheet.read(path)
    qtbot.waitUntil(lambda: sheet.form.fields["sizes"].text() != "", timeout=HANG_MS)
    assert sheet.form.fields["sizes"].text() == "24.9987"
    assert float(sheet.form.fields["expanded"].text()) == 0.0003
    assert sheet.form.fields["certificate"].text() == "L-2026-1"
    assert sheet.form.texts()["source"] == "DCC L-2026-1, XML signature NONE"
    assert len(sheet.form.texts()["certificate_sha256"]) == 64
    # A changed value is not that of the certificate.
    sheet.form.fields["expanded"].setText("0.0001")
    assert sheet.form.texts()["source"] == "typed"
    assert sheet.form.texts()["certificate_sha256"] == ""
    failed: list[OcmmError] = []
    sheet.failed.connect(failed.append)
    sheet.read(tmp_path / "nothing.xml")
    qtbot.waitUntil(lambda: bool(failed), timeout=HANG_MS)


@pytest.fixture
def study(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[StudySheet]:
    made = StudySheet(lambda: tmp_path, None, None)
    made.resize(1280, 720)
    with qtbot.waitActive(made):
        made.show()
        made.activateWindow()
    made.open()
    yield made
    made.close_work()
    made.close()
    made.deleteLater()


@pytest.mark.slow
@pytest.mark.usefixtures("fresh_sides")
def test_a_study_is_drawn_followed_and_analysed(
    qtbot: QtBot, study: StudySheet, tmp_path: Path
) -> None:
    failed: list[OcmmError] = []
    study.failed.connect(failed.append)
    QTest.keyClick(study.table, Qt.Key.Key_F8)
    assert failed.pop().what == "No plan is open."
    study.fields["trials"].setText("1")
    study.draw(tmp_path / "too_small.toml")
    assert "are the least" in failed.pop().what
    study.fields["trials"].setText("3")
    study.table.setFocus()
    QTest.keyClick(study.table, Qt.Key.Key_F6)
    assert study.store.isVisible()
    field = QApplication.focusWidget()
    assert field is not None
    QTest.keyClick(field, Qt.Key.Key_Return)
    path = tmp_path / "STUDY-1.toml"
    plan = load_study(path)
    assert len(plan.runs) == 90
    first = plan.runs[0]
    assert first.code in study.progress.text()
    # Nothing is measured yet; drawn once more it would be another study.
    study.draw(path)
    assert "the file exists" in failed.pop().what
    study.show_progress()
    qtbot.waitUntil(lambda: not study.is_working(), timeout=HANG_MS)
    assert study.progress.text().startswith("0 of 90 measured.")
    study.analyse()
    qtbot.waitUntil(lambda: bool(failed), timeout=HANG_MS)
    assert failed.pop().remedy


def test_components_operators_and_verdict_are_those_of_the_core(
    study: StudySheet, tmp_path: Path
) -> None:
    study.draw(tmp_path / "plan.toml")
    plan = load_study(tmp_path / "plan.toml")
    report = study_of(plan, jobs_of(plan))
    study._show(report)  # noqa: SLF001 - as if it had been analysed
    (one,) = report.characteristics
    assert one.study is not None
    words = study.table.cells(0)
    assert words[0] == "WIDTH"
    assert words[2] == f"{one.study.study_percent:.1f}"
    assert words[6] == one.study.word
    assert study.word.text() == one.study.word.upper()
    assert one.study.word in study.components.word()
    assert "µm" in study.operators.word()
    assert "SIMULATED" in study.about()
    study._show(StudyProgress(90, None))  # noqa: SLF001 - as if it had been analysed
    assert "Complete" in study.progress.text()
    for theme in THEMES.values():
        dress(study, theme)
        for number in range(3):
            study.tabs.show_plot(number)
            assert not study.grab().isNull()
    # A study with a hole is refused with its sentence, not filled up.
    parts = report.characteristics[0].values
    assert parts is not None
    assert parts.shape == (10, 3, 3)
    comparison = jobs_of(plan, left_out=1)
    study._show(study_of(plan, comparison))  # noqa: SLF001 - as if it had been analysed
    assert study.word.text() == "NO STUDY"
    assert "missing or suspect" in study.message.text()


def test_a_run_of_one_part_shows_cg_and_cgk(study: StudySheet) -> None:
    values = 12.0 + 0.0025 * np.random.default_rng(4).standard_normal(25)
    found = type1_study(values, 12.0, 0.12)
    study._show(TypeOneStudy(found, values, "WIDTH", 12.0, 0.12, simulated=True))  # noqa: SLF001 - as if it had been analysed
    assert study.tabs.plot() == "Type 1"
    assert f"Cg {found.cg:.2f}" in study.run.word()
    assert study.word.text() == ("CAPABLE" if found.capable else "NOT CAPABLE")
    assert study.about().startswith("SIMULATED")
    assert not study.grab().isNull()
