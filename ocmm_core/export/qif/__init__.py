"""Results as a QIF 3.0 document (ISO 23952), and plans from one.

In: the frozen data of a report; a plan or a model with its tolerances. Out: the bytes of a QIF
document, and what a check found in it; a plan, and what it could not take.

Read `_terms` (what our shapes and characteristics are called there), `_qif` (the exporter),
`_document` (head, units, datums, part), `_features`, `_characteristics`, with `_writer` (names,
ids, numbers). `_check` finds what a schema does not see. `_plan_in` reads.
It gets its data from `export.report` and must not open a job by itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.export.qif._plan_in import LeftOut, QifPlan, plan_of_qif
    from ocmm_core.export.qif._qif import QIF
else:
    __getattr__ = door(__name__, _plan_in="LeftOut QifPlan plan_of_qif", _qif="QIF")

__all__ = ["QIF", "LeftOut", "QifPlan", "plan_of_qif"]
