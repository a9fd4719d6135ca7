"""The program `ocmm-acq` of the package."""

from installer.bundle.start import run_ocmm_acq

run_ocmm_acq()
