"""``ocmm selftest reliability`` from a checkout."""

from __future__ import annotations

import typer

from ocmm_bench.campaign import reliability

if __name__ == "__main__":
    typer.run(reliability)
