"""A frame that an earlier job has measured is as uncertain as that job knew it."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from benchmarks.decision_parts import GROUPS, asked, group_of
from ocmm_core.alignment import (
    BestFit,
    SavedFrame,
    alignment_fault,
    content_hash,
    doubt_of,
    frame_document,
    frame_of,
    is_covariance,
    load_frame,
    save_frame,
    saved_frame,
)
from ocmm_core.errors import InputError
from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.geometry import Float
from ocmm_core.measuring import FRAME, factors_of_matrix
from ocmm_core.tolerances.decisions import Verdict, evaluate_all
from ocmm_core.tolerances.kinds import evaluate
from ocmm_core.tolerances.zones import Frames

GROUP = group_of(GROUPS[0])
PLACE = asked("x of the ball", "coordinate", ["ball"], axis="x")
SIZE = asked("size of the ball", "diameter", ["ball"])
"""The errors that all points of a job share move frame and part alike: here there are none."""
OWN = 0.004**2 * np.eye(3 * len(GROUP.points) + 1)


def _measured(rng: np.random.Generator | None, names: tuple[str, ...]) -> dict[str, ActualFeature]:
    size = (len(GROUP.points), 3)
    errors = np.zeros(size) if rng is None else 0.004 * rng.normal(size=size)
    points = [
        replace(point, tip_world=point.tip_world + error)
        for point, error in zip(GROUP.points, errors, strict=True)
    ]
    features = [item for item in GROUP.features if item.name in names]
    found = actual_features(features, points)
    return {name: item for name, item in found.items() if isinstance(item, ActualFeature)}


def _handed_on(rng: np.random.Generator) -> SavedFrame:
    """Return the frame as a job with errors hands it on."""
    actual = _measured(rng, ("top", "a", "b"))
    geometries = {name: item.fit.geometry for name, item in actual.items()}
    rows = Frames(actual, GROUP.alignment).of_part("frame").by_coordinates
    jacobian = rows.dense(len(GROUP.points))
    T_part_from_world = frame_of(GROUP.alignment, geometries)
    document = frame_document(
        "bed", "2026-01-02", "job 1", T_part_from_world, {}, jacobian @ OWN @ jacobian.T
    )
    return saved_frame(document)


def _by_frame(rule: SavedFrame) -> Float:
    doubt = doubt_of(rule)
    assert doubt is not None
    by = doubt.contribution(GROUP.points).by
    assert by is not None
    joint: Float = by @ doubt.covariance @ by.T
    return joint


def test_the_error_of_a_saved_frame_is_in_the_uncertainty_of_what_it_holds() -> None:
    true = evaluate(PLACE, _measured(None, ("top", "a", "b", "ball")), GROUP.alignment).value
    rng = np.random.default_rng(5)
    seen, alone = [], []
    for _ in range(120):
        rule = _handed_on(rng)
        found = evaluate(PLACE, _measured(rng, ("ball",)), rule)
        gradient = found.gradient.dense(len(GROUP.points))
        own = float(gradient @ OWN @ gradient)
        whole = own + float(gradient @ _by_frame(rule) @ gradient)
        seen.append((found.value - true) / np.sqrt(whole))
        alone.append((found.value - true) / np.sqrt(own))
    # Three standard errors of a standard deviation from 120 draws: 19 %.
    assert np.std(seen) == pytest.approx(1.0, abs=0.19)
    # The frame is not for nothing here: without it U would be by half too small.
    assert np.std(alone) > 1.4


def test_what_does_not_refer_to_the_frame_does_not_know_it() -> None:
    rule = _handed_on(np.random.default_rng(1))
    ball = _measured(np.random.default_rng(2), ("ball",))
    gradient = evaluate(SIZE, ball, rule).gradient.dense(len(GROUP.points))
    assert float(gradient @ _by_frame(rule) @ gradient) < 1e-12


def test_nothing_is_proven_in_a_frame_of_unknown_uncertainty() -> None:
    rule = _handed_on(np.random.default_rng(1))
    old = msgspec.structs.replace(rule, covariance=())
    ball = _measured(np.random.default_rng(2), ("ball",))
    wide = [
        msgspec.structs.replace(PLACE, nominal=25.0, lower=-1.0),
        msgspec.structs.replace(SIZE, nominal=20.0, lower=-1.0),
    ]
    place, size = evaluate_all(wide, old, ball, factors_of_matrix(OWN), "iso14253-1")
    assert place.verdict is Verdict.NOT_PROVEN
    assert "saved frame bed has no uncertainty" in place.note
    assert size.verdict is Verdict.CONFORM
    assert doubt_of(old) is None
    known = factors_of_matrix(OWN + _by_frame(rule))
    for result in evaluate_all(wide, rule, ball, known, "iso14253-1"):
        assert result.verdict is Verdict.CONFORM
    # A fit that starts at it also reports it.
    assert doubt_of(BestFit(points=("a", "b"), locked=("z",), start=rule)) is not None
    assert FRAME.name == "Saved frame"


def test_a_document_keeps_how_well_the_frame_is_known(tmp_path: Path) -> None:
    rule = _handed_on(np.random.default_rng(1))
    T_frame_from_world = frame_of(rule, {})
    with_it = frame_document(
        "bed", "2026-01-02", "job", T_frame_from_world, {}, np.array(rule.covariance)
    )
    save_frame(tmp_path / "bed.toml", with_it)
    assert load_frame(tmp_path / "bed.toml") == with_it
    assert saved_frame(with_it).covariance == rule.covariance
    text = (tmp_path / "bed.toml").read_text()
    first = repr(rule.covariance[0][0])
    (tmp_path / "less.toml").write_text(text.replace(first, "1e-30", 1))
    with pytest.raises(InputError, match="does not match its hash"):
        load_frame(tmp_path / "less.toml")
    # A document from before has none, and its hash is the one it had.
    without = frame_document("bed", "2026-01-02", "job", T_frame_from_world, {})
    content = msgspec.to_builtins(msgspec.structs.replace(without, sha256=""))
    del content["covariance"]
    del content["simulated"]
    old = hashlib.sha256(msgspec.json.encode(content, order="sorted")).hexdigest()
    assert without.sha256 == old == content_hash(without)


def test_what_is_no_covariance_is_refused(tmp_path: Path) -> None:
    rule = _handed_on(np.random.default_rng(1))
    good = np.array(rule.covariance)
    assert is_covariance(good)
    assert alignment_fault(rule, {}, "alignment") is None
    crooked, negative = good.copy(), good.copy()
    crooked[0, 1] *= 2.0
    negative[2, 2] *= -1.0
    for wrong in (good[:5, :5], crooked, negative, good * np.nan):
        rows = tuple(tuple(map(float, row)) for row in wrong)
        bad = msgspec.structs.replace(rule, covariance=rows)
        fault = alignment_fault(bad, {}, "alignment")
        assert fault is not None
        assert fault[0] == "alignment.covariance"
        document = frame_document("b", "2026", "job", frame_of(rule, {}), {}, wrong)
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.toml"
        save_frame(path, document)
        with pytest.raises(InputError, match="covariance"):
            load_frame(path)
    ragged = msgspec.structs.replace(rule, covariance=(*rule.covariance[:5], (0.0,)))
    assert alignment_fault(ragged, {}, "alignment") is not None
