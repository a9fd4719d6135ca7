"""Write the PDF report of jobs: ``python -m ocmm_gui.reports JOB... --out DIR``."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

from ocmm_core.documents import decode_json
from ocmm_core.export.report import report_of_job
from ocmm_core.export.template import Particulars, paper_of
from ocmm_core.inspection.archive import reopen_job
from ocmm_gui.reports._paper import draw, drawing
from ocmm_gui.reports._pdf import write_pdf


def main(arguments: list[str] | None = None) -> int:
    """Write the reports; return 0, 2 if one failed, 3 after an unexpected error."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("jobs", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--probes", type=Path)
    parser.add_argument("--calibrations", type=Path)
    parser.add_argument("--incomplete", action="store_true")
    parser.add_argument("--template", type=Path)
    parser.add_argument("--given", default="{}", help="Particulars, as JSON.")
    options = parser.parse_args(arguments)
    given = decode_json(options.given, Particulars)

    def write(job: Path) -> None:
        opened = reopen_job(job, options.probes, calibrations=options.calibrations)
        # Read for each job: one that cannot be drawn is reported, and the others are written.
        data = replace(report_of_job(opened), paper=paper_of(job, given, options.template))
        path = write_pdf(data, options.out, incomplete=options.incomplete)
        sys.stdout.write(f"{path}\n")

    with drawing():
        # One that cannot be drawn does not stop the others.
        codes = [
            draw(partial(write, job), "The report", "The jobs are unchanged.")
            for job in options.jobs
        ]
    return max(codes)


if __name__ == "__main__":
    sys.exit(main())
