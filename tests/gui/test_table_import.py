"""The import page of a table: shown before anything is taken, changeable, with an account."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication, QLineEdit
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.cameras import KnownPointsProcedure
from ocmm_core.calibration.guided import ProcedureKind
from ocmm_core.inspection.plan import FeatureTable, feature_table
from ocmm_core.tables import TableOptions, TablePreview, preview_table
from ocmm_gui.kit import ChoiceBox, TableImport
from tests.gui.wizard_bench import WizardBench
from tests.host import HANG_MS


@pytest.fixture
def page(qtbot: QtBot) -> TableImport:
    made = TableImport("name,shape,x,y,z,-")
    qtbot.addWidget(made)
    made.show()
    return made


def preview_features(path: Path, options: TableOptions) -> TablePreview[FeatureTable]:
    return preview_table(path, options, feature_table)


def _heads(page: TableImport) -> list[str]:
    items = [page.table.horizontalHeaderItem(place) for place in range(page.table.columnCount())]
    return [item.text() for item in items if item is not None]


def test_lines_columns_and_unit_are_shown(page: TableImport, tmp_path: Path) -> None:
    file = tmp_path / "features.csv"
    rows = "".join(f"B{row};plane;{row},25;-3,5;10;\n" for row in range(40))
    file.write_text(f"sep=;\n# drawing\nname;shape;y [inch];x [inch];z [inch];\n{rows}", "utf-16")
    page.open_table(file)
    page.show_preview(preview_features(file, TableOptions()))
    assert _heads(page)[2:7] == ["name", "shape", "y", "x", "z"]
    assert page.table.rowCount() == 16
    assert page.table.cells(1)[1] == "is a comment"
    assert page.table.cells(15)[:4] == ("43", "", "B39", "plane")
    for part in ("40 rows read", "Unit inch", "Decimal comma", "27 lines"):
        assert part in page.summary.text()
    taken: list[FeatureTable] = []
    page.taken.connect(taken.append)
    page.take.click()
    assert taken[0].features[1].point == pytest.approx((-88.9, 31.75, 254.0))


def test_an_ambiguous_table_is_settled_on_the_page(
    page: TableImport, qtbot: QtBot, tmp_path: Path
) -> None:
    file = tmp_path / "features.csv"
    file.write_text("name;shape;x;y;z\nA;Plane;1.234;2,5;3\n")
    page.open_table(file)
    page.changed.connect(lambda path, options: page.show_preview(preview_features(path, options)))
    page.show_preview(preview_features(file, TableOptions()))
    assert not page.take.isEnabled()
    assert "'1.234' could be 1.234 or 1234" in page.summary.text()
    with qtbot.waitSignal(page.changed, timeout=HANG_MS):
        page.decimal.choose("comma")
    assert page.take.isEnabled()
    with qtbot.waitSignal(page.taken, timeout=HANG_MS) as caught:
        page.take.click()
    assert caught.args[0].features[0].point == (1234.0, 2.5, 3.0)


def test_fields_have_names_for_screen_readers(page: TableImport) -> None:
    for widget in (page.unit, page.columns, page.skip, page.decimal, page.table, page.take):
        assert widget.accessibleName()


def test_reference_points_are_shown_before_the_cameras_are_calibrated(
    qtbot: QtBot, qapp: QApplication, tmp_path: Path
) -> None:
    bench = WizardBench(qtbot, tmp_path)
    file = tmp_path / "cmm.csv"
    rows = "".join(f"P{row};{row},5;{2 * row};-3\n" for row in range(9))
    head = "# unit: mm\n# uncertainty: 0,002\n# frame: CMM\n"
    file.write_text(f"{head}Punkt;Y-Koordinate;X-Koordinate;Z [inch]\n{rows}")
    try:
        wizard = bench.wizard
        wizard.open(ProcedureKind.KNOWN_POINTS)
        field = wizard.start.fields["points"]
        assert isinstance(field, QLineEdit)
        field.setText(str(file))
        wizard.start.begin_button.click()
        assert wizard.currentWidget() is wizard.tables
        assert wizard.runner is None
        # One column in inch contradicts the header: nothing starts until the user states a unit.
        assert "the unit inch contradicts the unit mm in line 1" in wizard.tables.summary.text()
        assert not wizard.tables.take.isEnabled()
        with qtbot.waitSignal(wizard.tables.changed, timeout=HANG_MS):
            wizard.tables.unit.setText("inch")
        assert _heads(wizard.tables)[2:6] == ["name", "y", "x", "z"]
        wizard.tables.take.click()
        assert wizard.runner is not None
        procedure = wizard.runner.driver.procedure
        assert isinstance(procedure, KnownPointsProcedure)
        assert procedure.points.names[2] == "P2"
        assert procedure.points.positions_world[1].tolist() == [50.8, 38.1, -76.2]
        assert procedure.points.sigma == 0.0508
    finally:
        bench.close()


def test_a_declined_table_starts_nothing(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> None:
    bench = WizardBench(qtbot, tmp_path)
    file = tmp_path / "cmm.csv"
    file.write_text("# unit: mm\n# uncertainty: 0.002\n# frame: CMM\nx,y,z\n1,2,3\n4,5,6.5\n")
    try:
        bench.wizard.open(ProcedureKind.RELOCATION)
        start = bench.wizard.start
        control, world = start.fields["control"], start.fields["world"]
        assert isinstance(control, QLineEdit)
        assert isinstance(world, ChoiceBox)
        control.setText(str(file))
        world.choose("points")
        start.begin_button.click()
        assert bench.wizard.currentWidget() is bench.wizard.tables
        bench.wizard.tables.back.click()
        assert bench.wizard.currentWidget() is start
        assert bench.wizard.runner is None
    finally:
        bench.close()
