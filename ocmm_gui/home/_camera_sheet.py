"""Setting up GenICam cameras: live pictures, exposure, views of a board, and a calibration by them.

The cameras are used by this page alone, so that it is opened without a job.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QHideEvent, QImage, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from ocmm_core.calibration.records import CalibrationStore, default_folder, store_folder
from ocmm_core.camera import Rig, load_rig
from ocmm_core.geometry import Int
from ocmm_core.options import DEFAULT_OPERATOR
from ocmm_core.settings import Settings
from ocmm_genicam import Brightness, CameraLook, ViewfinderProcess, named_cameras
from ocmm_gui import kit
from ocmm_gui.kit import later, said, said_word, tr
from ocmm_gui.work import Worker, WorkSheet

if TYPE_CHECKING:
    from ocmm_boards import BoardSession, ViewCoach, ViewReport

_INFOS = (
    kit.ActionInfo("settle", later("Expose by LEDs"),
                   later("The brightest LED fills 70 % of a pixel; all cameras get one time and "
                         "gain"),
                   ("F2",)),
    kit.ActionInfo("darker", later("Darker"), later("Shorter exposure by a fifth"), ("F3",)),
    kit.ActionInfo("brighter", later("Brighter"), later("Longer exposure by a quarter"), ("F4",)),
    kit.ActionInfo("keep", later("Store"),
                   later("Store the settings in the cameras, loaded at power-up"), ("F5",)),
    kit.ActionInfo("view", later("Take view"),
                   later("Hold the board still: one picture of each camera"), ("F6",)),
    kit.ActionInfo("calibrate", later("Calibrate"), later("By all views in the folder"), ("F7",)),
    kit.ActionInfo("accept", later("Accept"),
                   later("Put the calibration in force; it must be verified"), ("F8",)),
    kit.ActionInfo("stop", later("Stop"), later("Stop the calculation"), ("F9",)),
    kit.ActionInfo("black", later("Black image"),
                   later("LEDs off, lenses covered: dark signal and hot pixels of each camera"),
                   ("F10",)),
)  # fmt: skip
_FIELDS = (
    ("board", later("Board"), later("Document of the calibration board")),
    ("views", later("Views"), later("Folder of the pictures; continued if it has some")),
    ("who", later("Name"), later("For the record")),
)
_TONES = {
    Brightness.UNSEEN: "muted", Brightness.DARK: "warn", Brightness.GOOD: "good",
    Brightness.BRIGHT: "bad",
}  # fmt: skip
_STORED = later("The cameras load these settings at power-up.")
_DARKER, _BRIGHTER = 0.8, 1.25
_CLOSE_S = 3.0

T = TypeVar("T")


class CameraPicture(kit.Themed, QWidget):
    """The picture of a camera with its spots, and the parts in which the board was shown."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setMinimumSize(160, 120)
        self._look: CameraLook | None = None
        self._cells: Int | None = None

    def show_look(self, look: CameraLook) -> None:
        self._look = look
        self.update()

    def show_cells(self, cells: Int) -> None:
        self._cells = cells
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(self._theme.panel))
        look = self._look
        if look is None or not look.picture.size:
            kit.ink(painter, QColor(self._theme.muted), font=kit.text_font(17))
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, tr("no image"))
            return
        height, width = look.picture.shape
        scale = min(self.width() / width, self.height() / height)
        box = QRectF(0.0, 0.0, scale * width, scale * height)
        box.moveCenter(QRectF(self.rect()).center())
        pixels = np.ascontiguousarray(look.picture)
        grey = QImage.Format.Format_Grayscale8
        painter.drawImage(box, QImage(pixels.data, width, height, width, grey))
        if self._cells is not None:
            self._paint_cells(painter, box, self._cells)
        painter.setPen(QPen(QColor(self._theme.accent), 2.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        for u, v in look.spots_px.tolist():
            at = box.topLeft() + QPointF(u + 0.5, v + 0.5) * (scale / look.factor)
            painter.drawEllipse(at, 9.0, 9.0)

    def _paint_cells(self, painter: QPainter, box: QRectF, cells: Int) -> None:
        """Frame the parts without corners."""
        painter.setPen(QPen(QColor(self._theme.warn), 2.0, Qt.PenStyle.DashLine))
        rows, columns = cells.shape
        wide, high = box.width() / columns, box.height() / rows
        for row, column in np.argwhere(cells == 0).tolist():
            corner = box.topLeft() + QPointF(column * wide + 3.0, row * high + 3.0)
            painter.drawRect(QRectF(corner.x(), corner.y(), wide - 6.0, high - 6.0))


class CameraSheet(WorkSheet):
    """Set up the cameras of the settings, and calibrate them by pictures of a board."""

    def __init__(self, settings: Callable[[], Settings]) -> None:
        super().__init__(tr("Cameras"), _INFOS, tr("Calibration"))
        self._settings = settings
        self._rig: Rig | None = None
        self._finder: ViewfinderProcess | None = None
        self._calls: Worker | None = None
        self._busy = False
        self._looks: tuple[CameraLook, ...] = ()
        self._coach: ViewCoach | None = None
        self._coached = (Path(), Path())
        self._session: BoardSession | None = None
        self.fields = {
            key: kit.dressed(kit.FormField(), tr(label), tr(tip), font=kit.text_font(14))
            for key, label, tip in _FIELDS
        }
        self.wanted = kit.sentence_label(tr("Next view"), 18)
        self.result = kit.sentence_label(tr("Calibration"), 14)
        self._panels = QGridLayout()
        self._panels.setSpacing(8)
        self.pictures: list[CameraPicture] = []
        self.brightness: list[kit.FitText] = []
        self._facts: list[QLabel] = []
        form = kit.panel(kit.form_grid(self.fields.values(), pixels=14))
        told = kit.vbox(self.wanted, (self.result, 1))
        below = kit.hbox((form, 2), (kit.panel(told), 3), spacing=8)
        kit.fill(self.body, (self._panels, 1), below, self.working)
        self.use_keys(
            {
                "settle": lambda: self._change(lambda finder: finder.settle()),
                "darker": lambda: self._scale(_DARKER),
                "brighter": lambda: self._scale(_BRIGHTER),
                "keep": lambda: self._change(lambda finder: finder.store(), tr(_STORED)),
                "black": self._take_black,
                "view": self._take_view, "calibrate": self._calibrate, "accept": self._accept,
                "stop": self.stop,
            },
            primary="settle",
        )  # fmt: skip
        self._enable()

    def open(self) -> None:
        """Open the cameras of the settings."""
        settings = self._settings()
        self.show_session(None)
        self.wanted.setText(tr("Take views of a board to calibrate the cameras."))
        self.fields["board"].setFocus()
        self.show_message(tr("Opening the cameras"))
        self._calls = Worker("ocmm-cameras", self)
        self._calls.do(lambda: load_rig(settings.instrument_rig), self._on_rig, self._warn)

    def close_work(self) -> None:
        super().close_work()
        if self._calls is not None:
            finder, self._finder = self._finder, None
            self._calls.close(_CLOSE_S)
            self._calls = None
            if finder is not None:
                finder.close()
        self._busy = False
        self._enable()

    def hideEvent(self, event: QHideEvent) -> None:
        """Release the cameras for the job that is opened next."""
        self.close_work()

    def _on_rig(self, rig: Rig) -> None:
        """Show the cameras of the rig, and open those of the settings."""
        self._rig = rig
        for row, camera in enumerate(rig.cameras[len(self.pictures) :], len(self.pictures)):
            picture = CameraPicture(tr("Picture of camera {name}").format(name=camera.name))
            number = kit.FitText(
                tr("Brightest LED of camera {name}").format(name=camera.name), limit=24, high=30
            )
            facts = kit.sentence_label(tr("Camera {name}").format(name=camera.name), 13)
            self._panels.addWidget(
                kit.panel(kit.vbox((picture, 1), number, facts)), row // 2, row % 2
            )
            self.pictures.append(picture)
            self.brightness.append(number)
            self._facts.append(facts)
        kit.dress(self, kit.THEMES[self._settings().window_theme])
        self._enable()
        source, calls = self._settings().instrument_source, self._calls
        if calls is not None:
            chosen = partial(named_cameras, source, rig)
            calls.do(lambda: ViewfinderProcess(*chosen()), self._on_opened, self._warn)

    def _on_opened(self, finder: ViewfinderProcess) -> None:
        self._finder = finder
        self.show_message(tr("Live; wave the probe through the volume, then press F2."))
        self._look()

    def _look(self) -> None:
        self._ask(lambda finder: finder.look(), self._show_looks)

    def _show_looks(self, looks: tuple[CameraLook, ...]) -> None:
        self._looks = looks
        for look, picture, number, facts in zip(
            looks, self.pictures, self.brightness, self._facts, strict=True
        ):
            picture.show_look(look)
            share = "–" if math.isnan(look.brightest) else f"{100.0 * look.brightest:.0f} %"
            number.show_text(f"{share}  {said_word(look.brightness)}", _TONES[look.brightness])
            facts.setText(_facts(look))
        self._look()

    def _change(self, action: Callable[[ViewfinderProcess], object], done: str = "") -> None:
        self._ask(action, lambda _none: self.show_message(done) if done else None, busy=True)

    def _scale(self, factor: float) -> None:
        if self._looks:
            exposure_us = factor * self._looks[0].exposure_us
            self._change(lambda finder: finder.expose(exposure_us))

    def _ask(
        self, deed: Callable[[ViewfinderProcess], T], done: Callable[[T], None], *,
        busy: bool = False,
    ) -> None:  # fmt: skip
        """Do something with the cameras; other keys wait if it takes long (``busy``)."""
        finder, calls = self._finder, self._calls
        if finder is None or calls is None:
            return
        self._busy = self._busy or busy
        self._enable()

        def finished(answer: T) -> None:
            self._busy = self._busy and not busy
            self._enable()
            done(answer)

        def failed(error: Exception) -> None:
            self._busy = False
            self._on_failed(error)
            self._enable()
            if not busy:
                self.close_work()

        calls.do(lambda: deed(finder), finished, failed)

    def _warn(self, error: Exception) -> None:
        self.show_message(said(str(error)), warns=True)

    def _on_failed(self, error: Exception) -> None:
        self._warn(error)
        self.failed.emit(error)

    def _take_view(self) -> None:
        from ocmm_boards import (
            ViewCoach,
            corner_finder,
            load_board,
            next_view,
            views_in,
            write_view,
        )

        rig, words = self._rig, self._words("board", "views")
        if rig is None or words is None:
            return
        board, folder = words

        def take(finder: ViewfinderProcess) -> tuple[int, ViewReport]:
            known = load_board(board)
            number = next_view(folder)
            taken = finder.pictures()
            write_view(folder, number, rig, taken)
            if self._coach is None or self._coached != (board, folder):
                # This view is among those in the folder.
                views = views_in(folder, rig, known).uv if number > 1 else ()
                self._coach, self._coached = ViewCoach(rig.cameras, known, views), (board, folder)
                if number > 1:
                    return number, self._coach.report()
            find = corner_finder(known)
            return number, self._coach.add([find(one) for one in taken])

        self.show_message(tr("Hold the board still"))
        self._ask(take, self._show_view, busy=True)

    def _show_view(self, taken: tuple[int, ViewReport]) -> None:
        number, report = taken
        for picture, cells in zip(self.pictures, report.cells, strict=True):
            picture.show_cells(cells)
        corners, wanted = ", ".join(map(str, report.corners)), said(report.wanted)
        told = tr("View {number}: {corners} corners. {wanted}")
        self.wanted.setText(told.format(number=number, corners=corners, wanted=wanted))
        self.show_message(tr("View {number} is stored.").format(number=number))

    def _calibrate(self) -> None:
        from ocmm_boards import run_folder

        rig, words = self._rig, self._words("board", "views")
        if rig is None or words is None or self.is_working():
            return
        self.show_session(None)
        board, views = words
        who = self.fields["who"].text().strip() or DEFAULT_OPERATOR
        self._start(
            tr("Calibration"), partial(run_folder, rig, self._calibrations(), board, views, who)
        )

    def _show(self, answer: object) -> None:
        from ocmm_boards import BoardSession

        assert isinstance(answer, BoardSession)  # noqa: S101 - of `run_folder`
        self.show_session(answer)

    def show_session(self, session: BoardSession | None) -> None:
        """Show a calibration that can be accepted, or None."""
        self._session = session
        self.result.setText("" if session is None else _summary(session))
        self._enable()

    def _take_black(self) -> None:
        if self._rig is not None:
            folder = store_folder(self._calibrations(), self._rig.name)
            self._change(lambda finder: finder.black(folder), tr("The black images are stored."))

    def _accept(self) -> None:
        session, rig, calls = self._session, self._rig, self._calls
        if session is None or rig is None or calls is None:
            return
        who = session.outcome.record.made_by
        store = CalibrationStore(store_folder(self._calibrations(), rig.name))

        def accepted(_none: object) -> None:
            self.show_session(None)
            self.result.setText(
                tr("In force, and SUSPECT until it is verified: Calibrate (M), Verification.")
            )

        calls.do(lambda: session.accept(store, who, datetime.now(UTC)), accepted, self._on_failed)

    def _words(self, *keys: str) -> list[Path] | None:
        """Return the paths of fields; None, with a sentence, if one is empty."""
        for key, label, _ in _FIELDS:
            if key in keys and not self.fields[key].text().strip():
                self.fields[key].setFocus()
                told = tr("Field '{field}' is empty: enter a path.")
                self.show_message(told.format(field=tr(label)), warns=True)
                return None
        return [Path(self.fields[key].text().strip()).expanduser() for key in keys]

    def _calibrations(self) -> Path:
        return self._settings().instrument_calibrations or default_folder()

    def _enable(self) -> None:
        ready = self._finder is not None and not self._busy
        for key in ("settle", "darker", "brighter", "keep", "view", "black"):
            self.keys[key].setEnabled(ready)
        self.keys["calibrate"].setEnabled(self._rig is not None)
        self.keys["accept"].setEnabled(self._session is not None)


def _facts(look: CameraLook) -> str:
    width = "–" if math.isnan(look.width_px) else f"{look.width_px:.2f}"
    focus = "–" if math.isnan(look.focus) else f"{100.0 * look.focus:.0f}"
    gain = "–" if math.isnan(look.gain) else f"{look.gain:g}"
    return tr(
        "{serial}: exposure {exposure} µs, gain {gain}; spots: {spots}, {width} px wide; sharpness "
        "{focus} % of the best; incomplete images: {incomplete} of {images}; network card: {load}"
    ).format(
        serial=look.serial, exposure=kit.localised(f"{look.exposure_us:.1f}"), gain=gain,
        spots=len(look.spots_px), width=kit.localised(width), focus=focus,
        incomplete=look.incomplete, images=look.images + look.incomplete,
        load=kit.localised(look.load),
    )  # fmt: skip


def _summary(session: BoardSession) -> str:
    record, found = session.outcome.record, session.found
    told = [
        tr("{views} views; residuals {rms:.3f} px RMS; corners scatter by {sigma:.3f} px.").format(
            views=found.views, rms=record.rms_px, sigma=found.sigma_px
        )
    ]
    told += [said(f"{one.what} {one.remedy}") for one in session.outcome.warnings]
    return "\n".join([*told, tr("Accept (F8) puts it in force.")])
