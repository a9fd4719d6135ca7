"""Jobs on the command line: measured, aligned, compared, reported, recalled.

In: a plan and a source, or job files. Out: job files, reports, tables, an exit code.

Read `_measuring` (`ocmm measure` and `ocmm demo`), `_headless` (a whole job without a window, parts
of a batch), `_plan` (check, new, import) with `_offers` (also of a planned rig), `_align` (also
ambient conditions, and comparison), `_report`, `_recall`, `_certificate` (certificates of the
machine), and `_recording` (raw frames).
It computes nothing: jobs are run by `station` and opened by `inspection.finished`.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cli.measure._align import (
        align_command, align_plan_command, compare_command, environment_command,
    )  # fmt: skip
    from ocmm_cli.measure._certificate import certificate_app
    from ocmm_cli.measure._headless import (
        await_part, exit_code, missing_sentences, print_explanations, print_states, print_table,
        print_verdict, run_job,
    )  # fmt: skip
    from ocmm_cli.measure._measuring import demo, has_display, measure, open_window
    from ocmm_cli.measure._plan import plan_app
    from ocmm_cli.measure._recall import recall_archived, recall_command
    from ocmm_cli.measure._recording import record_source
    from ocmm_cli.measure._report import report_command
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "align_command", "align_plan_command", "await_part", "certificate_app", "compare_command",
    "demo", "environment_command", "exit_code", "has_display", "measure", "missing_sentences",
    "open_window", "plan_app", "print_explanations", "print_states", "print_table", "print_verdict",
    "recall_archived", "recall_command", "record_source", "report_command", "run_job",
]  # fmt: skip
