"""Wizards start with numbers in range only, and a refusal ends with its cause."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.guided import ProcedureKind
from tests.core.calibration.test_procedure_tip import TIP, Tips
from tests.gui.wizard_bench import WizardBench

BALLS = ("nan", "inf", "-6", "0", "6000", "1e9", "1,234", "six", "6 °C", "300 in")
ROOMS = ("nan", "inf", "-6", "451", "68 °F", "20 in", "1,234")


@pytest.fixture
def bench(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[WizardBench]:
    Tips.at(tmp_path, qualified=True)
    made = WizardBench(qtbot, tmp_path, TIP)
    yield made
    made.close()


@pytest.mark.parametrize(
    ("kind", "key", "texts", "unit"),
    [
        (ProcedureKind.QUALIFICATION, "nominal", BALLS, "0.1 to 100 mm"),
        (ProcedureKind.QUALIFICATION, "temperature", ROOMS, "0 to 50 °C"),
        (ProcedureKind.TIP_CHECK, "temperature", ROOMS, "0 to 50 °C"),
        (ProcedureKind.PIVOT, "temperature", ROOMS, "0 to 50 °C"),
        (ProcedureKind.VERIFICATION, "temperature", ROOMS, "0 to 50 °C"),
        (ProcedureKind.RELOCATION, "temperature", ROOMS, "0 to 50 °C"),
    ],
)
def test_a_number_out_of_range_starts_nothing_and_its_refusal_ends_with_it(
    bench: WizardBench, kind: ProcedureKind, key: str, texts: tuple[str, ...], unit: str
) -> None:
    start = bench.wizard.start
    for text in texts:
        bench.begin(kind, **{key: text})
        assert bench.wizard.runner is None, text
        assert unit in start.trouble.text(), text
        QTest.keyClicks(start.fields[key], "1")
        assert not start.trouble.isVisible(), text
    assert not bench.errors
