"""Reports drawn and written in a side process, from a frozen job, and their preview."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QImage, QPixmap, QResizeEvent
from PySide6.QtWidgets import QLabel, QScrollArea, QWidget

from ocmm_core.documents import read_text, resource
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.export import EXPORTERS, PDF, preview, preview_text, write_report, write_together
from ocmm_core.export.certificate import Certificate, certificate_of_folder, signed_certificates
from ocmm_core.export.report import Instrument, ReportData, reported_features
from ocmm_core.export.template import Particulars, headed_paper, load_paper, template_in_use
from ocmm_core.inspection.evaluation import FeatureState, FeatureView, JobView
from ocmm_core.inspection.plan import load_plan
from ocmm_core.measuring import Climate
from ocmm_core.named_file import FileIdentity
from ocmm_core.settings import Settings
from ocmm_core.storage import JobHead
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict
from ocmm_gui.kit import dressed, later, vbox
from ocmm_gui.reports._canvas import drawing
from ocmm_gui.reports._certificate import certificate_pdf
from ocmm_gui.reports._pdf import lay_out, page_picture, pdf_file
from ocmm_gui.work import Teller

_PLAN = ("plans", "quick.toml")
_NAME = "SPECIMEN"
_NO_JOB = "00000000-0000-0000-0000-000000000000"
_MOST_LINES = 400
"""Only the beginning of a cloud of points is shown."""
_FAST = 1
"""Level of zlib: 20 ms a page, and compression to 2 %."""


def write_reports(
    data: ReportData, formats: tuple[str, ...], folder: Path, incomplete: bool, tell: Teller
) -> tuple[FileIdentity, ...]:
    """Return the written files, all or none; errors as `write_report` and `pdf_file`.

    `incomplete`: the user requested the report of a possibly incomplete job.
    """
    beside: dict[str, bytes] = {}
    if PDF.name in formats:
        tell(later("Drawing the PDF"), 0.3)
        with drawing():
            name, content = pdf_file(
                data,
                lambda page, pages: tell(
                    f"Drawing page {page} of {pages}", 0.3 + 0.4 * page / pages
                ),
            )
        beside[name] = content
    tables = tuple(name for name in formats if name != PDF.name)
    tell(later("Writing and verifying the files"), 0.7)
    tell.commit()
    paths = write_report(data, tables, folder, incomplete=incomplete, beside=beside)
    return tuple(map(FileIdentity.of_written, paths))


def certify_records(source: Path, folder: Path, tip: str, tell: Teller) -> tuple[Path, ...]:
    """Return the paths of pages, DCC and signature, all or none; errors as `certificate_of_folder`.

    `source`: folder of the records of a rig or a probe, or the file of an acceptance record. `tip`:
    of the probe; empty for everything else.
    """
    papers = _certificates(source, tip)
    tell(later("Drawing the PDF"), 0.1)
    with drawing():
        pages = [(paper, partial(certificate_pdf, paper)) for paper in papers]
        files = signed_certificates(pages, folder)
    tell(later("Writing and verifying the files"), 0.7)
    tell.commit()
    write_together(files)
    return tuple(files)


def _certificates(source: Path, tip: str) -> tuple[Certificate, ...]:
    """Return the certificates; for cameras, of verification and calibration."""
    sheet = load_paper(template_in_use(), Particulars())
    if tip or source.is_file():
        return (certificate_of_folder(source, sheet, tip),)
    found, faults = [], []
    for calibration in (False, True):
        try:
            found.append(certificate_of_folder(source, sheet, calibration=calibration))
        except InputError as error:
            faults.append(error)
    if not found:
        raise faults[0]
    return tuple(found)


@dataclass(frozen=True, slots=True)
class FormatText:
    """The beginning of a format's content, or the reason for its absence, as text."""

    name: str
    text: str


@dataclass(frozen=True, slots=True)
class PagePicture:
    """One page of the PDF."""

    index: int
    count: int
    """`index`, `count`: From zero; number of pages."""
    width: int
    height: int
    """`width`, `height`: Pixels."""
    packed: bytes
    """Compressed, 32 bits a pixel, as ``QImage.Format_RGB32``: a page is mostly white, and a
    hundred uncompressed ones are half a gigabyte."""

    @property
    def content(self) -> bytes:
        return zlib.decompress(self.packed)

    def image(self) -> QImage:
        return QImage(self.content, self.width, self.height, QImage.Format.Format_RGB32)


def preview_formats(data: ReportData, width: int, tell: Teller) -> None:
    """Send a `FormatText` for every format of the core, then every `PagePicture`."""
    for name in EXPORTERS:
        tell.send(FormatText(name, _text(data, name)))
    with drawing():
        canvas = lay_out(data)
        count = len(canvas.pages)
        for index in range(count):
            tell(f"Drawing page {index + 1} of {count}", (1 + index) / (1 + count))
            tell.send(_pictured(page_picture(canvas, index, data, width), index, count))


def _specimen_report() -> ReportData:
    """Return the report of an untouched part: all NOT MEASURED, no number made up, SIMULATED."""
    path = resource(*_PLAN)
    plan = load_plan(path)
    head = JobHead(
        job_uuid=_NO_JOB, created_utc="", software_version="", operator="", part=_NAME, serial="",
        plan_text=read_text(path), rig_text="", probe_text="",
    )  # fmt: skip
    view = JobView(
        job=_NAME,
        part=_NAME,
        operator="",
        features=tuple(
            FeatureView(one.name, one.shape, one.points, FeatureState.PENDING, (), None, "")
            for one in plan.features
        ),
        active="",
        characteristics=tuple(
            CharacteristicResult(
                name=one.name, kind=one.kind, features=tuple(one.features), nominal=one.nominal,
                lower=one.lower, upper=one.upper, measured=None, deviation=None, uncertainty=None,
                verdict=Verdict.NOT_MEASURED,
            )
            for one in plan.characteristics
        ),
        refusal=None,
        complete=False,
        requirements=None,
        simulated=True,
    )  # fmt: skip
    return ReportData(
        view, head, plan, None, reported_features(view, plan, None), calibration=Instrument(""),
        probe=Instrument(""), reference=Instrument(""), climate=Climate(),
    )  # fmt: skip


def template_page(settings: Settings, width: int) -> PagePicture:
    """Return page one of an empty report; InputError if template or logo cannot be used."""
    data = replace(_specimen_report(), paper=headed_paper(settings))
    with drawing():
        canvas = lay_out(data)
        return _pictured(page_picture(canvas, 0, data, width), 0, len(canvas.pages))


def _pictured(image: QImage, index: int, count: int) -> PagePicture:
    packed = zlib.compress(bytes(image.constBits()), _FAST)
    return PagePicture(index, count, image.width(), image.height(), packed)


def _text(data: ReportData, name: str) -> str:
    try:
        lines = preview_text(preview(data, name)).splitlines()
    except OcmmError as error:
        return f"{error.what}\n{error.remedy}"
    more = len(lines) - _MOST_LINES
    shown = "\n".join(lines[:_MOST_LINES])
    return f"{shown}\n… and {more} more lines" if more > 0 else shown


_GAP_PX = 12
_LEAST_PX, _MOST_PX = 300, 1240
"""Wider pages are no more legible, and slow down the window."""
_SAME_PX = 8


class PagePreview(QScrollArea):
    """All pages stacked, at the available width; scrolled by Page up and down."""

    widened = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Pages of the report")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOn)
        self.setWidgetResizable(True)
        inside = QWidget()
        self._pages = vbox(parent=inside, spacing=_GAP_PX)
        self.setWidget(inside)
        self._pictures: list[tuple[QLabel, PagePicture]] = []
        self.verticalScrollBar().valueChanged.connect(lambda _value: self._show_near())
        self._width = 0

    def width_in(self, room: int) -> int:
        """Return the width of a page for ``room``, pixels."""
        inside = room - self.verticalScrollBar().sizeHint().width() - 2 * _GAP_PX
        return min(max(inside, _LEAST_PX), _MOST_PX)

    def show_page(self, picture: PagePicture) -> None:
        """Show a page; the first one replaces an earlier report."""
        if picture.index == 0:
            self.clear()
            self.verticalScrollBar().setValue(0)
            self._width = picture.width
        page = dressed(QLabel(), f"Page {picture.index + 1} of {picture.count}")
        page.setFixedSize(picture.width, picture.height)
        self._pages.addWidget(page, 0, Qt.AlignmentFlag.AlignHCenter)
        self._pictures.append((page, picture))
        self._show_near()

    def page_count(self) -> int:
        """Return the number of pages; for tests."""
        return self._pages.count()

    def unpacked(self) -> list[bool]:
        """Return which pages are unpacked; for tests."""
        return [not page.pixmap().isNull() for page, _ in self._pictures]

    def clear(self) -> None:
        self._pictures.clear()
        while (item := self._pages.takeAt(0)) is not None:
            old = item.widget()
            if old is not None:
                old.deleteLater()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._show_near()
        if self._width and abs(self.width_in(self.width()) - self._width) > _SAME_PX:
            self.widened.emit()

    def _show_near(self) -> None:
        """Unpack the visible pages and their neighbours; release all others."""
        if not self._pictures:
            return
        top, high = self.verticalScrollBar().value(), max(self.viewport().height(), _LEAST_PX)
        y = self._pages.contentsMargins().top()
        for page, picture in self._pictures:
            # By their sizes: new pages are not laid out yet.
            near = y < top + 2 * high and y + picture.height > top - high
            if near and page.pixmap().isNull():
                page.setPixmap(QPixmap.fromImage(picture.image()))
            elif not near and not page.pixmap().isNull():
                page.setPixmap(QPixmap())
            y += picture.height + _GAP_PX

    def minimumSizeHint(self) -> QSize:
        return QSize(_LEAST_PX, _LEAST_PX)
