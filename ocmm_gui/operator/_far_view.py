"""Far view: only what is read at three metres.

Capitals are at least 63 px of 1080 high on 24 inches (20 minutes of arc), changing digits more.
"""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QResizeEvent
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QLayout,
    QPushButton,
    QStackedWidget,
    QWidget,
)

from ocmm_core.inspection.evaluation import JobView, LiveView
from ocmm_core.station.coaching import CoachView
from ocmm_core.tolerances.decisions import NO_VERDICT, Verdict, VerdictSummary
from ocmm_gui import kit
from ocmm_gui.charts import ToleranceBar
from ocmm_gui.help import CoachPanel
from ocmm_gui.kit import later, tr
from ocmm_gui.operator._feature_details import CoverageView
from ocmm_gui.operator._readout import CoachedView, Readout
from ocmm_gui.operator._view_parts import FarMessage, PartVerdictView, TargetRing, show_machine

_VALUES = (
    ("measured", later("Measured"), "0000.000"),
    ("deviation", later("Deviation"), "+0.000"),
    ("uncertainty", "U", "0.000"),
    ("form", later("Form"), "0.000"),
)
_LINES = 1080
"""Reference screen height for the sizes below; they scale with the screen."""
_AIRY_LINES = 720
"""Below this height gaps shrink with the text."""
_TYPE_PX, _DIGITS_PX = 100, 130
"""Maximum type of words, whose capitals are 73 px high, and of numbers next to the readout."""
_PART_PX = (220, 30)
"""Maximum type of the part verdict, and minimum type below it."""


class FarView(CoachedView):
    """Status, feature, digits, tolerance bar, verdict and three large buttons."""

    def __init__(self, actions: dict[str, QAction]) -> None:
        super().__init__()
        self._job: JobView | None = None
        self._live: LiveView | None = None
        right = Qt.AlignmentFlag.AlignRight
        self._status = kit.FitText(tr("Status"), limit=_TYPE_PX, reserve=tr("INACCURATE"))
        self._count = kit.FitText(
            tr("Points"), limit=_TYPE_PX, align=right, digits=True, reserve="00/00"
        )
        self._feature = kit.FitText(tr("Feature name"), limit=_TYPE_PX)
        self.verdict = kit.FitText(
            tr("Verdict"), limit=_TYPE_PX, align=right, reserve=tr("NOT MEASURED")
        )
        self.readout = Readout()
        self._coverage = CoverageView()
        self._ring = TargetRing()
        self.coach = CoachPanel(far=True)
        self.coach.refusal_over.connect(self.forget_refusal)
        self.coach.hide()
        self._values = {
            key: kit.FitText(tr(name), limit=_DIGITS_PX, align=right, digits=True, reserve=reserve)
            for key, name, reserve in _VALUES
        }
        self._bar = ToleranceBar(digits_share=0.36)
        self._message = FarMessage()
        self._captions = {
            key: kit.FitText(
                tr("{name}, description").format(name=tr(name)),
                limit=_TYPE_PX,
                reserve=tr("Deviation"),
            )
            for key, name, _ in _VALUES
        }
        side = QGridLayout()
        side.setHorizontalSpacing(10)
        side.setVerticalSpacing(2)
        side.setColumnStretch(0, 49)
        side.setColumnStretch(1, 51)
        for line, (key, name, _) in enumerate(_VALUES):
            side.addWidget(self._captions[key], line, 0)
            side.addWidget(self._values[key], line, 1)
            side.setRowStretch(line, 1)
            self._captions[key].show_text(tr(name), "muted")
        pictures = kit.vbox((self._coverage, 1), (self._ring, 1), (self.coach, 2))
        grid = QGridLayout(self)
        grid.setContentsMargins(24, 4, 24, 12)
        grid.setHorizontalSpacing(28)
        grid.setVerticalSpacing(6)
        grid.addLayout(_beside(self._status, self.verdict, 41), 0, 0)
        work = kit.hbox((self.readout, 38), (pictures, 12), (side, 50), spacing=24)
        self._one = QWidget()
        # Words and digits need different shares of the width.
        named = _beside(self._feature, self._count, 80)
        kit.vbox((named, 107), (work, 434), (self._bar, 83), parent=self._one, spacing=6, margins=0)
        self.part = PartVerdictView(*_PART_PX)
        self._what = QStackedWidget()
        self._what.addWidget(self._one)
        self._what.addWidget(self.part)
        grid.addWidget(self._what, 1, 0)
        grid.addWidget(self._message, 2, 0)
        self._buttons: list[QPushButton] = []
        row = kit.hbox(spacing=24)
        for key in ("take", "undo", "finish"):
            button = kit.make_button(actions[key], primary=key == "take")
            button.setText(actions[key].text())
            self._buttons.append(button)
            row.addWidget(button, 1)
        grid.addLayout(row, 3, 0)
        for line, stretch in enumerate((107, 624, 138, 0)):
            grid.setRowStretch(line, stretch)
        self._airs = [_Air(layout) for layout in self.findChildren(QLayout)]
        for child in self.findChildren(QWidget):
            if isinstance(child, kit.PaintedWidget | Readout):
                # Relative to the window: enlarged twice it has 360 lines.
                child.setMinimumSize(1, 1)

    def show_live(self, live: LiveView) -> None:
        turned = kit.has_failed(live) and not kit.has_failed(self._live)
        self._live = live
        if turned and self._job is not None:
            # The next step may have changed.
            self.show_job(self._job)
        self._show_status()
        self.readout.show_live(live)
        self._show_ring()

    def show_job(self, job: JobView) -> None:
        self._job = job
        # The readout shows the machine's reason instead of digits.
        feature = job.shown
        far_off = "" if feature is None else kit.outlier_count(feature)
        # From afar the first sentence suffices.
        step, point, rest = kit.next_step(job, self._live).partition(". ")
        summary = NO_VERDICT if feature is None or job.shows_part else job.verdict_of(feature.name)
        counted = f"{summary.deciding}: {kit.said(summary.share)}." if summary.share else ""
        parts = (self.coach.hint(), counted, rest, far_off, kit.step_text(job))
        words = " ".join(part for part in parts if part)
        hidden = self._live if job.shows_part and kit.has_failed(self._live) else None
        step = f"{step}{point}".strip()
        lines = kit.trouble(hidden, job) + ((step,) if hidden is not None else ())
        self._message.tell(step, words, " ".join(lines))
        self._show_status()
        self._show_ring()
        self.part.show_job(job)
        self._what.setCurrentWidget(self.part if job.shows_part else self._one)
        if job.shows_part:
            # Shown large below.
            self.verdict.show_text("")
            return
        if feature is None:
            return
        summary, result = job.verdict_of(feature.name), job.deciding(feature.name)
        self._feature.show_text(kit.feature_title(feature))
        what = tr("Measured") if result is None else _first_large(kit.said_word(result.kind))
        if what == tr("Form"):  # the form of the fit is next to it
            what = tr("Measured")
        warm = ", 20 °C" if job.at_20_c else ""
        self._captions["measured"].show_text(f"{what}{warm}", "muted")
        self._count.show_text(feature.count_text.replace(" ", ""))
        self._coverage.show_feature(feature, 0)
        self._bar.show_result(result)
        provisional = summary.verdict is Verdict.PROVISIONAL
        # Provisional values are muted.
        settled = "muted" if provisional else "text"
        self._values["form"].show_text(kit.form_words(feature), settled)
        self.verdict.show_verdict(self._verdict_words(summary), summary.verdict)
        if result is None:
            for key in ("measured", "deviation", "uncertainty"):
                self._values[key].show_text(kit.DASHES, "muted")
            return
        self._values["measured"].show_text(kit.quantity(result, result.measured), settled)
        self._values["uncertainty"].show_text(kit.quantity(result, result.uncertainty), settled)
        colour = kit.verdict_mark(summary.verdict).colour if summary.verdict else "muted"
        self._values["deviation"].show_text(
            kit.quantity(result, result.deviation, signed=True), colour
        )

    def _verdict_words(self, summary: VerdictSummary) -> str:
        """Return the verdict, with its count if still legible from afar."""
        if summary.verdict is None:
            return kit.verdict_line(summary)
        short = kit.said(summary.share.replace(" of ", "/"))
        for words in (kit.said(summary.share), short):
            if words and self.verdict.size_of(words) >= kit.far_type(self):
                return words
        return kit.said_word(summary.verdict.value)

    def type_pixels(self) -> dict[str, int]:
        texts = (self._status, self.verdict, self._feature, self._count, *self._values.values())
        if self._what.currentWidget() is self.part:
            texts = (self._status,)
        pixels = {text.accessibleName(): text.type_pixels() for text in texts}
        if self._what.currentWidget() is self.part:
            pixels[self.part.word()] = self.part.type_pixels()[0]
        if self._message.is_trouble():
            # A reason needs all its words: as large as they allow.
            return pixels
        return pixels | {self._message.text(): self._message.type_pixels()}

    def show_coach(self, view: CoachView) -> None:
        """Show the coach, replacing unknown values while the probe is lost."""
        super().show_coach(view)
        if self._job is not None:
            self.show_job(self._job)

    def coach_changed(self) -> None:
        """Show the probe instead of the coverage, and of the ring during trouble."""
        probe = self.coach.shows_probe()
        self.coach.setVisible(probe)
        self._coverage.setHidden(probe)
        # With a mere hint the way to the next point is still shown.
        self._ring.setHidden(self.coach.is_trouble())

    def _show_status(self) -> None:
        if self._live is not None:
            show_machine(self._status, self._job, self._live)

    def _show_ring(self) -> None:
        target = None if self._job is None else self._job.target
        self._ring.show_target(target, None if self._live is None else self._live.tip_world)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Scale with the height: buttons a ninth, 33 mm on a screen of 24 inch."""
        height = max(32, self.height() // 9)
        share = max(1.0, self.window().height() / _LINES)
        small = min(1.0, self.window().height() / _AIRY_LINES)
        for air in self._airs:
            air.use(small)
        texts = (self._status, self._count, self._feature, self.verdict)
        for text in (*texts, *self._captions.values()):
            text.use_limit(_TYPE_PX * share)
        for text in self._values.values():
            text.use_limit(_DIGITS_PX * share)
        self.part.use_limits(*(round(pixels * share) for pixels in _PART_PX))
        for button in self._buttons:
            button.setFixedHeight(height)
            # Fonts set directly are lost when the application's style sheet changes.
            button.setStyleSheet(f"font-size: {height // 2}px; font-weight: bold;")
        super().resizeEvent(event)


class _Air:
    """Original spacing of a layout."""

    def __init__(self, layout: QLayout) -> None:
        self._layout, self._margins = layout, layout.contentsMargins()
        self._across = self._down = layout.spacing()
        if isinstance(layout, QGridLayout):
            self._across, self._down = layout.horizontalSpacing(), layout.verticalSpacing()

    def use(self, share: float) -> None:
        self._layout.setContentsMargins(self._margins * share)
        if isinstance(self._layout, QGridLayout):
            self._layout.setHorizontalSpacing(round(self._across * share))
            self._layout.setVerticalSpacing(round(self._down * share))
        else:
            self._layout.setSpacing(round(self._across * share))


def _first_large(word: str) -> str:
    return word[:1].upper() + word[1:]


def _beside(left: QWidget, right: QWidget, share: int) -> QHBoxLayout:
    """Return two widgets in one line, the left one with ``share`` hundredths of it."""
    return kit.hbox((left, share), (right, 100 - share), spacing=28)
