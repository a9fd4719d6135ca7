"""The view of an alignment: residuals, their uncertainty, open freedoms, remedies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.alignment import (
    Alignment,
    BestFit,
    BoundAlignment,
    DatumAlignment,
    DatumReferenceFrame,
    Relocation,
    frame_jacobian,
    frame_of,
    preview_alignment,
    report_lines,
    settled,
)
from ocmm_core.alignment._rules import Condition, ControlPoint, PlaneAxisPoint, ReferencePoints
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import DIRECTION, POINT
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.measuring import factors_of_matrix
from tests.core.alignment.parts import NOMINALS, SHAPES, actual_of, anywhere, measured

RULES: dict[str, Alignment] = {
    "3-2-1": DatumAlignment(primary="A", secondary=("H", "G"), origin="H"),
    "3-2-1 of an axis": DatumAlignment(primary="A", secondary=("X",), origin="P"),
    "plane, axis, point": PlaneAxisPoint(plane="A", axis="X", point="S"),
    "datums": DatumReferenceFrame(datums=("K", "A", "X")),
    "best fit": BestFit(points=("H", "G", "S", "P"), weights=(1.0, 2.0, 1.0, 0.5)),
    "locked": BestFit(
        points=("H", "G", "S"),
        locked=("rx", "z"),
        start=DatumReferenceFrame(datums=("A", "H", "G")),
    ),
    "rps": ReferencePoints(
        conditions=tuple(
            Condition(feature=name, direction=way)
            for name, way in (
                ("H", (0.0, 0.0, 1.0)),
                ("G", (0.0, 0.0, 1.0)),
                ("S", (0.0, 0.0, 1.0)),
                ("H", (0.0, 1.0, 0.0)),
                ("G", (0.0, 1.0, 0.0)),
                ("P", (1.0, 0.0, 0.0)),
            )
        )
    ),
    "relocation": Relocation(
        name="bed",
        digest="",
        control=tuple(
            ControlPoint(feature=name, place=tuple(NOMINALS[name][POINT].tolist()))
            for name in ("H", "G", "S")
        ),
    ),
}
SIGMA = 0.005
SIGMA_TURN = 2e-5


def _sigmas() -> Float:
    """Return the standard deviations of the 12 numbers of every feature, (n, 12)."""
    sigmas = np.zeros((len(NOMINALS), 12))
    sigmas[:, POINT], sigmas[:, DIRECTION] = SIGMA, SIGMA_TURN
    return sigmas


@pytest.mark.parametrize("name", list(RULES))
def test_uncertainty_of_frame_and_residuals_is_that_of_a_monte_carlo(name: str) -> None:
    """400 noisy parts: their standard deviation scatters by 3.5 %; 15 % is four times that."""
    rng = np.random.default_rng(11)
    T_world_from_part = anywhere(rng)
    geometries = measured(T_world_from_part, rng)
    bound = settled(BoundAlignment(RULES[name], SHAPES, NOMINALS), geometries)
    actual = actual_of(geometries)
    start = frame_of(bound, geometries)
    sigmas = _sigmas()
    covariance = np.diag(np.append(sigmas.ravel() ** 2, 0.0))
    jacobian = frame_jacobian(bound, actual, start).dense(4 * len(actual))
    linear = np.sqrt(np.diag(jacobian @ covariance @ jacobian.T))
    motions, moved = [], []
    for _ in range(400):
        noisy = {
            key: geometry + sigma * rng.normal(size=12)
            for (key, geometry), sigma in zip(geometries.items(), sigmas, strict=True)
        }
        change = frame_of(bound, noisy).compose(start.inverse())
        turn = np.array([change.rotation[2, 1], change.rotation[0, 2], change.rotation[1, 0]])
        motions.append(np.concatenate([turn, change.translation]))
        moved.append(frame_of(bound, noisy).apply(noisy["P"][POINT]))
    scatter = np.std(motions, axis=0)
    assert np.all(np.abs(scatter - linear) < 0.15 * linear + 1e-9)

    report = preview_alignment(bound, actual, factors_of_matrix(covariance))
    residual = {item.feature: item for item in report.residuals}["P"]
    worst = np.sqrt(np.linalg.eigvalsh(np.cov(np.array(moved).T))[-1])
    assert residual.distance_uncertainty == pytest.approx(2.0 * worst, rel=0.15)
    assert residual.aligned == ("P" in bound.features)
    assert report.can_be_accepted


def test_residuals_say_what_is_off_and_by_how_much() -> None:
    """The slot's hole G is 0.3 mm too far in x; a hole's depth is not its own."""
    rng = np.random.default_rng(5)
    T_world_from_part = anywhere(rng)
    geometries = measured(T_world_from_part, rng, depth=5.0)
    geometries["G"][POINT] += T_world_from_part.rotation @ np.array([0.3, 0.0, 0.0])
    rule = DatumReferenceFrame(datums=("A", "H", "C"))
    report = preview_alignment(BoundAlignment(rule, SHAPES, NOMINALS), actual_of(geometries))
    found = {item.feature: item for item in report.residuals}
    assert found["G"].offset == pytest.approx([0.3, 0.0, 0.0], abs=1e-9)
    assert found["G"].distance_uncertainty is None
    assert max(item.distance for name, item in found.items() if name != "G") < 1e-9
    assert [item.feature for item in report.residuals][:3] == ["A", "H", "C"]
    assert "Largest residual: G 0.300 mm." in report.advice[-1]
    lines = report_lines(report)
    assert lines[0] == "Frame: part frame of A|H|C"
    assert lines[1] == "Open degrees of freedom: none"
    assert any(line.startswith("(G)") and "0.3000" in line for line in lines)


def test_what_is_open_is_said_with_what_to_do() -> None:
    geometries = measured(RigidTransform.identity(), np.random.default_rng(5))
    rule = DatumReferenceFrame(datums=("A",))
    report = preview_alignment(BoundAlignment(rule, SHAPES, NOMINALS), actual_of(geometries))
    assert report.free == ("rotation about z", "translation square to z")
    assert (
        "Not constrained by the datums: rotation about z, translation square to z"
        in report.advice[0]
    )
    three = BestFit(points=("S", "G", "H"))
    actual = actual_of(geometries)
    # G was touched itself, H is as if it were constructed.
    actual["G"] = replace(actual["G"], raw=actual["G"].fit)
    report = preview_alignment(BoundAlignment(three, SHAPES, NOMINALS), actual)
    assert "take a fourth" in " ".join(report.advice)
    assert "G: the depth of a circle or slot is where it was probed" in " ".join(report.advice)


def test_a_missing_feature_is_told_instead_of_a_frame() -> None:
    geometries = measured(RigidTransform.identity(), np.random.default_rng(5))
    actual: dict[str, ActualFeature | FitError] = {**actual_of(geometries)}
    actual["H"] = FitError("feature.too_few_points", "H has 1 of 3 points.", "Take the others.")
    rule = DatumReferenceFrame(datums=("A", "H"))
    report = preview_alignment(BoundAlignment(rule, SHAPES, NOMINALS), actual)
    assert not report.can_be_accepted
    assert report.advice == ("H has 1 of 3 points. Take the others.",)
    del actual["H"]
    report = preview_alignment(BoundAlignment(rule, SHAPES, NOMINALS), actual)
    assert report.advice == ("The part frame needs H, which is not measured. Measure H.",)
