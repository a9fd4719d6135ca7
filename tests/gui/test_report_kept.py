"""Entries for the report stay with the job, and every key that writes uses them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_core.export.template import Particulars, given_with, keep_given, template_in_use
from ocmm_gui.results import JobSource, ReportWriter
from tests.gui.conftest import OpenWindow
from tests.host import HANG_MS

KEY = Qt.Key
PATIENCE_MS = HANG_MS
TEMPLATE = """
schema = "ocmm.report-template/1"
unit = "mm"
name = "lab"
[laboratory]
name = "Laboratory of the shop"
"""


def test_the_form_keeps_with_the_job_and_follows_its_template(
    qtbot: QtBot, open_window: OpenWindow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    bench = open_window(speed=0.1, stay=True, out=tmp_path / "report")
    job = bench.bridge.station.job.path
    keep_given(job, Particulars(customer="Kept AG", remarks=("As agreed.",)))
    sheet = bench.window.sheets.report
    QTest.keyClick(bench.window, KEY.Key_F3)
    QTest.keyClick(bench.window.sheets.results, KEY.Key_F8)
    qtbot.waitUntil(sheet.isVisible, timeout=PATIENCE_MS)
    form = sheet.paper
    assert form.fields["customer"].text() == "Kept AG"
    QTest.keyClicks(form.fields["drawing"], "D-77")
    qtbot.waitUntil(lambda: given_with(job).drawing == "D-77", timeout=PATIENCE_MS)
    # Data without a field here are kept.
    assert given_with(job) == Particulars(
        customer="Kept AG", drawing="D-77", remarks=("As agreed.",)
    )
    # An incomplete path is reported next to its field, not in a banner.
    lab = tmp_path / "lab.toml"
    lab.write_text(TEMPLATE, encoding="utf-8")
    told: list[object] = []
    sheet.failed.connect(told.append)
    QTest.keyClicks(form.fields["template"], str(lab)[:-2])
    qtbot.waitUntil(form.fault.isVisible, timeout=PATIENCE_MS)
    assert told == []
    QTest.keyClicks(form.fields["template"], str(lab)[-2:])
    qtbot.waitUntil(lambda: not form.fault.isVisible(), timeout=PATIENCE_MS)
    assert form.paper().template.laboratory.name == "Laboratory of the shop"
    # Whoever edits the file sees it here.
    with qtbot.waitSignal(form.changed, timeout=PATIENCE_MS):
        lab.write_text(TEMPLATE.replace("shop", "town"), encoding="utf-8")
    qtbot.waitUntil(lambda: not sheet.is_previewing(), timeout=PATIENCE_MS)
    assert form.paper().template.laboratory.name == "Laboratory of the town"


def test_a_key_in_the_middle_of_a_job_writes_on_the_paper_of_the_station(
    qtbot: QtBot, open_window: OpenWindow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    template_in_use_folder = tmp_path / "data" / "ocmm" / "reports"
    template_in_use_folder.mkdir(parents=True)
    (template_in_use_folder / "template.toml").write_text(TEMPLATE, encoding="utf-8")
    assert template_in_use().parent == template_in_use_folder
    out = tmp_path / "report"
    bench = open_window(speed=0.1, stay=True, out=out)
    keep_given(bench.bridge.station.job.path, Particulars(customer="Kept AG"))
    # The writer of the key E: its format has no head, and every other one has.
    writer, source = ReportWriter(), JobSource.of_bridge(bench.bridge)
    writer.asked.connect(lambda _question: writer.agree())
    with qtbot.waitSignal(writer.written, timeout=PATIENCE_MS) as written:
        writer.write(source, ("json",), out)
    (path,) = [one for one in written.args[0].paths if one.suffix == ".json"]
    head = {one["name"]: one["value"] for one in json.loads(path.read_text("utf-8"))["head"]}
    assert head["Laboratory"] == "Laboratory of the shop"
    assert head["Customer"] == "Kept AG"
    # A damaged template is reported, and nothing is written.
    (template_in_use_folder / "template.toml").write_text("spoilt", encoding="utf-8")
    with qtbot.waitSignal(writer.failed, timeout=PATIENCE_MS):
        writer.write(source, ("json",), out)
    assert not writer.is_busy()
