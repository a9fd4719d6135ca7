"""Results as a QIF 3.0 document (ISO 23952).

In: the frozen data of a report. Out: the bytes of a QIF document, and what a check found in it.

Read `_terms` (what our shapes and characteristics are called there), `_qif` (the exporter),
`_document` (head, units, datums, part), `_features`, `_characteristics`, with `_writer` (names,
ids, numbers). `_check` finds what a schema does not see.
It gets its data from `export.report` and must not open a job by itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.export.qif._qif import QIF
else:
    __getattr__ = door(
        __name__,
        _qif="QIF",
    )

__all__ = [
    "QIF",
]
