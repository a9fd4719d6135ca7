"""Words in a picture leave the marks in sight; the heads of a recall are in the language shown."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from PySide6.QtCore import QPointF, QRectF
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_gui.archive._recall_table import RecallTable
from ocmm_gui.kit import use_language
from ocmm_gui.views._labels import place_labels

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
    (plain,) = place_labels([anchor], [SIZE], BOUNDS)
    assert plain is not None
    mark = plain.center()
    (placed,) = place_labels([anchor], [SIZE], BOUNDS, marks=np.array([[mark.x(), mark.y()]]))
    assert placed is not None
    assert not placed.contains(mark)


def test_words_stand_apart_and_none_is_lost_among_many_marks() -> None:
    rng = np.random.default_rng(3)
    anchors = [(x, y) for x, y in rng.uniform(60.0, 240.0, (9, 2)).tolist()]
    marks = rng.uniform(40.0, 260.0, (60, 2))
    rects = place_labels(anchors, [SIZE] * 9, BOUNDS, marks=marks)
    shown = [rect for rect in rects if rect is not None]
    assert len(shown) == len(anchors)
    for at, one in enumerate(shown):
        assert not any(one.intersects(other) for other in shown[:at])

    def covered(places: list[QRectF]) -> int:
        return sum(rect.contains(QPointF(x, y)) for rect in places for x, y in marks.tolist())

    plain = [rect for rect in place_labels(anchors, [SIZE] * 9, BOUNDS) if rect is not None]
    assert covered(shown) < covered(plain)


@pytest.mark.usefixtures("german")
def test_the_heads_of_a_recall_are_german(qtbot: QtBot) -> None:
    table = RecallTable()
    qtbot.addWidget(table)
    heads = []
    for column in range(table.columnCount()):
        item = table.horizontalHeaderItem(column)
        assert item is not None
        heads.append(item.text())
    assert heads == ["Auftrag", "Merkmal", "Vor", "Nach", "Ergebnis", "Warum"]
