"""Linearity from jobs: references by part, and the verdict of AIAG."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.inspection.finished import PartValue, Trend
from ocmm_core.tolerances.decisions import Verdict
from ocmm_shop.studies import linearity_of

REFERENCES = {"P1": 2.0, "P2": 4.0, "P3": 6.0, "P4": 8.0, "P5": 10.0}
# The example of AIAG MSA (linearity of a gauge, 5 parts with 12 measurements each).
AIAG = {
    "P1": "2.7 2.5 2.4 2.5 2.7 2.3 2.5 2.5 2.4 2.4 2.6 2.4",
    "P2": "5.1 3.9 4.2 5.0 3.8 3.9 3.9 3.9 3.9 4.0 4.1 3.8",
    "P3": "5.8 5.7 5.9 5.9 6.0 6.1 6.0 6.1 6.4 6.3 6.0 6.1",
    "P4": "7.6 7.7 7.8 7.7 7.8 7.8 7.8 7.7 7.8 7.5 7.6 7.7",
    "P5": "9.1 9.3 9.5 9.3 9.4 9.5 9.5 9.5 9.6 9.2 9.3 9.4",
}


def trend_of(values: dict[str, Float]) -> Trend:
    parts = tuple(
        PartValue(
            job=f"J{name}{number}", serial=name, created_utc="", value=float(value),
            uncertainty=0.01, verdict=Verdict.CONFORM,
        )
        for name, many in values.items()
        for number, value in enumerate(many)
    )  # fmt: skip
    return Trend("WIDTH", "distance", 0.0, 12.0, parts, (), None, None, "")


def good() -> dict[str, Float]:
    rng = np.random.default_rng(7)
    noise = 0.002 * rng.standard_normal((5, 12))
    # Without its mean: otherwise one study in twenty of a good gauge is judged not linear.
    noise -= noise.mean(axis=1, keepdims=True)
    return {name: ref + one for (name, ref), one in zip(REFERENCES.items(), noise, strict=True)}


def test_the_example_of_aiag_to_the_printed_digits() -> None:
    found = linearity_of(
        trend_of({name: np.array(text.split(), dtype=float) for name, text in AIAG.items()}),
        REFERENCES,
    )
    study = found.study
    # Printed there: bias = 0.73667 - 0.13167 reference, s = 0.23954.
    assert study.slope == pytest.approx(-0.131667, abs=5e-7)
    assert study.intercept == pytest.approx(0.736667, abs=5e-7)
    assert study.sigma == pytest.approx(0.23954, abs=5e-6)
    assert found.word == "NOT LINEAR"
    assert "changes by -131.667" in found.reason


def test_a_gauge_without_bias_is_linear() -> None:
    found = linearity_of(trend_of(good()), REFERENCES)
    assert found.word == "LINEAR"
    assert found.parts == tuple(REFERENCES)


def test_parts_and_references_belong_together() -> None:
    values = good()
    with pytest.raises(InputError, match=r"without a reference: P5 \(12\)"):
        linearity_of(trend_of(values), {k: v for k, v in REFERENCES.items() if k != "P5"})
    with pytest.raises(InputError, match="no result of part P6"):
        linearity_of(trend_of(values), {**REFERENCES, "P6": 12.0})
    with pytest.raises(InputError, match="10 are the least"):
        linearity_of(trend_of({**values, "P3": values["P3"][:9]}), REFERENCES)
