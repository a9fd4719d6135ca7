"""Picture of the wire: host, cameras in order, and breaks."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_core.fieldbus.report import (
    BusReport,
    CameraReport,
    Link,
    WirePicture,
    is_present,
    wire_picture,
)
from ocmm_gui.kit import Painted, fitted, literal, said, text_font, tr

_WORDS_PX = 20.0
_BOX_SHARE = 0.78
"""Box width over box pitch; the rest is cable."""
_BOX_LIMIT = 220.0
_RETURN_PX = 18.0
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_CENTRE = Qt.AlignmentFlag.AlignCenter


class WireView(Painted):
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
            self.setAccessibleDescription(f"{wire.interface}, {chain}. {said(wire.words)}")
            self.setToolTip(literal(said(wire.words)))
            self.update()

    def words(self) -> str:
        return said(self._wire.words) if self._wire is not None else ""

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
            fitted(text_font(10, bold=broken), said(wire.words), line.width(), line.height(), 14)
        )
        painter.drawText(line, _LEFT, said(wire.words))

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
        painter.setPen(pen)
        painter.setBrush(QColor(self._theme.background))
        painter.drawRoundedRect(box.adjusted(1, 1, -1, -1), 6, 6)
        row = (box.height() - 8.0) / 3.0
        texts = [(title, text_font(15, bold=True), self._theme.text)]
        texts += [(line, text_font(13), self._theme.muted) for line in lines]
        if len(lines) > 1:
            texts[-1] = (lines[-1], text_font(13, bold=True), colour)
        top = box.center().y() - 0.5 * row * len(texts)
        for index, (text, font, pen_colour) in enumerate(texts):
            place = QRectF(box.left() + 6.0, top + index * row, box.width() - 12.0, row)
            painter.setFont(fitted(font, text, place.width(), row, font.pixelSize()))
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
