"""Fits, uncertainties, speeds and simulations on the command line.

In: files of points, job files, reference pairs, a probe's design. Out: tables, JSON, SVG plots.

Read `_fit` (fits, certified references) with `_fit_rows`, `_uncertainty`, `_probe` (a probe before
it is built), `_study` (simulations of a procedure), `_coverage` (of whole measurements), `_bench`
(speed and memory of the hot path). It must not know `cli.calibrate`.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cli.study._bench import BenchRow, measure_speed, print_run, run_bench, run_for
    from ocmm_cli.study._coverage import (
        CoverageOutcome, CoverageSetup, coverage_table, more_characteristics, run_coverage,
        touch_all,
    )  # fmt: skip
    from ocmm_cli.study._fit import fit_command, verify_fits_command
    from ocmm_cli.study._probe import probe_app
    from ocmm_cli.study._study import probe_calibration, study_app
    from ocmm_cli.study._uncertainty import uncertainty_command
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "BenchRow", "CoverageOutcome", "CoverageSetup", "coverage_table", "fit_command",
    "measure_speed", "more_characteristics", "print_run", "probe_app", "probe_calibration",
    "run_bench", "run_coverage", "run_for", "study_app", "touch_all", "uncertainty_command",
    "verify_fits_command",
]  # fmt: skip
