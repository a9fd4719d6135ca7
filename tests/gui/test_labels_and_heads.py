"""Words in a picture leave the marks in sight; the heads of a recall are in the language shown."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QFontMetricsF, QPaintEvent
from PySide6.QtWidgets import QApplication, QGridLayout, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.records import CalibrationStatus
from ocmm_core.export import FORMATS
from ocmm_core.settings import spec_of
from ocmm_gui.archive._recall_panel import RecallTable
from ocmm_gui.home._setting_row import SettingRow
from ocmm_gui.kit import (
    THEMES,
    ChoiceBox,
    DataTable,
    HintField,
    NumberTable,
    PaintedWidget,
    apply_theme,
    dress_application,
    said,
    said_word,
    text_font,
    use_language,
)
from ocmm_gui.scene import Orbit, StandingLabels, Tag
from ocmm_gui.scene._labels import LabelPlaces
from tests.gui.cut_words import cut_words, watched_words

BOUNDS = QRectF(0.0, 0.0, 400.0, 300.0)
SIZE = (40.0, 14.0)


@pytest.fixture
def german(qapp: QApplication) -> Iterator[None]:
    """Show German for one test."""
    assert use_language(qapp, "de")
    yield
    use_language(qapp, "en")


def test_a_word_covers_no_mark_where_it_has_other_room() -> None:
    anchor = (200.0, 150.0)
    plain = LabelPlaces(BOUNDS).place(*anchor, *SIZE)
    assert plain is not None
    mark = plain.center()
    marks = np.array([[mark.x(), mark.y()]])
    placed = LabelPlaces(BOUNDS, marks=marks).place(*anchor, *SIZE)
    assert placed is not None
    assert not placed.contains(mark)


def test_words_stand_apart_and_none_is_lost_among_many_marks() -> None:
    rng = np.random.default_rng(3)
    anchors = [(x, y) for x, y in rng.uniform(60.0, 240.0, (9, 2)).tolist()]
    marks = rng.uniform(40.0, 260.0, (60, 2))

    def placed(places: LabelPlaces) -> list[QRectF]:
        rects = [places.place(x, y, *SIZE) for x, y in anchors]
        return [rect for rect in rects if rect is not None]

    shown = placed(LabelPlaces(BOUNDS, marks=marks))
    assert len(shown) == len(anchors)
    for at, one in enumerate(shown):
        assert not any(one.intersects(other) for other in shown[:at])

    def covered(places: list[QRectF]) -> int:
        return sum(rect.contains(QPointF(x, y)) for rect in places for x, y in marks.tolist())

    assert covered(shown) < covered(placed(LabelPlaces(BOUNDS)))


@pytest.mark.usefixtures("qapp")
def test_standing_labels_stay_but_for_the_one_that_is_covered() -> None:
    rng = np.random.default_rng(4)
    tags = [Tag(np.zeros(3), f"label {number}", "#fff") for number in range(30)]
    anchors = rng.uniform(40.0, 260.0, (30, 2))
    labels, orbit = StandingLabels(tags), Orbit(np.zeros(3), 0.0, 0.0, 1.0, np.eye(3)[2])
    metrics = QFontMetricsF(text_font(12))

    def shown(orbit: Orbit, *taken: QRectF) -> dict[str, QRectF]:
        found = labels.placed(LabelPlaces(BOUNDS, taken), anchors, metrics, orbit, BOUNDS)
        return {one.tag.text: one.rect for one in found}

    first = shown(orbit)
    assert len(first) > 10
    ball = first["label 3"].adjusted(2.0, 2.0, -2.0, -2.0)
    beside = shown(orbit, ball)
    assert {name for name, rect in first.items() if beside.get(name) != rect} == {"label 3"}
    assert all(not rect.intersects(ball) for rect in beside.values())
    # Without the ball; then after a turn of the view, which places all labels again.
    assert shown(orbit) == first
    turned = shown(replace(orbit, azimuth=0.1), ball)
    assert all(not rect.intersects(ball) for rect in turned.values())
    assert turned["label 3"] != first["label 3"]
    # Another feature is labelled anew, before the others, which stay unless it covers them.
    before = shown(orbit)
    labels.tags = (Tag(np.zeros(3), "new", "#f00"), *tags[1:])
    anchors[0] = before["label 3"].center().toTuple()
    after = shown(orbit)
    assert "new" in after
    moved = {name for name, rect in before.items() if after.get(name) != rect} - {"label 0"}
    assert all(before[name].intersects(after["new"]) for name in moved)
    assert len(moved) < 4


@pytest.mark.usefixtures("german")
def test_the_heads_of_a_recall_are_german(qtbot: QtBot) -> None:
    table = RecallTable()
    qtbot.addWidget(table)
    heads = []
    for column in range(table.columnCount()):
        item = table.horizontalHeaderItem(column)
        assert item is not None
        heads.append(item.text())
    assert heads == ["Auftrag", "Merkmal", "Vorher", "Nachher", "Ergebnis", "Warum"]


@pytest.mark.usefixtures("german")
def test_a_calibration_and_a_format_are_named_in_german() -> None:
    for word in (*CalibrationStatus, "UNCALIBRATED"):
        assert said(f"{word} 047b4e59f8ba") == f"{said_word(word)} 047b4e59f8ba"
        named = said(f"{word} standard/T1 df266e5a588e due 2027-03-01")
        assert named == f"{said_word(word)} standard/T1 df266e5a588e, fällig 2027-03-01"
    # Names of products stay, their contents are translated.
    assert said_word(FORMATS["qif"].title) == "QIF-3.0-Ergebnisse"


WIDTHS = range(150, 420, 6)
SENTENCE = (
    "Entlang der Normalen antasten und so abheben. I wählt, wie die Seite gefunden wird, X kehrt "
    "den letzten Punkt um."
)


def test_no_line_of_a_cell_is_left_out(qtbot: QtBot) -> None:
    # Omissions end in dots: the picture differs if dots may be painted.
    table = DataTable("Table", (("A", ""), ("B", "")))
    apply_theme(table, THEMES["light"])
    qtbot.addWidget(table)
    table.setWordWrap(True)
    table.setRowCount(1)
    table.show_words(0, ("a", SENTENCE))
    table.resize(640, 300)
    table.show()
    for width in WIDTHS:
        table.setColumnWidth(1, width)
        table.resizeRowsToContents()
        table.setTextElideMode(Qt.TextElideMode.ElideRight)
        dotted = table.viewport().grab().toImage()
        table.setTextElideMode(Qt.TextElideMode.ElideNone)
        assert table.viewport().grab().toImage() == dotted, width


def test_a_path_shows_the_name_of_its_file_until_somebody_writes_in_it(qtbot: QtBot) -> None:
    field = HintField("/a/folder/of/which/nobody/wants/to/know/everything/verification_bar.toml")
    qtbot.addWidget(field)
    with qtbot.waitExposed(field):
        field.show()
    field.clearFocus()
    for width, shown in ((200, 1), (400, 2)):
        field.resize(width, 36)
        with watched_words() as painted:
            field.repaint()
        assert painted[0].text == "verification_bar.toml"
        assert [one.text[:1] for one in painted[1:]] == ["…"] * (shown - 1)
    field.setText("bar.toml")
    with watched_words() as painted:
        field.repaint()
    # Qt paints what fits.
    assert not painted


class Line(PaintedWidget):
    """Paints a word into a place of its own width."""

    def __init__(self) -> None:
        super().__init__("line", (200, 40), (20, 20))
        self.room = 200.0

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint it."""
        place = QRectF(0.0, 0.0, self.room, 40.0)
        self._painter().drawText(place, Qt.AlignmentFlag.AlignLeft, "NOT MEASURED")


Line.__module__ = "ocmm_gui.tried"


def test_a_word_that_is_cut_in_a_table_a_choice_or_a_picture_is_found(qtbot: QtBot) -> None:
    whole, table, line = QWidget(), DataTable("Results", [("Verdict", "")]), Line()
    choice = ChoiceBox("Choice", "", ["NOT MEASURED"])
    qtbot.addWidget(whole)
    layout = QVBoxLayout(whole)
    for widget in (table, choice, line):
        layout.addWidget(widget)
    table.setRowCount(1)
    table.show_words(0, ["NOT MEASURED"])
    whole.resize(400, 300)
    with qtbot.waitExposed(whole):
        whole.show()
    table.setColumnWidth(0, 150)
    assert not list(cut_words(whole))
    table.setColumnWidth(0, 70)
    assert ["cell 'NOT MEASURED'" in fault for fault in cut_words(whole)] == [True]
    table.setColumnWidth(0, 36)
    assert any("head 'Verdict'" in fault for fault in cut_words(whole))
    table.setColumnWidth(0, 150)
    choice.setFixedWidth(90)
    assert ["choice 'NOT MEASURED'" in fault for fault in cut_words(whole)] == [True]
    choice.setFixedWidth(300)
    line.room = 60.0
    assert ["Line: 'NOT MEASURED'" in fault for fault in cut_words(whole)] == [True]


def test_a_table_and_a_setting_keep_their_type_under_the_style_sheet(qtbot: QtBot) -> None:
    """A font set after the style sheet was applied to a widget is lost."""
    dress_application(THEMES["dark"])
    whole = QWidget()
    qtbot.addWidget(whole)
    layout = QVBoxLayout(whole)
    table = NumberTable("Keys", [("Key", "")], whole=False, font=text_font(15))
    grid = QGridLayout()
    row = SettingRow(spec_of("job.operator"), grid, 0, whole)
    layout.addWidget(table)
    layout.addLayout(grid)
    with qtbot.waitExposed(whole):
        whole.show()
    assert table.font().families() == text_font(15).families()
    assert (table.font().pixelSize(), row.field.font().pixelSize()) == (15, 17)
