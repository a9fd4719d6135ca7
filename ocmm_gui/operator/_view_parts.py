"""Parts of the views: plan list; for three metres message, ring about the next point, verdict."""

from __future__ import annotations

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import (
    QListWidget,
    QListWidgetItem,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QWidget,
)

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import (
    NOISY_LINE,
    SIMULATED_LINE,
    FeatureState,
    FeatureView,
    JobView,
    LiveView,
    Target,
    cue,
)
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
        tip = tr("Features in probing order; Page Up and Page Down change the active one")
        kit.dressed(self, tr("Plan"), tip)
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
        text = box.adjusted(42, 4, -10, -4)
        upper = QRectF(text.left(), text.top(), text.width(), 0.5 * text.height())
        lower = QRectF(text.left(), upper.bottom(), text.width(), 0.5 * text.height())
        count = feature.count_text
        bold = kit.text_font(14, bold=True)
        kit.ink(painter, QColor(theme.text), font=bold)
        metrics = painter.fontMetrics()
        shape = kit.shape_word(feature.shape)
        # A long name uses the whole line; the points are below it.
        if metrics.horizontalAdvance(f"{feature.name}  {count}") > upper.width():
            shape = f"{shape}  {count}"
        else:
            painter.drawText(upper, kit.RIGHT, count)
        painter.setFont(kit.fitted(bold, feature.name, upper.width(), upper.height() + 2.0, 14))
        name = painter.fontMetrics().elidedText(
            feature.name, Qt.TextElideMode.ElideMiddle, int(upper.width())
        )
        painter.drawText(upper, kit.LEFT, name)
        kit.ink(painter, QColor(theme.muted), font=kit.text_font(12))
        painter.drawText(lower, kit.LEFT, shape)
        kit.ink(painter, QColor(colour), font=kit.text_font(12, bold=True))
        painter.drawText(lower, kit.RIGHT, kit.progress_word(feature, verdict))
        painter.restore()


def show_machine(place: kit.FitText, job: JobView | None, live: LiveView) -> None:
    """Show the status of the machine, or that the job is paused."""
    if kit.is_held(job, live):
        place.show_text(tr(kit.PAUSED), mark=kit.Mark.DOUBT)
    else:
        place.show_status(live.status)


_LINE = 1.17
_LEAST_PX = 16
"""Minimum size for text below the step."""


class FarMessage(kit.PaintedWidget):
    """The next step with the plan's text below it; trouble replaces both."""

    def __init__(self) -> None:
        super().__init__(tr("Next step"), (600, 120), (300, 60))
        self._step, self._words, self._trouble = "", "", ""

    def tell(self, step: str, words: str, trouble: str) -> None:
        """Show a step with its plan text, or trouble instead."""
        if (step, words, trouble) != (self._step, self._words, self._trouble):
            self._step, self._words, self._trouble = step, words, trouble
            self.setAccessibleDescription(trouble or f"{step} {words}".strip())
            self.update()

    def text(self) -> str:
        return self._trouble or self._step

    def is_trouble(self) -> bool:
        return bool(self._trouble)

    def type_pixels(self) -> int:
        first = self._first()
        if self._trouble:
            return kit.wrapped_pixels(self._trouble, first, kit.far_type(self), bold=True)
        bold = kit.text_font(10, bold=True)
        return kit.fitted(
            bold, self._step, first.width(), first.height(), kit.far_type(self)
        ).pixelSize()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        first = self._first()
        painter.setFont(kit.text_font(self.type_pixels(), bold=True))
        painter.setPen(QColor(self._theme.bad if self._trouble else self._theme.text))
        painter.drawText(first, kit.LEFT | Qt.TextFlag.TextWordWrap, self.text())
        if self._trouble or not self._words:
            return
        second = QRectF(self.rect())
        second.setTop(first.bottom())
        font = kit.fitted(
            kit.text_font(10), self._words, second.width(), second.height(), kit.far_type(self)
        )
        if font.pixelSize() < _LEAST_PX:
            return
        kit.ink(painter, QColor(self._theme.muted), font=font)
        painter.drawText(second, kit.LEFT, self._words)

    def _first(self) -> QRectF:
        """Return the place of the first sentence: one line if there is a second one."""
        box = QRectF(self.rect())
        if not self._trouble:
            box.setHeight(min(_LINE * kit.far_type(self) + 1.0, box.height()))
        return box


class TargetRing(kit.PaintedWidget):
    """A ring about a dot; its radius is the distance of the ball from the target."""

    def __init__(self) -> None:
        super().__init__(tr("Distance to the next point"), (120, 120), (60, 60))
        self._distance: float | None = None
        self._approximate = False

    def show_target(self, target: Target | None, tip_world: Float | None) -> None:
        """Show the distance of the ball (3,), mm, from a target; None shows nothing."""
        distance = None if target is None or tip_world is None else target.distance(tip_world)
        approximate = target is not None and target.approximate
        if (distance, approximate) != (self._distance, self._approximate):
            self._distance, self._approximate = distance, approximate
            self.setAccessibleDescription(self.distance_text())
            self.update()

    def distance_text(self) -> str:
        """Return the distance in words; empty if unknown."""
        if self._distance is None:
            return ""
        return kit.distance_words(self._distance, approximate=self._approximate)

    def paintEvent(self, event: QPaintEvent) -> None:
        if self._distance is None:
            return
        painter = self._painter()
        high = max(16.0, 0.3 * self.height())
        side = min(float(self.width()), self.height() - high)
        middle = QPointF(0.5 * self.width(), 0.5 * side)
        led = cue(self._distance)
        colour = QColor(self._theme.good if led.arrived else self._theme.accent)
        dot = max(3.0, 0.03 * side)
        greatest = 0.5 * side - 4.0
        kit.ink(painter, QPen(colour, max(3.0, 0.04 * side)), Qt.BrushStyle.NoBrush)
        radius = greatest * led.ring_px_fraction
        painter.drawEllipse(middle, radius, radius)
        kit.ink(painter, Qt.PenStyle.NoPen, colour)
        painter.drawEllipse(middle, dot, dot)
        mark = "≈" if self._approximate else ""
        text = tr("there") if led.arrived else f"{mark}{self._distance:.0f} mm"
        base = kit.text_font(10, bold=True) if led.arrived else kit.digit_font(10)
        kit.ink(
            painter, QColor(self._theme.text), font=kit.fitted(base, text, self.width(), high, 64)
        )
        box = QRectF(0.0, self.height() - high, self.width(), high)
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)


_WORD_SHARE = 0.46
"""Height share of the word with reasons below it."""


class PartVerdictView(kit.PaintedWidget):
    """Sign and word of the verdict, counts, and names of failed or missing features.

    `least`: Minimum pixel size of a reason: names that do not fit are counted.
    """

    def __init__(self, limit: int, least: int) -> None:
        super().__init__(tr("Verdict on the part"), (600, 300), (200, 60))
        self._limit, self._least = limit, least
        self._job: JobView | None = None

    def show_job(self, job: JobView) -> None:
        if job is self._job:
            return
        self._job = job
        self.setAccessibleDescription(f"{self.word()}. {' '.join(self.lines())}".strip())
        self.update()

    def use_limits(self, limit: int, least: int) -> None:
        """Set the type limits, px."""
        if (limit, least) != (self._limit, self._least):
            self._limit, self._least = limit, least
            self.update()

    def word(self) -> str:
        """Return the word of the verdict, with the count of requirements if the plan lacks some."""
        if self._job is None:
            return ""
        word, *count = self._job.part_verdict.short_headline
        return ": ".join((kit.said_word(word), *map(kit.said, count)))

    def lines(self) -> tuple[str, ...]:
        if self._job is None:
            return ()
        part = self._job.part_verdict
        simulated = (SIMULATED_LINE,) if self._job.simulated else ()
        counted = (part.requirement_words,) if part.is_partial else ()
        noisy = (NOISY_LINE,) if self._job.noise else ()
        lines = (*simulated, *noisy, *counted, *(part.reasons or (part.summary.counted,)))
        return tuple(kit.said(line) for line in lines)

    def type_pixels(self) -> tuple[int, int]:
        return self._word_font_px(), self._line_px()

    def paintEvent(self, event: QPaintEvent) -> None:
        if self._job is None:
            return
        painter = self._painter()
        part, size = self._job.part_verdict, self._word_font_px()
        colour = kit.verdict_colour(self._theme, part.shown_as)
        box = self._word_box()
        mark = kit.Mark.DONE if part.shown_as is None else kit.verdict_mark(part.shown_as)
        side = 0.8 * size
        place = QRectF(box.left(), box.center().y() - 0.5 * side, side, side)
        kit.paint_mark(painter, mark, place, colour, self._theme.background)
        kit.ink(painter, QColor(colour), font=kit.text_font(size, bold=True))
        painter.drawText(box.adjusted(1.05 * size, 0.0, 0.0, 0.0), kit.LEFT, self.word())
        lines, pixels = self.lines(), self._line_px()
        stated, bold = kit.said(part.requirement_words), kit.text_font(pixels, bold=True)
        line = QRectF(box.left(), box.bottom(), self.width(), 1.25 * pixels)
        metrics = QFontMetricsF(bold)
        for text in lines:
            is_count = bool(text) and text == stated
            painter.setPen(QColor(self._theme.warn if is_count else self._theme.text))
            # Whole at any width: a cut count reads as another one.
            whole = (
                kit.fitted(bold, text, self.width(), line.height(), pixels) if is_count else bold
            )
            painter.setFont(whole)
            painter.drawText(line, kit.LEFT, with_room(text, metrics, self.width()))
            line.translate(0.0, line.height())

    def _word_box(self) -> QRectF:
        return QRectF(0.0, 0.0, self.width(), _WORD_SHARE * self.height())

    def _word_font_px(self) -> int:
        box = self._word_box()
        # The sign is as wide as the word is high.
        room = box.width() - 1.05 * min(self._limit, box.height() / 1.17)
        return kit.fitted(
            kit.text_font(10, bold=True), self.word(), room, box.height(), self._limit
        ).pixelSize()

    def _line_px(self) -> int:
        lines = self.lines()
        room = (self.height() - self._word_box().height()) / (1.25 * max(len(lines), 1))
        longest = max(lines, key=len, default="")
        size = kit.fitted(
            kit.text_font(10, bold=True), longest, self.width(), room, 0.86 * self._word_font_px()
        ).pixelSize()
        return max(size, min(self._least, int(room)))


def with_room(text: str, metrics: QFontMetricsF, room: float) -> str:
    """Return ``WORD: A, B, C`` with the names that fit, others counted: ``A, 2 more``."""
    head, _, tail = text.partition(": ")
    names = tail.split(", ")
    for left_out in range(len(names)):
        kept = names[: len(names) - left_out]
        more = tr("%n more", "", left_out)
        more = f", {more}" if left_out else ""
        shown = f"{head}: {', '.join(kept)}{more}" if tail else text
        if metrics.horizontalAdvance(shown) <= room:
            return shown
    return f"{head}: {len(names)}" if tail else text
