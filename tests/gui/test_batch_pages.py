"""The pages of a batch: every characteristic with its chart, its signals, and their meaning."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from ocmm_core.export.template import plain_paper
from ocmm_core.inspection.finished import Comparison
from ocmm_gui.reports import _batch as pages
from ocmm_gui.results import CompareSheet
from tests.core.export.test_batch_table import COMPARISON, trend
from tests.gui.pdf_texts import texts
from tests.host import HANG_MS


def _told(sheet: CompareSheet, path: Path) -> bool:
    return str(path) in sheet.about()


def said(found: Comparison) -> str:
    return " ".join(texts(pages.lay_out(found, plain_paper())).split())


@pytest.mark.usefixtures("qapp")
def test_every_characteristic_has_its_indices_its_chart_and_its_signals() -> None:
    told = said(COMPARISON)
    assert "SIMULATED: No real part was measured." in told
    for one in COMPARISON.trends:
        able, chart = one.capability, one.chart
        assert able is not None
        assert chart is not None
        assert f"{able.cpk_low:.2f} to {able.cpk_high:.2f}" in told
        assert f"UCL {chart.high:.4f}" in told
        assert chart.signals
        for _, why in chart.signals:
            assert f"{why.rule}, {why.value}." in told
    assert told.count("Not in control") == len(COMPARISON.trends)
    assert "6 of 7" in told


@pytest.mark.usefixtures("qapp")
def test_a_process_in_control_has_no_caution() -> None:
    calm = COMPARISON.trends[0]
    assert calm.chart is not None
    calm = replace(calm, chart=replace(calm.chart, signals=()))
    assert calm.caution == ""
    assert "Not in control" not in said(replace(COMPARISON, trends=(calm,)))
    # Nothing that could be computed is nothing to be drawn.
    empty = replace(calm, parts=(), chart=None, capability=None, why_not="Too few values.")
    assert "Too few values." in said(replace(COMPARISON, trends=(empty,), simulated=False))


@pytest.mark.usefixtures("qapp")
def test_the_pages_are_numbered_and_whole() -> None:
    many = replace(COMPARISON, trends=tuple(trend(f"Bore {n}", "BORE") for n in range(40)))
    canvas = pages.lay_out(many, plain_paper())
    assert len(canvas.pages) > 10
    assert pages.batch_pdf(many, plain_paper()).startswith(b"%PDF")


def test_the_sheet_writes_table_or_pages_by_the_name_of_the_file(
    qtbot: QtBot, tmp_path: Path
) -> None:
    sheet = CompareSheet()
    qtbot.addWidget(sheet)
    sheet.resize(1280, 720)
    sheet.show()
    sheet._show(COMPARISON)  # noqa: SLF001 -- as if a folder had been read
    assert "to" not in sheet.table.cells(0)[5]
    able = COMPARISON.trends[0].capability
    assert able is not None
    assert sheet.table.cells(0)[5] == f"{able.cpk_low:.2f} – {able.cpk_high:.2f}"
    assert "Not in control" in sheet.words.text()
    for name, start in (("b.csv", b"\xef\xbb\xbf"), ("b.PDF", b"%PDF")):
        path = tmp_path / name
        sheet.target.given.emit(path)
        qtbot.waitUntil(partial(_told, sheet, path), timeout=HANG_MS)
        assert path.read_bytes().startswith(start)
    sheet.close_work()
