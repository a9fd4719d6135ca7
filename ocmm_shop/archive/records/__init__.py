"""Rows of a job in the archive, derived from its file alone.

In: a job file. Out: consistent rows, or the reason why nothing of it counts.

Read `_rows` (contents, their display, conditions for storing) and `_extract` (rows from a file).
It must not know how rows are stored.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_shop.archive.records._extract import (
        Extract, ExtractedJob, extract_job, signature_of, snapshot,
    )  # fmt: skip
    from ocmm_shop.archive.records._rows import (
        FORGED, LONGEST_SENTENCE, MOST_WHOLE, NOT_SIGNED, PART_VERDICTS, SIGNED, USES, VERDICTS,
        Delivery, JobRecord, JobRow, MarkRow, ResultRow, Sender, UseRow, check_delivery, check_mark,
        delivery_claim, is_identity, shown_text, station_claim, utc_text,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "FORGED", "LONGEST_SENTENCE", "MOST_WHOLE", "NOT_SIGNED", "PART_VERDICTS", "SIGNED", "USES",
    "VERDICTS", "Delivery", "Extract", "ExtractedJob", "JobRecord", "JobRow", "MarkRow",
    "ResultRow", "Sender", "UseRow", "check_delivery", "check_mark", "delivery_claim",
    "extract_job", "is_identity", "shown_text", "signature_of", "snapshot", "station_claim",
    "utc_text",
]  # fmt: skip
