"""Pages as a PDF file with other files inside, read back before it counts (decision 18)."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Mapping

from PySide6.QtCore import QBuffer, QByteArray, QIODevice, QMarginsF, QRectF, Qt
from PySide6.QtGui import QPageLayout, QPageSize, QPainter, QPdfWriter

from ocmm_core.errors import StorageError
from ocmm_gui.reports._canvas import BOTTOM, LEFT, SMALL, WIDTH, Canvas, paint_line

_RESOLUTION = 1200
_UNITS_PER_INCH = 254.0
_NUMBER = 320.0
"""Of the page: nothing runs into it."""


def written_pdf(
    canvas: Canvas,
    paint: Callable[[QPainter, int], None],
    attachments: Mapping[str, bytes],
    *,
    title: str,
    software: str,
) -> bytes:
    """Return pages as a PDF file with other files inside.

    Parameters
    ----------
    canvas
        What is on the pages.
    paint
        Paints the page of an index, see `paint_with_foot`; in tenths of a millimetre.
    attachments
        JSON files by name.
    title, software
        Properties of the file: what it is, and the version of OCMM that made it.

    Raises
    ------
    StorageError
        What was read back from it is not what was put in.
    """
    content = QByteArray()
    buffer = QBuffer(content)
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    writer = QPdfWriter(buffer)
    writer.setPageSize(QPageSize(QPageSize.PageSizeId.A4))
    writer.setPageMargins(QMarginsF(0.0, 0.0, 0.0, 0.0), QPageLayout.Unit.Millimeter)
    writer.setResolution(_RESOLUTION)
    writer.setTitle(title)
    writer.setCreator(f"OCMM {software}")
    for name, attached in attachments.items():
        writer.addFileAttachment(name, QByteArray(attached), "application/json")
    painter = QPainter(writer)
    painter.scale(_RESOLUTION / _UNITS_PER_INCH, _RESOLUTION / _UNITS_PER_INCH)
    for index in range(len(canvas.pages)):
        if index:
            writer.newPage()
        paint(painter, index)
    painter.end()
    buffer.close()
    made = bytes(content.data())
    _require_whole(made, len(canvas.pages), attachments)
    return made


def paint_with_foot(painter: QPainter, canvas: Canvas, index: int, foot: str) -> None:
    """Paint a page with its foot: whose page it is, and which of how many."""
    for draw in canvas.pages[index]:
        draw(painter)
    box = QRectF(LEFT, BOTTOM + 30.0, WIDTH, 60.0)
    paint_line(painter, box.adjusted(0.0, 0.0, -_NUMBER, 0.0), foot, SMALL)
    paint_line(
        painter, box, canvas.speech.say(f"page {index + 1} of {len(canvas.pages)}"), SMALL,
        Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop,
    )  # fmt: skip


def streams(pdf: bytes) -> list[bytes]:
    """Return all streams of a PDF file that can be unpacked."""
    found = []
    # No \r before the last \n: it may be the last byte of what is packed.
    for match in re.finditer(rb"stream\n(.*?)\nendstream", pdf, re.DOTALL):
        try:
            found.append(zlib.decompress(match.group(1)))
        except zlib.error:
            found.append(match.group(1))
    return found


def _require_whole(pdf: bytes, pages: int, attachments: Mapping[str, bytes]) -> None:
    inside = streams(pdf)
    missing = [name for name, content in attachments.items() if content not in inside]
    counted = len(re.findall(rb"/Type\s*/Page\b", pdf))
    if missing or counted != pages or not pdf.rstrip().endswith(b"%%EOF"):
        raise StorageError(
            "export.pdf",
            f"The PDF is incomplete: {counted} of {pages} "
            f"pages{', without ' + ', '.join(missing) if missing else ''}.",
            "Write it again; other files are not affected.",
        )
