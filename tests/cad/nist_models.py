"""Public models from other authors, each read once per test process.

Reading one takes seconds, and five test files use the same five models.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from ocmm_cad.step import StepModel, read_model
from tests.host import needs_package

NIST = (
    "ctc_01_asme1_ap203", "ctc_01_asme1_ap242-e1", "ctc_03_asme1_ap242-e2", "ftc_06_asme1_ap242-e2",
    "ftc_07_asme1_ap242-e2",
)  # fmt: skip


def path_of(reference: Path, name: str) -> Path:
    """Return the file of a model."""
    return reference / "step" / f"nist_{name}.stp"


def nist_model(reference: Path, name: str) -> StepModel:
    """Return a model for the usual ball, and the part with it; neither can be changed."""
    needs_package("OCP", "the extra 'step'")
    return _read(path_of(reference, name))


@cache
def _read(path: Path) -> StepModel:
    return read_model(path, with_part=True)
