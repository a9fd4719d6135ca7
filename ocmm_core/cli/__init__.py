"""The command line: ``ocmm``."""

from ocmm_core.cli.entry import main

__all__ = ["main"]
