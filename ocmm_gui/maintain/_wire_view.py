"""Parts of the bus page: picture of the wire with its breaks, tables of cameras and events."""

from __future__ import annotations

from datetime import datetime

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_core.fieldbus.report import (
    BusEvent,
    BusReport,
    CameraReport,
    Link,
    WirePicture,
    is_present,
    wire_picture,
)
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.maintain._status_page import EventLine, EventTable

_WORDS_PX = 20.0
_BOX_SHARE = 0.78
"""Box width over box pitch; the rest is cable."""
_BOX_LIMIT = 220.0
_RETURN_PX = 18.0
_CENTRE = Qt.AlignmentFlag.AlignCenter


class WireView(kit.PaintedWidget):
    """Boxes for host and cameras, lines for cables, and a summary below."""

    def __init__(self) -> None:
        super().__init__(tr("Wire"), (420, 116), (320, 100))
        self._wire: WirePicture | None = None

    def show_report(self, report: BusReport) -> None:
        wire = wire_picture(report)
        if wire != self._wire:
            self._wire = wire
            chain = ", ".join(
                tr("{link} cable to {name}, {state}").format(
                    link=link.value, name=camera.name, state=camera.state
                )
                for camera, link in zip(wire.cameras, wire.links, strict=True)
            )
            self.setAccessibleDescription(f"{wire.interface}, {chain}. {kit.said(wire.words)}")
            self.setToolTip(kit.literal(kit.said(wire.words)))
            self.update()

    def summary(self) -> str:
        return kit.said(self._wire.words) if self._wire is not None else ""

    def paintEvent(self, event: QPaintEvent) -> None:
        wire = self._wire
        if wire is None:
            return
        painter = self._painter()
        count = len(wire.cameras) + 1
        # The last box has no cable behind it.
        pitch = self.width() / (count - 1 + _BOX_SHARE)
        wide = min(_BOX_SHARE * pitch, _BOX_LIMIT)
        pitch = min(pitch, wide / _BOX_SHARE * 1.15)
        below = _WORDS_PX + (_RETURN_PX if wire.redundancy is not None else 2.0)
        high = min(self.height() - below - 4.0, 104.0)
        boxes = [QRectF(1.0 + i * pitch, 2.0, wide, high) for i in range(count)]
        for link, before, after in zip(wire.links, boxes[:-1], boxes[1:], strict=True):
            middle = before.center().y()
            self._cable(
                painter, link, QPointF(before.right(), middle), QPointF(after.left(), middle)
            )
        if wire.redundancy is not None:
            self._return_cable(painter, wire.redundancy, boxes[0], boxes[-1])
        self._box(painter, boxes[0], wire.interface, (tr("this computer"),), self._theme.text)
        for camera, box in zip(wire.cameras, boxes[1:], strict=True):
            self._camera(painter, box, camera)
        broken = Link.BROKEN in (*wire.links, wire.redundancy)
        painter.setPen(QColor(self._theme.bad if broken else self._theme.text))
        line = QRectF(0.0, self.height() - _WORDS_PX, self.width(), _WORDS_PX)
        painter.setFont(
            kit.fitted(
                kit.text_font(10, bold=broken),
                kit.said(wire.words),
                line.width(),
                line.height(),
                14,
            )
        )
        painter.drawText(line, kit.LEFT, kit.said(wire.words))

    def _camera(self, painter: QPainter, box: QRectF, camera: CameraReport) -> None:
        theme = self._theme
        serial = tr("serial {serial}").format(serial=camera.serial)
        if not is_present(camera):
            self._box(painter, box, camera.name, (serial, tr("not found")), theme.bad, dashed=True)
            return
        colour = theme.good if camera.state == "OP" and camera.al_code == 0 else theme.warn
        state = f"{camera.position} · {camera.state}"
        self._box(painter, box, camera.name, (serial, state), colour)

    def _box(
        self,
        painter: QPainter,
        box: QRectF,
        title: str,
        lines: tuple[str, ...],
        colour: str,
        *,
        dashed: bool = False,
    ) -> None:
        """Paint a box with a bold title; the last line is in the colour of the outline."""
        pen = QPen(QColor(colour), 2.0)
        if dashed:
            pen.setStyle(Qt.PenStyle.DashLine)
        kit.ink(painter, pen, QColor(self._theme.background))
        painter.drawRoundedRect(box.adjusted(1, 1, -1, -1), 6, 6)
        row = (box.height() - 8.0) / 3.0
        texts = [(title, kit.text_font(15, bold=True), self._theme.text)]
        texts += [(line, kit.text_font(13), self._theme.muted) for line in lines]
        if len(lines) > 1:
            texts[-1] = (lines[-1], kit.text_font(13, bold=True), colour)
        top = box.center().y() - 0.5 * row * len(texts)
        for index, (text, font, pen_colour) in enumerate(texts):
            place = QRectF(box.left() + 6.0, top + index * row, box.width() - 12.0, row)
            painter.setFont(kit.fitted(font, text, place.width(), row, font.pixelSize()))
            painter.setPen(QColor(pen_colour))
            painter.drawText(place, _CENTRE, text)

    def _cable(self, painter: QPainter, link: Link, start: QPointF, end: QPointF) -> None:
        theme = self._theme
        colour = {Link.WHOLE: theme.good, Link.BROKEN: theme.bad}.get(link, theme.muted)
        pen = QPen(QColor(colour), 3.0)
        if link is Link.UNKNOWN:
            pen.setStyle(Qt.PenStyle.DotLine)
        painter.setPen(pen)
        if link is not Link.BROKEN:
            painter.drawLine(start, end)
            return
        middle = QPointF(0.5 * (start.x() + end.x()), start.y())
        size = min(0.5 * _RETURN_PX - 1.0, 0.15 * (end.x() - start.x()))
        free = QPointF(1.8 * size, 0.0)
        painter.drawLine(start, middle - free)
        painter.drawLine(middle + free, end)
        for sign in (-1.0, 1.0):
            corner = QPointF(size, sign * size)
            painter.drawLine(middle - corner, middle + corner)

    def _return_cable(self, painter: QPainter, link: Link, first: QRectF, last: QRectF) -> None:
        low = first.bottom() + 0.5 * _RETURN_PX
        start, end = QPointF(first.center().x(), low), QPointF(last.center().x(), low)
        colour = self._theme.bad if link is Link.BROKEN else self._theme.good
        painter.setPen(QPen(QColor(colour), 3.0))
        painter.drawLine(start, QPointF(start.x(), first.bottom()))
        painter.drawLine(end, QPointF(end.x(), last.bottom()))
        self._cable(painter, link, start, end)


_UNKNOWN = "–"
_CAMERA_COLUMNS = (
    (later("Camera"), later("Name in the rig document")),
    (later("Serial"), later("Serial number")),
    (later("Place"), later("Position on the bus, from 1")),
    (later("State"), later("State of its bus controller; OP = operational")),
    (later("AL status"), later("Why it left operation")),
    (later("Frames"), later("Frames received")),
    (later("Lost"), later("Frames lost")),
    (later("Overruns"), later("Buffer overruns")),
    (later("Bad"), later("Cycles refused because of it")),
    (later("Clock"), later("Clock offset from the bus clock, ns")),
    ("°C", later("Sensor temperature")),
    (later("Link"), later("Link errors counted by the camera")),
    (later("Emerg."), later("Emergency messages")),
    (later("Starts"), later("Power-on count")),
    (later("Firmware"), later("Version it reports")),
)
_STATE_COLUMN, _AL_COLUMN, _LOSS_COLUMN = 3, 4, 6
_EVENT_COLUMNS = (
    (later("Time"), later("Local start time")),
    (later("Camera"), later("Camera concerned")),
    (later("What happened"), later("Description")),
    (later("What to do"), later("Description")),
    (later("Cycles"), later("Number of cycles affected")),
    (later("Code"), later("For support")),
)


class CameraTable(kit.DataTable):
    """One row per camera of the rig."""

    def __init__(self) -> None:
        super().__init__(tr("Cameras on the bus"), kit.tr_all(_CAMERA_COLUMNS))
        self.fit_columns(_AL_COLUMN)
        self.verticalHeader().setDefaultSectionSize(24)

    def show_report(self, report: BusReport) -> None:
        """Show the cameras of a report, in the order of the rig."""
        if self.rowCount() != len(report.cameras):
            self.setRowCount(len(report.cameras))
            frame = 2 * self.frameWidth() + 6
            high = self.horizontalHeader().sizeHint().height() + frame
            self.setFixedHeight(high + sum(self.rowHeight(r) for r in range(self.rowCount())))
        for row, camera in enumerate(report.cameras):
            self.show_words(row, _camera_words(camera), _colours(camera))


class BusEventTable(EventTable):
    """Events, newest first."""

    def __init__(self) -> None:
        name = tr("Events, newest first")
        super().__init__(_EVENT_COLUMNS, toned=(1, 2, 3), long=(2, 3), name=name)
        self._events: tuple[BusEvent, ...] = ()

    def show_report(self, report: BusReport) -> None:
        if report.events != self._events:
            self._events = report.events
            self.show_lines([_event_line(event) for event in self._events])


def _camera_words(camera: CameraReport) -> tuple[str, ...]:
    code = f"0x{camera.al_code:04X} {camera.al_text}" if camera.al_code else tr("no error")
    offset, warm = camera.clock_offset_ns, camera.temperature_c
    return (
        camera.name,
        str(camera.serial),
        str(camera.position) if camera.position else tr("not found"),
        camera.state if is_present(camera) else tr("NO ANSWER"),
        code if is_present(camera) or camera.al_code else _UNKNOWN,
        str(camera.frames),
        str(camera.frames_lost),
        str(camera.overruns),
        str(camera.bad_cycles),
        _UNKNOWN if offset is None else str(offset),
        _UNKNOWN if warm is None else kit.localised(f"{warm:.1f}"),
        str(camera.link_errors),
        str(camera.emergencies),
        str(camera.boot_counter),
        camera.firmware or _UNKNOWN,
    )


def _colours(camera: CameraReport) -> dict[int, str]:
    """Return the colours of its row by column."""
    in_order = camera.state == "OP" and camera.al_code == 0
    state = "good" if in_order else "warn" if is_present(camera) else "bad"
    colours = {_STATE_COLUMN: state, _AL_COLUMN: "bad" if camera.al_code else "muted"}
    counts = (camera.frames_lost, camera.overruns, camera.bad_cycles)
    lost = (column for column, count in enumerate(counts, start=_LOSS_COLUMN) if count)
    return colours | dict.fromkeys(lost, "warn")


def _event_line(event: BusEvent) -> EventLine:
    when = datetime.fromtimestamp(event.utc_ns * 1e-9).astimezone()
    today = when.date() == datetime.now().astimezone().date()
    stamp = f"{when:%H:%M:%S.%f}"[:-3]
    cells = (
        stamp if today else f"{kit.day_words(when)} {stamp}",
        event.camera or tr("all"),
        kit.said(event.what),
        kit.said(event.remedy),
        str(event.cycles),
        event.code,
    )
    return EventLine(cells, "good" if event.code == "bus.operation" else "text")
