"""``python -m ocmm_core.cli``."""

from __future__ import annotations

from ocmm_core.cli._entry import main

main()
