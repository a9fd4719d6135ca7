"""Printed reports: PDF with symbols, plots and a picture, all drawn as paths.

In: the frozen data of a report, or of a recall. Out: a PDF, verified by reading back, or a preview.

Read `_pdf` (the report), `_paper_head`, `_sections`, `_part_picture` and `_paper_end` (its parts),
`_canvas` (page layout) and `_drawing` (without a window), `_messages`, `_pdf_writer` (the file with
attachments), `_recall`, `_certificate` (certificates of the machine), `_batch`, `_preview`. `_side`
writes in a side process.
Numbers come from `export.report`, none is computed here. It must not know sheets or the station.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.reports._batch import BatchPrinting
    from ocmm_gui.reports._drawing import drawing
    from ocmm_gui.reports._preview import PagePreview
    from ocmm_gui.reports._recall import pdf_bytes
    from ocmm_gui.reports._side import (
        CertificateWriting,
        FormatText,
        PagePicture,
        Previewing,
        Writing,
        template_page,
    )
else:
    __getattr__ = door(
        __name__,
        _batch="BatchPrinting",
        _drawing="drawing",
        _preview="PagePreview",
        _recall="pdf_bytes",
        _side="CertificateWriting FormatText PagePicture Previewing Writing template_page",
    )

__all__ = [
    "BatchPrinting", "CertificateWriting", "FormatText", "PagePicture", "PagePreview", "Previewing",
    "Writing", "drawing", "pdf_bytes", "template_page",
]  # fmt: skip
