"""Verdict on the part, as large as possible, with the reasons."""

from __future__ import annotations

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPaintEvent

from ocmm_core.inspection.evaluation import NOISY_LINE, SIMULATED_LINE, JobView
from ocmm_gui import kit
from ocmm_gui.kit import tr

_WORD_SHARE = 0.46
"""Height share of the word with reasons below it."""
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter


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
        painter.drawText(box.adjusted(1.05 * size, 0.0, 0.0, 0.0), _LEFT, self.word())
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
            painter.drawText(line, _LEFT, with_room(text, metrics, self.width()))
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
        bold = kit.text_font(10, bold=True)
        size = kit.fitted(
            bold, longest, self.width(), room, 0.86 * self._word_font_px()
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
