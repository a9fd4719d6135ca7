"""``python -m ocmm_cli``."""

from __future__ import annotations

from ocmm_cli._entry import main

main()
