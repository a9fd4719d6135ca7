"""All characteristics of a job, one row each, and the part with its deviations as whiskers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QRectF, Signal
from PySide6.QtGui import QPaintEvent, QResizeEvent

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.tolerances.decisions import NO_DEVIATIONS, U_LABEL, CharacteristicResult, Verdict
from ocmm_gui import kit, scene, views
from ocmm_gui.kit import later, tr
from ocmm_gui.rendering import RenderMode

VERDICT_SIGNS = {
    Verdict.CONFORM: "✔",
    Verdict.NOT_CONFORM: "✖",
    Verdict.NOT_PROVEN: "▲",
    Verdict.NOT_MEASURED: "○",
    Verdict.PROVISIONAL: "◌",
}
"""A sign for each verdict, so that nothing depends on colour."""

_COLUMNS = (
    (later("Characteristic"), later("as in the plan")),
    (later("Of"), later("kind and features")),
    (later("Nominal"), later("{unit}, or degrees for angles")),
    (later("Measured"), later("{unit}, or degrees for angles")),
    (later("Deviation"), later("measured minus nominal")),
    (later("Limits"), later("of the deviation")),
    (U_LABEL, later("expanded uncertainty")),
    (later("Verdict"), later("the decision")),
)
_NUMBERS = range(2, 7)
_DEVIATION, _VERDICT = 4, 7
_ROW_PX = 34
_NARROW_PX = 860
_HEAD_PX = 13
_SMALLER_PX = 12, 11


class ResultTable(kit.DataTable):
    """Rows can be selected with the arrow keys."""

    result_chosen = Signal(str)

    def __init__(self) -> None:
        super().__init__(tr("Characteristics"), kit.with_unit(kit.tr_all(_COLUMNS)))
        self._results: tuple[CharacteristicResult, ...] = ()
        self._pixels = self._least = 0
        self.setFont(kit.text_font(15))
        self.horizontalHeader().setFont(kit.text_font(_HEAD_PX))
        self.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.setWordWrap(False)
        self.right_heads(_NUMBERS)
        self.setItemDelegate(kit.ColouredRow(self))
        self.currentCellChanged.connect(lambda row, *_: self._on_row(row))

    def show_job(self, job: JobView) -> None:
        """Show all characteristics of a job; keep the selection, by default the deciding one."""
        chosen = self.chosen()
        deciding = job.part_verdict.summary.deciding
        before, self._results = self._results, job.characteristics
        # A point changes few of hundreds of characteristics.
        new = [
            row
            for row, result in enumerate(self._results)
            if row >= len(before) or before[row] is not result
        ]
        self.blockSignals(True)
        self.setRowCount(len(self._results))
        for row in new:
            result = self._results[row]
            verdict = f"{VERDICT_SIGNS[result.verdict]}  {kit.said_word(result.verdict.value)}"
            words = (
                result.name,
                f"{kit.said_word(result.kind)} {' – '.join(result.features)}",
                kit.quantity(result, result.nominal),
                kit.quantity(result, result.measured),
                kit.quantity(result, result.deviation, signed=True),
                kit.limit_words(result),
                kit.quantity(result, result.uncertainty),
                verdict,
            )
            self.show_words(row, words, {_VERDICT: kit.verdict_mark(result.verdict).colour})
            for column in _NUMBERS:
                self._cell(row, column).setTextAlignment(kit.RIGHT)
        names = [result.name for result in self._results]
        if names:
            self.setCurrentCell(names.index(chosen if chosen in names else deciding), 0)
        self.blockSignals(False)
        if new or len(before) != len(self._results):
            self._share_width(new)
        if names and self.chosen() != chosen:
            self._on_row(self.currentRow())

    def chosen(self) -> str:
        row = self.currentRow()
        return self._results[row].name if 0 <= row < len(self._results) else ""

    def choose(self, name: str) -> None:
        """Select the row of a characteristic; an unknown one changes nothing."""
        for row, result in enumerate(self._results):
            if result.name == name:
                self.setCurrentCell(row, 0)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the remaining width to the second column."""
        super().resizeEvent(event)
        self._least = 0
        self._share_width()

    def _share_width(self, new: Sequence[int] = ()) -> None:
        """Set the width of columns, and the letter size of ``new`` rows, or all."""
        narrow = self.width() < _NARROW_PX
        pixels = self._least or (13 if narrow else 15)
        rows = new if pixels == self._pixels else range(self.rowCount())
        if pixels != self._pixels:
            for column in range(self.columnCount()):
                head = self.horizontalHeaderItem(column)
                if head is not None:
                    head.setFont(kit.text_font(min(_HEAD_PX, pixels)))
        self._pixels = pixels
        for row in rows:
            for column in range(self.columnCount()):
                bold = column in (_DEVIATION, _VERDICT)
                font = kit.digit_font if column in _NUMBERS else kit.text_font
                self._cell(row, column).setFont(font(pixels, bold=bold))
        # A hidden column keeps the width it had.
        self.setColumnHidden(1, False)
        self.resizeColumnsToContents()
        # Kind and features are also next to the table.
        room = self.viewport().width() - self._widths_but(1) - 4
        if narrow or room < self.columnWidth(1):
            self.setColumnHidden(1, True)
            room = self.viewport().width() - self._widths_but(0) - 4
        wide = 0 if self.isColumnHidden(1) else 1
        smaller = next((size for size in _SMALLER_PX if size < pixels), 0)
        if smaller and room < self.columnWidth(wide):
            # Long words get smaller letters, so that the verdict stays visible.
            self._least = smaller
            self._share_width()
            return
        self.setColumnWidth(wide, max(room, self.columnWidth(wide)))

    def _widths_but(self, column: int) -> int:
        return sum(self.columnWidth(c) for c in range(self.columnCount()) if c != column)

    def _on_row(self, row: int) -> None:
        if 0 <= row < len(self._results):
            self.result_chosen.emit(self._results[row].name)


def _upright(up: Float) -> scene.Orbit:
    return scene.Orbit(np.zeros(3), 0.5, float(np.radians(38.0)), 100.0, up)


class JobPicture(scene.OrbitView):
    """A 3-D view of a job: arrow keys or the mouse turn it, plus and minus or the wheel zoom."""

    margin = 1.2
    """Of points and features in the picture."""

    def __init__(self, name: str, size: tuple[int, int], least: tuple[int, int]) -> None:
        super().__init__(name, size, least, _upright(np.array([0.0, 0.0, 1.0])))
        self._job: JobView | None = None
        self._items: tuple[scene.Item, ...] = ()
        self._reach = np.empty((0, 3))

    def fit(self) -> None:
        self._fit()
        self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def _paint(self) -> None:
        self._make()
        self.update()

    def _renew(self, up: Float | None) -> None:
        """Show new items; `up`: (3,), unit, world, upright in the picture, or unchanged."""
        if up is not None:
            self._orbit = _upright(up)
        self._make()
        self._fit()

    def _make(self) -> None:
        """Collect the items, and the places (n, 3), mm, world, to be seen."""

    def _scene_box(self, inside: QRectF) -> QRectF:
        return inside

    def _fit(self) -> None:
        if len(self._reach):
            box = self._scene_box(QRectF(self.rect()))
            self._orbit = self._orbit.fitted(
                self._reach, box.width(), max(box.height(), 10.0), margin=self.margin
            )


class SectionView(kit.PaintedWidget):
    """Deviations of a line in the plane of its section."""

    def __init__(self) -> None:
        super().__init__(tr("Section"), (420, 260), (240, 170))
        self._result: CharacteristicResult | None = None
        self.hide()

    def show_result(self, result: CharacteristicResult | None) -> bool:
        """Show a result; return whether it belongs to a section."""
        self._result = result if views.is_section(result) else None
        self.setVisible(self._result is not None)
        self.update()
        return self._result is not None

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        inside = self._paint_panel(painter)
        if self._result is not None:
            views.paint_section(
                painter, QRectF(inside).adjusted(8.0, 2.0, -8.0, -2.0), self._result, self._theme
            )


class DeviationView(JobPicture):
    """Deviations of the touched places."""

    def __init__(self) -> None:
        super().__init__(tr("Deviations of the touched places"), (420, 260), (240, 170))
        self._seen = NO_DEVIATIONS
        self._part = views.PartPlacement(self)
        self._part.changed.connect(self.update)
        self._layer = scene.SceneLayer(self)
        self._layer.changed.connect(self.update)
        self._still = scene.SceneCache()
        self.hide()

    def show_job(self, job: JobView, up: Float | None) -> None:
        """Show deviations; `up`: see `_renew`."""
        if job is self._job:
            return
        self._job = job
        self._seen = views.deviations_of(job)
        # An unaligned part does not coincide with the points.
        placed = job.placed_part
        self._part.place(None if placed is None or placed.is_rough else placed)
        self._part.show_deviations(self._seen)
        self._renew(up)
        self.setVisible(bool(self._seen.whiskers))
        self.setAccessibleDescription(
            ". ".join(
                (
                    *views.scale_words(self._seen),
                    tr("Arrow keys rotate the view, plus and minus zoom."),
                )
            )
            if self._seen.whiskers
            else ""
        )
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        self._paint_panel(painter)
        inside = self._inside()
        box = self._scene_box(inside)
        font = kit.text_font(13)
        seen = self._layer.picture(self._still_scene(box), font)
        painter.drawImage(box.topLeft(), seen.image)
        tags = tuple(item for item in self._items if isinstance(item, scene.Tag))
        scene.paint_scene(painter, tags, self._orbit, box, font, self._theme.panel)
        wide, high = min(views.SCALE_PX[0] + 120.0, inside.width() - 16.0), views.SCALE_PX[1]
        below = QRectF(inside.left() + 8.0, inside.bottom() - high, wide, high)
        views.paint_scale(painter, below, self._seen, self._theme, reach_mm=self._part.reach_mm)

    def is_filled(self) -> bool:
        return bool(self._seen.whiskers)

    def is_painted(self) -> bool:
        still = self._still_scene(self._scene_box(self._inside()))
        return self._part.is_coloured() and self._layer.shows(still)

    def _still_scene(self, box: QRectF) -> scene.StillScene:
        size, ratio = box.size().toSize(), self.devicePixelRatioF()
        part = self._part.part(self._theme, RenderMode.SHADED, "", moving=self.is_moving())

        def make() -> scene.StillScene:
            items = tuple(item for item in self._items if not isinstance(item, scene.Tag))
            return scene.StillScene(items, self._orbit, size, ratio, self._theme.panel, part)

        return self._still.made((self._items, self._orbit, part), (size, ratio), make)

    def _scene_box(self, inside: QRectF) -> QRectF:
        return inside.adjusted(0.0, 0.0, 0.0, -views.SCALE_PX[1] - 4.0)

    def _make(self) -> None:
        if self._job is None:
            return
        self._items, reach = views.job_items(self._job, self._theme)
        ends = [whisker.end_world for whisker in self._seen.whiskers]
        self._reach = np.concatenate([reach, np.array(ends).reshape(-1, 3), self._part.corners()])
