"""Data of a report, and its text, JSON, workbook and PolyWorks files.

In: an evaluated job and a profile. Out: one frozen `ReportData`, and bytes of files made from it.

Read `_report_data` (all data of a report) and `_exporter` (interface of formats, and text files by
a profile). `_tables` and `_names` are shared by the formats: `_polyworks`,
`_json_file` with `_json_schema`, `_xlsx` with `_xlsx_reader`, `_first_article` (inspection plan,
AS9102). `_paper_facts` has the required statements of a test report. Templates are in the package
`template`. Each format has its own reader.
It must not know the registry, QIF or Q-DAS.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.export.report._exporter import (
        Exporter, Profile, ReportFormat, TableProfile, compare_delimited, delimited, load_profile,
        polyworks_profile, same_number,
    )  # fmt: skip
    from ocmm_core.export.report._first_article import AS9102, account_file, write_account
    from ocmm_core.export.report._json_file import JSON
    from ocmm_core.export.report._json_schema import ReportFile, read_report
    from ocmm_core.export.report._names import (
        check_file_stem, check_name, clean_text, last_moment, one_line, spreadsheet_text,
    )  # fmt: skip
    from ocmm_core.export.report._paper_facts import (
        NOT_STATED, PaperFact, paper_facts, plan_deviations, report_number, statements,
    )  # fmt: skip
    from ocmm_core.export.report._polyworks import POLYWORKS
    from ocmm_core.export.report._report_data import (
        Element, Instrument, ReportData, ReportedFeature, ReportedResult, report_of_job,
        reported_features,
    )  # fmt: skip
    from ocmm_core.export.report._tables import (
        Cell, Number, ReportTable, Units, exact_preview, features_table, head_table, points_table,
        report_table,
    )  # fmt: skip
    from ocmm_core.export.report._xlsx import XLSX
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "AS9102", "JSON", "NOT_STATED", "POLYWORKS", "XLSX", "Cell", "Element", "Exporter",
    "Instrument", "Number", "PaperFact", "Profile", "ReportData", "ReportFile", "ReportFormat",
    "ReportTable", "ReportedFeature", "ReportedResult", "TableProfile", "Units", "account_file",
    "check_file_stem", "check_name", "clean_text", "compare_delimited", "delimited",
    "exact_preview", "features_table", "head_table", "last_moment", "load_profile", "one_line",
    "paper_facts", "plan_deviations", "points_table", "polyworks_profile", "read_report",
    "report_number", "report_of_job", "report_table", "reported_features", "same_number",
    "spreadsheet_text", "statements", "write_account",
]  # fmt: skip
