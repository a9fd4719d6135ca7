"""Printed reports: PDF with symbols, plots and a picture, all drawn as paths.

In: the frozen data of a report, or of a recall. Out: a PDF, verified by reading back, or a preview.

Read `_pdf` (the report), `_canvas` (page layout), `_paper` (head, end, and the file with
attachments), `_sections`, `_messages`, `_recall`, `_certificate` (certificates of the machine),
`_batch`, `_preview` (drawn and written in a side process). Numbers come from `export.report`, none
is computed here. It must not know sheets or the station.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.reports._batch import write_batch
    from ocmm_gui.reports._canvas import drawing
    from ocmm_gui.reports._pdf import write_pdf
    from ocmm_gui.reports._preview import (
        FormatText, PagePicture, PagePreview, certify_records, preview_formats, template_page,
        write_reports,
    )  # fmt: skip
    from ocmm_gui.reports._recall import pdf_bytes
    from ocmm_gui.reports._rig_sheet import rig_sheet_pdf
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "FormatText", "PagePicture", "PagePreview", "certify_records", "drawing", "pdf_bytes",
    "preview_formats", "rig_sheet_pdf", "template_page", "write_batch", "write_pdf",
    "write_reports",
]  # fmt: skip
