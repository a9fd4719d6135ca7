"""Pages as a PDF file with their data inside, verified by reading back (decision 18)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from PySide6.QtCore import QBuffer, QByteArray, QIODevice, QMarginsF, QRectF, Qt
from PySide6.QtGui import QPageLayout, QPageSize, QPainter, QPdfWriter

from ocmm_core.errors import StorageError
from ocmm_gui.reports._archival import PdfFacts, archival_pdf, attached
from ocmm_gui.reports._canvas import BOTTOM, LEFT, SMALL, WIDTH, PageCanvas, paint_line

_RESOLUTION = 1200
_UNITS_PER_INCH = 254.0
_NUMBER = 320.0
"""Width reserved for the page number."""


def written_pdf(
    canvas: PageCanvas,
    paint: Callable[[QPainter, int], None],
    attachments: Mapping[str, bytes],
    *,
    title: str,
    software: str,
    utc: str,
) -> bytes:
    """Return pages as PDF/A-3a with their data as associated files.

    ``paint``: paints the page of an index, see `paint_with_foot`; in tenths of a millimetre;
    ``attachments``: by name; others as in `PdfFacts`. StorageError if the file read back differs.
    """
    content = QByteArray()
    buffer = QBuffer(content)
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    writer = QPdfWriter(buffer)
    writer.setPdfVersion(QPdfWriter.PdfVersion.PdfVersion_1_6)
    writer.setPageSize(QPageSize(QPageSize.PageSizeId.A4))
    writer.setPageMargins(QMarginsF(0.0, 0.0, 0.0, 0.0), QPageLayout.Unit.Millimeter)
    writer.setResolution(_RESOLUTION)
    painter = QPainter(writer)
    painter.scale(_RESOLUTION / _UNITS_PER_INCH, _RESOLUTION / _UNITS_PER_INCH)
    for index in range(len(canvas.pages)):
        if index:
            writer.newPage()
        paint(painter, index)
    painter.end()
    buffer.close()
    facts = PdfFacts(title, canvas.speech.language, software, utc)
    made = archival_pdf(bytes(content.data()), canvas.tags, facts, attachments)
    _require_whole(made, len(canvas.pages), attachments)
    return made


def paint_with_foot(painter: QPainter, canvas: PageCanvas, index: int, foot: str) -> None:
    """Paint a page with its foot: identification, page number and count."""
    for draw in canvas.pages[index]:
        draw(painter)
    box = QRectF(LEFT, BOTTOM + 30.0, WIDTH, 60.0)
    paint_line(painter, box.adjusted(0.0, 0.0, -_NUMBER, 0.0), foot, SMALL)
    paint_line(
        painter, box, canvas.speech.say(f"page {index + 1} of {len(canvas.pages)}"), SMALL,
        Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop,
    )  # fmt: skip


def _require_whole(pdf: bytes, pages: int, attachments: Mapping[str, bytes]) -> None:
    try:
        counted, inside = attached(pdf)
    except ValueError as error:
        raise _incomplete(str(error)) from error
    missing = [name for name, content in attachments.items() if inside.get(name) != content]
    if missing or counted != pages:
        without = f", without {', '.join(missing)}" if missing else ""
        raise _incomplete(f"{counted} of {pages} pages{without}")


def _incomplete(why: str) -> StorageError:
    return StorageError(
        "export.pdf", f"The PDF is incomplete: {why}.",
        "Write it again; other files are not affected.",
    )  # fmt: skip
