"""Write the PDF report of jobs: ``python -m ocmm_gui.reports JOB... --out DIR``."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from ocmm_core.errors import InternalError
from ocmm_core.export.report_data import report_of_job
from ocmm_core.failure import EXIT_INTERNAL, contained
from ocmm_core.inspection.reopen import reopen_job


def main(arguments: list[str] | None = None) -> int:
    """Write the reports; return 0, 2 where one could not be made, 3 where nobody foresaw why."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("jobs", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--probes", type=Path)
    options = parser.parse_args(arguments)
    # A report needs no screen, and a screen may not be there.
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    application = None
    try:
        from PySide6.QtGui import QGuiApplication

        from ocmm_gui.reports.pdf import write_pdf

        application = QGuiApplication.instance() or QGuiApplication([])
        for job in options.jobs:
            report = report_of_job(reopen_job(job, options.probes))
            sys.stdout.write(f"{write_pdf(report, options.out)}\n")
    except Exception as error:
        told = contained(error, "The report", "The jobs are as they were.")
        sys.stderr.write(f"{told.what} {told.remedy}\n")
        return EXIT_INTERNAL if isinstance(told, InternalError) else 2
    finally:
        del application
    return 0


if __name__ == "__main__":
    sys.exit(main())
