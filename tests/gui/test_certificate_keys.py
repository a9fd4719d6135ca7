"""The certificate keys of the pages Calibration and Probe: real windows, files, and a reader."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.records import CalibrationStore, ProbeStore
from ocmm_core.export.certificate import Dcc, check_dcc_seal
from ocmm_core.seals import KeyFolder, SealWord
from tests.gui import test_maintain_calibration as of_cameras
from tests.gui import test_probe_page as of_probe
from tests.host import HANG_MS


def _written(
    qtbot: QtBot, bench: of_cameras.Bench | of_probe.Bench, page: Qt.Key, folder: Path
) -> list[Dcc]:
    """Press the key of the certificate, accept the folder, and read back its files."""
    papers = bench.window.maintenance.tests.papers
    written: list[tuple[Path, ...]] = []
    papers.written.connect(written.append)
    widget = QApplication.focusWidget() or bench.window
    QTest.keyClick(widget, page, Qt.KeyboardModifier.ControlModifier)
    qtbot.waitUntil(papers.panel.isVisible, timeout=HANG_MS)
    field = papers.panel.findChild(QLineEdit, "path")
    assert field is not None
    field.setText(str(folder))
    QTest.keyClick(field, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: bool(written), timeout=HANG_MS)
    assert set(written[0]) == set(folder.iterdir())
    pages = sorted(folder.glob("*.pdf"))
    for pdf in pages:
        assert pdf.read_bytes().startswith(b"%PDF")
    found = [check_dcc_seal(path, KeyFolder()) for path in sorted(folder.glob("*.dcc.xml"))]
    assert [one.state.word for one in found] == [SealWord.SEALED] * len(pages)
    assert [one.dcc.number for one in found] == [pdf.stem for pdf in pages]
    return [one.dcc for one in found]


@pytest.mark.slow
@pytest.mark.usefixtures("qapp")
def test_the_key_on_calibration_writes_verification_and_calibration(
    qtbot: QtBot, tmp_path: Path
) -> None:
    store: CalibrationStore = of_cameras.fill(tmp_path)
    bench = of_cameras.Bench(qtbot, tmp_path)
    try:
        bench.open_page()
        found = _written(qtbot, bench, Qt.Key.Key_P, tmp_path / "papers")
    finally:
        bench.close()
    calibration, verification = found
    record = store.active()
    assert record is not None
    told = {one.value for one in calibration.quantities}
    # The focal lengths of both cameras, as they were stored.
    assert {camera.focal for camera in record.cameras} <= told
    # The last verification: 400 mm without an error.
    assert 400.0 in {one.value for one in verification.quantities}


@pytest.mark.slow
@pytest.mark.usefixtures("qapp")
@pytest.mark.usefixtures("fresh_sides")
def test_the_key_on_probe_writes_the_paper_of_the_mounted_tip(qtbot: QtBot, tmp_path: Path) -> None:
    store: ProbeStore = of_probe.fill(tmp_path)
    bench = of_probe.Bench(qtbot, tmp_path)
    try:
        bench.open_page()
        (found,) = _written(qtbot, bench, Qt.Key.Key_P, tmp_path / "papers")
    finally:
        bench.close()
    assert store.events
    # The tip that is mounted was qualified with this diameter last.
    assert 6.003 in {one.value for one in found.quantities}
