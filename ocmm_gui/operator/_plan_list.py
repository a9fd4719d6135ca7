from __future__ import annotations

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter
from PySide6.QtWidgets import (
    QListWidget,
    QListWidgetItem,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QWidget,
)

from ocmm_core.inspection.evaluation import FeatureState, FeatureView, JobView
from ocmm_core.tolerances.decisions import Verdict
from ocmm_gui import kit
from ocmm_gui.kit import tr
from ocmm_gui.operator._feature_details import points_words

_ROLE = Qt.ItemDataRole.UserRole
_VERDICT = Qt.ItemDataRole(_ROLE + 1)
_ROW_PX = 46


class FeatureList(QListWidget):
    """List of the features; a click activates one."""

    feature_chosen = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Plan"))
        self.setAccessibleDescription(
            tr("Features in probing order; Page Up and Page Down change the active one")
        )
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setVerticalScrollMode(QListWidget.ScrollMode.ScrollPerPixel)
        self.setUniformItemSizes(True)
        self._rows: list[tuple[FeatureView, Verdict | None]] = []
        self._delegate = _Row(self)
        self.setItemDelegate(self._delegate)
        self.itemClicked.connect(lambda item: self.feature_chosen.emit(item.data(_ROLE).name))

    def show_job(self, job: JobView) -> None:
        """Show the features and keep the active one visible."""
        marked = job.shown if job.looked_at or not job.active else job.feature(job.active)
        while self.count() > len(job.features):
            self.takeItem(self.count() - 1)
        before = self._rows[: self.count()]
        self._rows = [(item, job.verdict_of(item.name).verdict) for item in job.features]
        for row, (feature, verdict) in enumerate(self._rows):
            # Reading an item takes microseconds: with thousands of features, a frame.
            is_new = row >= len(before)
            is_same = not is_new and before[row][0] is feature and before[row][1] is verdict
            if is_same and feature is not marked:
                continue
            item = QListWidgetItem(self) if is_new else self.item(row)
            if feature is marked:
                self.setCurrentItem(item)
                self.scrollToItem(item)
            if is_same:
                continue
            item.setData(_ROLE, feature)
            item.setData(_VERDICT, verdict)
            parts = (kit.shape_word(feature.shape), points_words(feature))
            item.setText(", ".join((feature.name, *parts, kit.progress_word(feature, verdict))))
            item.setToolTip(kit.literal(item.text()))

    def set_theme(self, theme: kit.Theme) -> None:
        self._delegate.theme = theme
        self.viewport().update()


class _Row(QStyledItemDelegate):
    """One row: mark, name, shape, points and word."""

    paints_words = True
    """Not the style; for tests."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.theme = kit.THEMES[kit.DEFAULT_THEME]

    def sizeHint(
        self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> QSize:
        # Gloves need higher ones.
        wanted = index.data(Qt.ItemDataRole.SizeHintRole)
        return wanted if isinstance(wanted, QSize) else QSize(180, _ROW_PX)

    def paint(
        self,
        painter: QPainter,
        option: QStyleOptionViewItem,
        index: QModelIndex | QPersistentModelIndex,
    ) -> None:
        feature: FeatureView = index.data(_ROLE)
        verdict: Verdict | None = index.data(_VERDICT)
        theme = self.theme
        rect, state = option.rect, option.state
        box = QRectF(rect)
        active = feature.state is FeatureState.ACTIVE
        painter.save()
        if active or state & QStyle.StateFlag.State_MouseOver:
            painter.fillRect(box, QColor(theme.background))
        if active:
            painter.fillRect(QRectF(box.left(), box.top(), 4, box.height()), QColor(theme.accent))
        done = feature.state is FeatureState.DONE
        colour = theme.muted
        if done:
            colour = kit.verdict_colour(theme, verdict)
        elif active:
            colour = theme.accent
        side = 20.0
        mark = QRectF(box.left() + 12, box.center().y() - 0.5 * side, side, side)
        kit.paint_mark(painter, kit.feature_mark(feature, verdict), mark, colour, theme.panel)
        left = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        text = box.adjusted(42, 4, -10, -4)
        upper = QRectF(text.left(), text.top(), text.width(), 0.5 * text.height())
        lower = QRectF(text.left(), upper.bottom(), text.width(), 0.5 * text.height())
        count = feature.count_text
        bold = kit.text_font(14, bold=True)
        kit.ink(painter, QColor(theme.text), font=bold)
        metrics = painter.fontMetrics()
        shape = kit.shape_word(feature.shape)
        # A long name uses the whole line; the points are below it.
        alone = metrics.horizontalAdvance(f"{feature.name}  {count}") > upper.width()
        if alone:
            shape = f"{shape}  {count}"
        else:
            painter.drawText(upper, right, count)
        painter.setFont(kit.fitted(bold, feature.name, upper.width(), upper.height() + 2.0, 14))
        name = painter.fontMetrics().elidedText(
            feature.name, Qt.TextElideMode.ElideMiddle, int(upper.width())
        )
        painter.drawText(upper, left, name)
        kit.ink(painter, QColor(theme.muted), font=kit.text_font(12))
        painter.drawText(lower, left, shape)
        kit.ink(painter, QColor(colour), font=kit.text_font(12, bold=True))
        painter.drawText(lower, right, kit.progress_word(feature, verdict))
        painter.restore()
