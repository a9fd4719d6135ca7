"""The programs `ocmm` and `ocmm-acq` of the package."""

from installer.bundle.start import run

run()
