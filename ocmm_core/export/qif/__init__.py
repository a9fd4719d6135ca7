"""Results as a QIF 3.0 document (ISO 23952), and plans from one.

In: the frozen data of a report; a plan or a model with its tolerances. Out: the bytes of a QIF
document, and findings of its check; a plan, and omitted items.

Read `_qif` (the exporter: head, units, datums, part), `_characteristics` (and their features), with
`_writer` (names of shapes and characteristics in QIF, ids, numbers, and faults that the schema
misses). `_plan_in` reads.
Its data come from `export.report`; it must not open a job.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.export.qif._plan_in import QifOmission, QifPlan, plan_of_qif
    from ocmm_core.export.qif._qif import QIF
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["QIF", "QifOmission", "QifPlan", "plan_of_qif"]
