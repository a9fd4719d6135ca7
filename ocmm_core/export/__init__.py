"""Results as files for other programs.

In: a job as it is evaluated. Out: files of a report, read back and compared before they count.

Read `_registry` first: all formats, and the one way to write them. `template` says whose paper it
is, `report` holds the data of a report and its text, JSON, workbook and PolyWorks files; `qif`
holds QIF 3.0, `aqdef` Q-DAS. `_report_seal` signs what is written, `_completeness` asks before a
report of an unfinished job is made, `_files` writes several files as one, `_batch_table` the
statistics of a batch. `certificate` makes certificates of the machine. `_audit` and `_audit_files`
verify every kind of file that this program writes (`_audited`).
It must not know a station or a screen. The PDF is drawn in `ocmm_gui.reports`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.export import _registry as registry
    from ocmm_core.export._audit import audit, files_to_audit
    from ocmm_core.export._audit_files import document_kind
    from ocmm_core.export._audited import Audit, AuditedKind, AuditRow
    from ocmm_core.export._batch_table import BATCH_COLUMNS, batch_table
    from ocmm_core.export._completeness import missing_of, missing_words, require_complete
    from ocmm_core.export._files import write_together
    from ocmm_core.export._registry import (
        ALL,
        DEFAULT_FORMAT,
        EXPORTERS,
        FORMATS,
        PDF,
        chosen_formats,
        preview,
        preview_text,
        write_report,
    )
    from ocmm_core.export._report_seal import ENDING, ReportSealFound, check_report_seal
else:
    __getattr__ = door(
        __name__,
        _audit="audit files_to_audit",
        _audit_files="document_kind",
        _audited="Audit AuditRow AuditedKind",
        _batch_table="BATCH_COLUMNS batch_table",
        _completeness="missing_of missing_words require_complete",
        _files="write_together",
        _registry=(
            "ALL DEFAULT_FORMAT EXPORTERS FORMATS PDF chosen_formats preview preview_text "
            "registry write_report"
        ),
        _report_seal="ENDING ReportSealFound check_report_seal",
    )

__all__ = [
    "ALL",
    "BATCH_COLUMNS",
    "DEFAULT_FORMAT",
    "ENDING",
    "EXPORTERS",
    "FORMATS",
    "PDF",
    "Audit",
    "AuditRow",
    "AuditedKind",
    "ReportSealFound",
    "audit",
    "batch_table",
    "check_report_seal",
    "chosen_formats",
    "document_kind",
    "files_to_audit",
    "missing_of",
    "missing_words",
    "preview",
    "preview_text",
    "registry",
    "require_complete",
    "write_report",
    "write_together",
]
