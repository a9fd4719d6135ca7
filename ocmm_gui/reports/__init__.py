"""Printed reports: PDF with symbols, plots and a picture, all drawn as paths.

In: the frozen data of a report, or of a recall. Out: a PDF, verified by reading back, or a preview.

Read `_pdf` (the report), `_canvas` (page layout), `_paper` (head, end, and the file with
attachments), `_sections`, `_messages`, `_recall`, `_certificate` (certificates of the machine),
`_batch`, `_preview` (drawn and written in a side process). Numbers come from `export.report`, none
is computed here. It must not know sheets or the station.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.reports._batch import BatchTask
    from ocmm_gui.reports._canvas import drawing
    from ocmm_gui.reports._pdf import write_pdf
    from ocmm_gui.reports._preview import (
        CertificateTask, FormatText, PagePicture, PagePreview, PreviewTask, ReportTask,
        template_page,
    )  # fmt: skip
    from ocmm_gui.reports._recall import pdf_bytes
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "BatchTask", "CertificateTask", "FormatText", "PagePicture", "PagePreview", "PreviewTask",
    "ReportTask", "drawing", "pdf_bytes", "template_page", "write_pdf",
]  # fmt: skip
