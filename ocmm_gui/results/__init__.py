"""Results of a job: characteristics, uncertainties with reasons, and reports.

In: the running job, or a job file opened read-only. Out: tables, budgets, trials, comparisons,
reports.

Read `_results_sheet` with `_job_source`, `_result_table`, `_result_detail`, then the
other sheets: `_alignment_sheet`, `_compare_sheet`, `_report_sheet` with `_report_writer`. Long
computations run in side processes. It must not know operator, plan editor, Maintain or wizards.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.results._alignment_sheet import AlignmentSheet
    from ocmm_gui.results._compare_sheet import CompareSheet
    from ocmm_gui.results._job_source import JobSource
    from ocmm_gui.results._report_sheet import ReportSheet
    from ocmm_gui.results._report_writer import ReportWriter, WrittenReports
    from ocmm_gui.results._results_sheet import ResultsSheet
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "AlignmentSheet", "CompareSheet", "JobSource", "ReportSheet", "ReportWriter", "ResultsSheet",
    "WrittenReports",
]  # fmt: skip
