"""Verification of every kind of file that this program writes.

In: a file or a folder. Out: its signer, its steps with authors and times, and faults.

Read `_audit_files` (the result, and single files) and `_audit` (jobs, histories, folders).
It must not recompute anything, nor write.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.export.audits._audit import audit, files_to_audit
    from ocmm_core.export.audits._audit_files import (
        Audit, AuditRow, AuditedKind, AuditedRecord, document_kind,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "Audit", "AuditRow", "AuditedKind", "AuditedRecord", "audit", "document_kind", "files_to_audit",
]  # fmt: skip
