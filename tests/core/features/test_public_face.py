"""The face of the fits for other programs, and that the examples of its page run."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import ocmm_core.features as face
from ocmm_core.errors import FitError
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import GEOMETRY_NAMES, Shape
from tests.core.features.shape_samples import HALF_ANGLE, RADIUS, SECOND, ideal_points

PAGE = Path(__file__).parents[3] / "docs" / "integrator" / "python.md"
EXAMPLES = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.M | re.S)
MOST_LINES = 10


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_an_example_runs(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    example = EXAMPLES[number]
    assert len(example.splitlines()) <= MOST_LINES
    monkeypatch.chdir(tmp_path)
    turn = np.arange(12) * 0.5
    points = np.stack([10.0 * np.cos(turn), 10.0 * np.sin(turn), 0.0 * turn], axis=1)
    points += np.random.default_rng(1).normal(0.0, 0.002, points.shape)
    np.savetxt("bore.txt", points, fmt="%.6f")
    exec(compile(example, f"{PAGE.name}, example {number + 1}", "exec"), {})  # noqa: S102


def test_the_page_has_examples_and_the_face_has_what_it_names() -> None:
    assert len(EXAMPLES) >= 5
    for name in face.__all__:
        assert getattr(face, name) is not None
    missing = "nothing"
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        getattr(face, missing)


_SIZES = {
    "diameter": 2.0 * RADIUS,
    "length": 2.0 * RADIUS,
    "width": 2.0 * SECOND,
    "full angle": 2.0 * HALF_ANGLE,
    "ring diameter": 2.0 * RADIUS,
    "tube diameter": 2.0 * SECOND,
}


@pytest.mark.parametrize("shape", [*Shape])
def test_a_shape_has_its_sizes_and_refuses_others(shape: Shape) -> None:
    fit = fit_shape(shape, ideal_points(shape, np.random.default_rng(2), 14))
    for word, expected in _SIZES.items():
        name = word.replace(" ", "_")
        if word not in [size.word for size in shape.spec.sizes]:
            with pytest.raises(FitError, match=f"{shape.value} has no {word}"):
                getattr(fit, name)
        elif (shape, word) != (Shape.CONE, "diameter"):
            # The point of a cone is at the height of the points' centroid.
            assert getattr(fit, name) == pytest.approx(expected, abs=1e-9)


def test_the_covariance_is_what_draws_show() -> None:
    rng = np.random.default_rng(3)
    points = ideal_points(Shape.SPHERE, rng, 20)
    fit = fit_shape(Shape.SPHERE, points)
    stated = fit.covariance(0.001)
    assert stated.shape == (len(GEOMETRY_NAMES),) * 2
    assert np.allclose(stated, fit.covariance(0.001**2 * np.eye(60)), rtol=1e-12)
    drawn = np.array(
        [
            fit_shape(Shape.SPHERE, points + rng.normal(0.0, 0.001, points.shape)).geometry
            for _ in range(400)
        ]
    )
    moving = np.diag(stated) > 1e-12
    ratio = drawn.var(axis=0)[moving] / np.diag(stated)[moving]
    # Variances of 400 draws scatter by 7 %.
    assert np.all(np.abs(ratio - 1.0) < 0.35)
    for wrong in (0.0, -1.0, np.nan, np.eye(3)):
        with pytest.raises(FitError, match="uncertainty of the points"):
            fit.covariance(wrong)
