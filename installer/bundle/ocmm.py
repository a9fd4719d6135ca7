"""The program `ocmm` of the package."""

from installer.bundle.start import run_ocmm

run_ocmm()
