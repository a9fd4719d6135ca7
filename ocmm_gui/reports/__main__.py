"""Write the PDF report of jobs: ``python -m ocmm_gui.reports JOB... --out DIR``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ocmm_core.errors import InternalError
from ocmm_core.export.report import report_of_job
from ocmm_core.failure import EXIT_INTERNAL, contained
from ocmm_core.inspection.archive import reopen_job
from ocmm_gui.reports._drawing import drawing
from ocmm_gui.reports._pdf import write_pdf


def main(arguments: list[str] | None = None) -> int:
    """Write the reports; return 0, 2 where one could not be made, 3 where nobody foresaw why."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("jobs", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--probes", type=Path)
    parser.add_argument("--calibrations", type=Path)
    parser.add_argument("--incomplete", action="store_true")
    options = parser.parse_args(arguments)
    try:
        with drawing():
            for job in options.jobs:
                opened = reopen_job(job, options.probes, calibrations=options.calibrations)
                report = report_of_job(opened)
                path = write_pdf(report, options.out, incomplete=options.incomplete)
                sys.stdout.write(f"{path}\n")
    except Exception as error:
        told = contained(error, "The report", "The jobs are unchanged.")
        sys.stderr.write(f"{told.what} {told.remedy}\n")
        return EXIT_INTERNAL if isinstance(told, InternalError) else 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
