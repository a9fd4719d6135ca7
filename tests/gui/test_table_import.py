"""The import page of a table: shown before anything is taken, changeable, with an account."""

from __future__ import annotations

from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from ocmm_core.inspection.plan import FeatureTable, preview_features
from ocmm_core.tables import TableOptions
from ocmm_gui.plan_editor._table_import import TableImport
from tests.host import HANG_MS


@pytest.fixture
def page(qtbot: QtBot) -> TableImport:
    made = TableImport()
    qtbot.addWidget(made)
    made.show()
    return made


def _heads(page: TableImport) -> list[str]:
    items = [page.table.horizontalHeaderItem(place) for place in range(page.table.columnCount())]
    return [item.text() for item in items if item is not None]


def test_lines_columns_and_unit_are_shown(page: TableImport, tmp_path: Path) -> None:
    file = tmp_path / "features.csv"
    rows = "".join(f"B{row};circle;{row},25;-3,5;10;\n" for row in range(40))
    file.write_text(f"sep=;\n# drawing\nname;shape;y [inch];x [inch];z [inch];\n{rows}", "utf-16")
    page.open_table(file)
    page.show_preview(preview_features(file, TableOptions()))
    assert _heads(page)[2:7] == ["name", "shape", "y", "x", "z"]
    assert page.table.rowCount() == 16
    assert page.table.words(1)[1] == "comment"
    assert page.table.words(15)[:4] == ("43", "", "B39", "circle")
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
